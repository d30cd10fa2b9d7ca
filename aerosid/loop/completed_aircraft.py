"""The completed aircraft file: the declared model with the findings in it, and its provenance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import aerosid
from aerosid.aircraft import Aircraft, CompletionRecord, DeclaredEffect, LogOfCompletion
from aerosid.aircraft.completion_record import shortened
from aerosid.effects import ActiveEffect
from aerosid.estimation.effects_in_flight import in_acting_order
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.insignificant_derivatives import Completion
from aerosid.loop.provenance import Provenance
from aerosid.loop.roles import Role
from aerosid.loop.verdict import Verdict
from aerosid.notation import finite
from aerosid.search.findings import Finding

BOUNDS = "sigma: one standard error of the joint estimate, corrected for coloured residuals"


def complete_aircraft(aircraft: Aircraft, completion: Completion, logs: int, record: CompletionRecord) -> Aircraft:
    """The aircraft with the completed model's values and the effects that are no terms.

    Parameters
    ----------
    aircraft : Aircraft
        As given.
    completion : Completion
        Missing effects, and derivatives fixed at declared values.
    logs : int
        Number of identification logs: with more than one a step change is written with its log.
    record : CompletionRecord
        Origin of the numbers.
    """
    found = completion.found
    completed, uncertainty = found.completed, found.completed_deviations
    values = {
        (coefficient, str(term)): (completed.model.value((coefficient, term)), finite(float(uncertainty.corrected[n])))
        for n, (coefficient, term) in enumerate(completed.free)
        if (coefficient, term) not in completion.fixed
    }
    effects = [
        DeclaredEffect(
            kind=finding.kind,
            where=finding.where,
            value=finding.value,
            time=finding.time,
            log=finding.log if logs > 1 else "",
            std_error=finite(finding.std_error),
            parameters={name: value for name, value, _, _ in finding.parameters},
        )
        for finding in listed_in_acting_order(found.findings, completed.effects)
        if finding.entry is None
    ]
    not_shown = [(coefficient, str(term)) for coefficient, term in completion.not_shown]
    return aircraft.completed(values, effects, not_shown, record)


def listed_in_acting_order(findings: Sequence[Finding], effects: Sequence[ActiveEffect]) -> list[Finding]:
    """The findings, those on one control in the order in which they act: declared effects act as they are listed."""
    order = [active.name for _, active in in_acting_order(effects)]
    ordered = list(findings)
    for control in {where for _, where in order}:
        places = [n for n, each in enumerate(ordered) if each.where == control and (each.kind, each.where) in order]
        own = sorted((ordered[n] for n in places), key=lambda each: order.index((each.kind, each.where)))
        for n, each in zip(places, own, strict=True):
            ordered[n] = each
    return ordered


def completion_record(
    aircraft: Aircraft,
    logs: Mapping[Role, Sequence[FlightLog]],
    verdict: Verdict,
    provenance: Provenance,
    not_shown: Sequence[tuple[str, Any]] = (),
) -> CompletionRecord:
    """Origin for the completed file: names without folders, so that it may be passed on."""
    return CompletionRecord(
        program=f"aerosid {aerosid.__version__}",
        date=provenance.date,
        verdict=verdict.name.lower(),
        declared_file=Path(aircraft.path).name,
        declared_sha256=aircraft.sha256,
        declared_source=shortened(aircraft.source),
        logs=tuple(
            LogOfCompletion(file_name(log), role, log.sha256, float(log.time[0]), float(log.time[-1]))
            for role, those in logs.items()
            for log in those
        ),
        settings={name: str(value) for name, value in provenance.settings.items()},
        not_shown=tuple(f"{coefficient} {term}" for coefficient, term in not_shown),
        bounds=BOUNDS,
    )


def file_name(log: FlightLog) -> str:
    """The log's file without its folders; its name where it is from no file."""
    return Path(log.path).name if log.path else log.name
