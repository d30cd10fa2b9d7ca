"""A closed loop as result.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from aerosid.compatibility import KinematicConsistency
from aerosid.flight_model.linear_model import LINEAR_STATES
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.effect_rows import Effect
from aerosid.loop.linear_analysis import LinearRow
from aerosid.loop.result import ClosedLoop
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
    NextFlightEntry,
    PrefilterEntry,
    ResultFile,
    Role,
    ScreeningEntry,
)


def input_files(result: ClosedLoop) -> tuple[InputFile, ...]:
    """The files that the result depends on: logs in the order of the call, then the aircraft file."""

    def entry(log: FlightLog, role: Role) -> InputFile:
        return InputFile(path=log.path or log.name, sha256=log.sha256, role=role)

    return (
        *(entry(log, "identification") for log in result.identification),
        *(entry(log, "validation") for log in result.validation),
        InputFile(path=result.aircraft.path, sha256=result.aircraft.sha256, role="aircraft"),
    )


def result_file(result: ClosedLoop) -> ResultFile:
    """The contents of result.json.

    Parameters
    ----------
    result : ClosedLoop
        What one run of the loop found. NaN and infinite numbers become null.
    """
    return ResultFile(
        schema_=SCHEMA,
        aerosid=result.version,
        seed=result.seed,
        inputs=input_files(result),
        verdict=result.verdict.name.lower(),
        summary=result.summary,
        effects=tuple(EffectRow.model_validate(_effect(effect)) for effect in result.effects),
        alternatives=tuple(
            AlternativeRow.model_validate({**_effect(effect), "instead_of": effect.instead_of})
            for effect in result.alternatives
        ),
        derivatives=tuple(DerivativeEntry.model_validate(row) for row in result.derivatives),
        coefficients=tuple(CoefficientEntry.model_validate(row) for row in result.coefficients),
        error=tuple(ErrorEntry.model_validate(row) for row in result.errors),
        prefilter=PrefilterEntry.model_validate(result.prefilter),
        screening=tuple(ScreeningEntry.model_validate(row) for row in result.screening),
        fit=tuple(FitEntry.model_validate(row) for row in result.fit),
        innovations=tuple(InnovationEntry.model_validate(row) for row in result.innovations),
        correlation=CorrelationEntry.model_validate(result.correlation),
        notes=result.notes,
        linear=tuple(_linear(row) for row in result.linear),
        next_flight=None if result.next_flight is None else NextFlightEntry.model_validate(result.next_flight),
        kinematics=_kinematics(result.kinematics),
    )


def _kinematics(agreement: KinematicConsistency | None) -> KinematicsEntry | None:
    if agreement is None:
        return None
    values = {entry.name: getattr(agreement, entry.name) for entry in fields(agreement)}
    return KinematicsEntry.model_validate({**values, "verdict": agreement.verdict.name.lower()})


def _linear(row: LinearRow) -> LinearEntry:
    values = {entry.name: getattr(row, entry.name) for entry in fields(row)}
    matrices = {name: tuple(map(tuple, values[name].tolist())) for name in ("A", "B")}
    return LinearEntry.model_validate({**values, **matrices, "states": LINEAR_STATES})


def result_text(result: ClosedLoop) -> str:
    """The text of result.json: identical bytes for an identical result.

    Notes
    -----
    `time` and `parameters` are left out of effects that have none, `next_flight` where nothing is left to decide, and
    `kinematics` where too few channels are there; every other key always stands.
    """
    document = result_file(result).model_dump(by_alias=True)
    for effect in (*document["effects"], *document["alternatives"]):
        for key in ("time", "parameters"):
            if effect[key] is None:
                del effect[key]
    for key in ("next_flight", "kinematics"):
        if document[key] is None:
            del document[key]
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _effect(effect: Effect) -> Mapping[str, Any]:
    """The effect's fields, without parameters where it has none."""
    values = {entry.name: getattr(effect, entry.name) for entry in fields(effect)}
    return {**values, "parameters": dict(effect.parameters) or None}
