"""The chain as a study runs it: re-estimation of the declared model, search for what is missing, refinement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.effects import ActiveEffect
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.evidence import Deviations, deviations
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.flight_model.aerodynamics import Entry, controls_of
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.identification import BEFORE
from aerosid.search.attribution import attribute
from aerosid.search.candidate_terms import candidate_entries
from aerosid.search.findings import Finding
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.settings import AttributionSettings
from aerosid.studies.monte_carlo.plan import Catalogue

NEARBY = RefinementSettings(cost_tolerance=1.0, variance_tolerance=0.1)
"""From a start that another flight gave: what a wrong structure still creeps is nothing beside what it lacks."""


@dataclass(frozen=True)
class Found:
    """What the chain made of one log.

    `before` the declared structure re-estimated, None where the structure was known; `completed` with all that was
    found, `spread` its deviations.
    """

    manoeuvre: Manoeuvre
    before: Refinement | None
    completed: Refinement
    spread: Deviations
    findings: tuple[Finding, ...]


def search(
    log: FlightLog,
    aircraft: Aircraft,
    catalogue: Catalogue,
    structure: Sequence[Entry] = (),
    effects: Sequence[ActiveEffect] = (),
    start: Sequence[float] | None = None,
) -> Found:
    """What one log says of the aircraft.

    Parameters
    ----------
    log : FlightLog
        The manoeuvre.
    aircraft : Aircraft
        The declared model.
    catalogue : "known", "terms" or "all"
        What the search may name.
    structure : sequence of Entry
        With "known": the terms beside those declared, estimated from zero.
    effects : sequence of ActiveEffect
        With "known": the effects that are no term, with start values.
    start : sequence of float, optional
        Values of the declared terms to begin their re-estimation from; by default those declared.

    Raises
    ------
    LogError, EstimationError
        As of `close_loop`.
    """
    known = catalogue == "known"
    candidates = tuple(structure) if known else candidate_entries(aircraft, [log])
    airspeed = float(np.nanmean(log["V"])) if "V" in log and np.isfinite(log["V"]).any() else 0.0
    plain = declared_model(aircraft, airspeed, [term for _, term in candidates])
    manoeuvre = prepare(log, aircraft, plain.columns)
    given = declared_effects(aircraft, controls_of(plain), [manoeuvre])
    declared = with_columns_of(plain, (*given, *effects))
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives if not d.fixed)
    if known:
        entries = (*free, *(entry for entry in structure if entry not in free))
        completed = refine(declared.extended(entries), [manoeuvre], entries, effects=(*given, *effects))
        return Found(manoeuvre, None, completed, deviations(completed, [manoeuvre]), ())
    begin = declared if start is None else declared.with_values(_begun(declared.values, start))
    before = refine(begin, [manoeuvre], free, effects=given, settings=BEFORE if start is None else NEARBY)
    hypotheses = term_hypotheses(candidates)
    coefficients = aircraft.coefficients if catalogue == "all" else ()
    if coefficients:
        hypotheses += effect_hypotheses(declared, [manoeuvre], coefficients)
    settings = AttributionSettings(disturbances=catalogue == "all")
    found = attribute(before, [manoeuvre], hypotheses, coefficients, settings)
    return Found(manoeuvre, before, found.completed, found.completed_deviations, found.findings)


def _begun(values: NDArray[np.float64], start: Sequence[float]) -> NDArray[np.float64]:
    """The values with the first of them, those of the declared terms, replaced."""
    begun = values.copy()
    begun[: len(start)] = start
    return begun
