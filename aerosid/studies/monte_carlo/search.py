"""The chain of a study: `identify` of the loop, or the estimation of a known structure."""

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
from aerosid.loop.settings import LoopSettings, StartValues
from aerosid.search.findings import Finding
from aerosid.search.settings import AttributionSettings
from aerosid.studies.monte_carlo.plan import Catalogue


@dataclass(frozen=True)
class Found:
    """Result of the chain for one log.

    `before` the declared structure re-estimated, None where the structure was known; `completed` with all effects
    found, `uncertainty` its standard errors.
    """

    manoeuvre: Manoeuvre
    before: Refinement | None
    completed: Refinement
    uncertainty: Deviations
    findings: tuple[Finding, ...]


def start_values(log: FlightLog, aircraft: Aircraft) -> StartValues:
    """The estimate of the declared structure from one log, as the start of those from others."""
    before = estimate_known(log, aircraft).completed
    values = before.model.values[: len(aircraft.derivatives)]
    return StartValues(tuple(values.tolist()), tuple(before.variance.tolist()))


def loop_settings(catalogue: Catalogue, start: StartValues | None = None) -> LoopSettings:
    """The loop's settings in a study: those of `close_loop`, without the parts that only serve its report.

    Where only terms are searched, there is no data compatibility check either.
    """
    everything = catalogue == "all"
    return LoopSettings(
        attribution=AttributionSettings(reported=False),
        catalogue="all" if everything else "terms",
        kinematics=everything,
        paper_chain=False,
        linear_analysis=False,
        next_flight=False,
        start=start,
    )


def search(log: FlightLog, aircraft: Aircraft, catalogue: Catalogue, start: StartValues | None = None) -> Found:
    """Identification of the aircraft from one log.

    Parameters
    ----------
    log : FlightLog
        The manoeuvre.
    aircraft : Aircraft
        The declared model.
    catalogue : "terms" or "all"
        Scope of the search.
    start : StartValues, optional
        Where the re-estimation of the declared structure begins; by default at the declared values.

    Raises
    ------
    LogError, EstimationError
        As for `identify`; EstimationError also where the instruments contradict each other and nothing is estimated.
    """
    identified = identify([log], aircraft, settings=loop_settings(catalogue, start))
    found = identified.found
    if found is None:
        raise EstimationError(f"{log.path}: the instruments contradict each other; this run gives no result.")
    return Found(identified.manoeuvres[0], found.before, found.completed, found.completed_deviations, found.findings)


def estimate_known(
    log: FlightLog, aircraft: Aircraft, structure: Sequence[Entry] = (), effects: Sequence[ActiveEffect] = ()
) -> Found:
    """The estimate of a known structure.

    Parameters
    ----------
    structure : sequence of Entry
        The terms in addition to those declared, estimated from zero.
    effects : sequence of ActiveEffect
        The effects that are not terms, with initial values.

    Raises
    ------
    LogError, EstimationError
        As for `identify`.
    """
    plain = declared_model(aircraft, log.mean_airspeed, [term for _, term in structure])
    manoeuvre = prepare(log, aircraft, plain.columns)
    given = declared_effects(aircraft, controls_of(plain), [manoeuvre])
    declared = with_columns_of(plain, (*given, *effects))
    entries = (*aircraft.free, *(entry for entry in structure if entry not in aircraft.free))
    completed = refine(declared.extended(entries), [manoeuvre], entries, effects=(*given, *effects))
    return Found(manoeuvre, None, completed, deviations(completed, [manoeuvre]), ())
