"""A closed loop as result.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from aerosid.compatibility import KinematicConsistency
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.effect_rows import Effect
from aerosid.loop.flying_qualities.linear_analysis import LinearRow
from aerosid.loop.provenance import all_settings
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES
from aerosid.reporting.next_flight_schema import NextFlightEntry
from aerosid.reporting.result_schema import (
    SCHEMA,
    AlternativeRow,
    CoefficientEntry,
    CorrelationEntry,
    DerivativeEntry,
    EffectRow,
    ErrorEntry,
    FitEntry,
    InnovationEntry,
    InputFile,
    KinematicsEntry,
    LinearEntry,
    OtherDerivativeEntry,
    PredictionEntry,
    PrefilterEntry,
    ProvenanceEntry,
    ResultFile,
    Role,
    ScreeningEntry,
    SecondOpinionEntry,
)


def input_files(result: ClosedLoop) -> tuple[InputFile, ...]:
    """The input files of the result: logs in the order of the call, then the aircraft file."""

    def entry(log: FlightLog, role: Role) -> InputFile:
        return InputFile(
            path=portable(log.path or log.name),
            sha256=log.sha256,
            role=role,
            span=(float(log.time[0]), float(log.time[-1])),
            channel_map=portable(log.channel_map) or None,
            channel_map_sha256=log.channel_map_sha256 or None,
        )

    return (
        *(entry(log, role) for role in ROLES for log in getattr(result, role)),
        InputFile(path=portable(result.aircraft.path), sha256=result.aircraft.sha256, role="aircraft"),
    )


def portable(path: str) -> str:
    """A path as given; an absolute one by its last part, since a folder of one machine means nothing elsewhere."""
    return Path(path).name if Path(path).is_absolute() else path


def result_file(result: ClosedLoop) -> ResultFile:
    """The contents of result.json.

    Parameters
    ----------
    result : ClosedLoop
        The result of close-loop. NaN and infinite numbers become null.
    """
    return ResultFile(
        schema_=SCHEMA,
        aerosid=result.version,
        seed=result.seed,
        inputs=input_files(result),
        verdict=result.verdict.name.lower(),
        summary=result.summary,
        effects=tuple(EffectRow.model_validate(_effect(effect)) for effect in result.effects),
        alternatives=tuple(AlternativeRow.model_validate(_effect(effect)) for effect in result.alternatives),
        derivatives=tuple(DerivativeEntry.model_validate(row) for row in result.derivatives),
        coefficients=tuple(CoefficientEntry.model_validate(row) for row in result.coefficients),
        error=tuple(ErrorEntry.model_validate(row) for row in result.errors),
        prefilter=PrefilterEntry.model_validate(result.prefilter),
        screening=tuple(ScreeningEntry.model_validate(row) for row in result.screening),
        fit=tuple(FitEntry.model_validate(row) for row in result.fit),
        innovations=tuple(InnovationEntry.model_validate(row) for row in result.innovations),
        predictions=tuple(PredictionEntry.model_validate(row) for row in result.predictions),
        other_derivatives=tuple(OtherDerivativeEntry.model_validate(row) for row in result.other_derivatives),
        correlation=CorrelationEntry.model_validate(result.correlation),
        notes=result.notes,
        linear=tuple(_linear(row) for row in result.linear),
        next_flight=None if result.next_flight is None else NextFlightEntry.model_validate(result.next_flight),
        kinematics=kinematics_entry(result.kinematics),
        provenance=ProvenanceEntry.model_validate(result.provenance),
        settings=all_settings(result.settings),
        settings_changed=tuple(result.provenance.settings),
        decided_by=result.decided_by,
        decided_by_validation=result.decided_by_validation,
        second_opinion=None
        if result.second_opinion is None
        else SecondOpinionEntry.model_validate(result.second_opinion),
    )


def kinematics_entry(agreement: KinematicConsistency | None) -> KinematicsEntry | None:
    """The data compatibility as in result.json; None where it was not checked."""
    if agreement is None:
        return None
    values = {entry.name: getattr(agreement, entry.name) for entry in fields(agreement)}
    return KinematicsEntry.model_validate({**values, "verdict": agreement.verdict.name.lower()})


def _linear(row: LinearRow) -> LinearEntry:
    values = {name: getattr(row, name) for name in LinearEntry.model_fields}
    matrices = {name: tuple(map(tuple, values[name].tolist())) for name in ("A", "B")}
    return LinearEntry.model_validate({**values, **matrices})


def result_text(result: ClosedLoop) -> str:
    """The text of result.json: identical bytes for an identical result.

    Notes
    -----
    `time`, `along`, `log`, `parameters`, `hold_out_gain`, `confirmation` and `unseen_better` are omitted from effects
    that have none, `next_flight` where no question is open, `second_opinion` where none was computed, and `kinematics`
    where too few channels are recorded; every other key is always present.
    """
    document = result_file(result).model_dump(by_alias=True)
    for effect in (*document["effects"], *document["alternatives"]):
        for holder, keys in ((effect, _SELDOM), (effect["evidence"], _SELDOM_EVIDENCE)):
            for key in keys:
                if holder.get(key) is None:
                    holder.pop(key, None)
    for entry in document["inputs"]:
        for key in ("span", "channel_map", "channel_map_sha256"):
            if entry[key] is None:
                del entry[key]
    for key in ("next_flight", "kinematics", "second_opinion"):
        if document[key] is None:
            del document[key]
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


_SELDOM = ("time", "along", "log", "parameters")
_SELDOM_EVIDENCE = ("hold_out_gain", "confirmation", "unseen_better")


def _effect(effect: Effect) -> Mapping[str, Any]:
    """The effect's fields, without `parameters` where it has none."""
    values = {entry.name: getattr(effect, entry.name) for entry in fields(effect)}
    seldom = {"along": effect.along or None, "log": effect.log or None, "parameters": dict(effect.parameters) or None}
    return {**values, **seldom}
