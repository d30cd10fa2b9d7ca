"""The chain as a study runs it: `identify` of the loop, or the estimate of a structure that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.effects import ActiveEffect
from aerosid.errors import EstimationError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.flight_model.aerodynamics import Entry, controls_of
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.identification import identify
from aerosid.loop.settings import LoopSettings
from aerosid.search.findings import Finding
from aerosid.studies.monte_carlo.plan import Catalogue


@dataclass(frozen=True)
class Found:
    """What the chain made of one log.

    `before` the declared structure re-estimated, None where the structure was known; `completed` with all that was
    found, `uncertainty` its deviations.
    """

    manoeuvre: Manoeuvre
    before: Refinement | None
    completed: Refinement
    uncertainty: Deviations
    findings: tuple[Finding, ...]


def loop_settings(catalogue: Catalogue, start: Sequence[float] = ()) -> LoopSettings:
    """The loop's settings in a study: those of `close_loop`, but for what it reports beside its findings.

    Where terms alone are asked for, the instruments are not compared with each other either.
    """
    everything = catalogue == "all"
    return LoopSettings(
        catalogue="all" if everything else "terms",
        kinematics=everything,
        paper_chain=False,
        linear_analysis=False,
        next_flight=False,
        start=tuple(start),
    )


def search(log: FlightLog, aircraft: Aircraft, catalogue: Catalogue, start: Sequence[float] = ()) -> Found:
    """What one log says of the aircraft.

    Parameters
    ----------
    log : FlightLog
        The manoeuvre.
    aircraft : Aircraft
        The declared model.
    catalogue : "terms" or "all"
        What the search may name.
    start : sequence of float
        Values of the declared terms to begin their re-estimation from; empty: those declared.

    Raises
    ------
    LogError, EstimationError
        As of `identify`; EstimationError too where the instruments contradict each other, so that nothing is judged.
    """
    identified = identify([log], aircraft, settings=loop_settings(catalogue, start))
    found = identified.found
    if found is None:
        raise EstimationError(f"{log.path}: the instruments contradict each other; this run gives no result.")
    return Found(identified.manoeuvres[0], found.before, found.completed, found.completed_deviations, found.findings)


def estimate_known(
    log: FlightLog, aircraft: Aircraft, structure: Sequence[Entry] = (), effects: Sequence[ActiveEffect] = ()
) -> Found:
    """The estimate of a structure that is known.

    Parameters
    ----------
    structure : sequence of Entry
        The terms beside those declared, estimated from zero.
    effects : sequence of ActiveEffect
        The effects that are no term, with start values.

    Raises
    ------
    LogError, EstimationError
        As of `identify`.
    """
    plain = declared_model(aircraft, log.mean_airspeed, [term for _, term in structure])
    manoeuvre = prepare(log, aircraft, plain.columns)
    given = declared_effects(aircraft, controls_of(plain), [manoeuvre])
    declared = with_columns_of(plain, (*given, *effects))
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives if not d.fixed)
    entries = (*free, *(entry for entry in structure if entry not in free))
    completed = refine(declared.extended(entries), [manoeuvre], entries, effects=(*given, *effects))
    return Found(manoeuvre, None, completed, deviations(completed, [manoeuvre]), ())
