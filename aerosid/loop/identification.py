"""From logs and an aircraft to findings: the one chain that every verb, study and test calls.

logs, aircraft -> manoeuvres -> do the instruments agree? -> the declared structure, re-estimated
               -> what it lacks -> terms that one coefficient alone could not tell from what was found
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.loading import at_own_loading
from aerosid.compatibility import Agreement, KinematicConsistency, check_kinematics
from aerosid.effects import ActiveEffect
from aerosid.equation_error.decision import decide
from aerosid.errors import EstimationError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import NEARBY, WRONG_STRUCTURE
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry, controls_of
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.logs.channel_noise import with_declared_noise
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.settings import USUAL, LoopSettings, Progress
from aerosid.search.attribution import Attribution, attribute
from aerosid.search.candidate_terms import candidate_entries
from aerosid.search.equation_error_attribution import attribute_by_equations
from aerosid.search.final_significance import significant
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.indistinguishable_terms import CoefficientRival, coefficient_rivals, with_rivals
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class Identification:
    """What the chain makes of logs and an aircraft.

    Attributes
    ----------
    aircraft : Aircraft
        The declared one, at the loading that was flown.
    plain : AerodynamicModel
        The declared model as its file gives it, with an input column for every candidate term.
    declared : AerodynamicModel
        The same with the columns that the file's own effects fill.
    candidates : tuple of Entry
        The terms that were asked for.
    manoeuvres, validation : tuple of Manoeuvre
        The logs as the estimators take them: those that were fitted, and those that were predicted.
    agreement : KinematicConsistency or None
        Whether the instruments agree; None where that was not asked.
    found : Attribution or None
        What the declared model lacks; None where the instruments contradict each other, so that nothing is judged.
    rivals : tuple of CoefficientRival
        Terms that a coefficient by itself could not tell from a sensor's or a control's fault that was found.
    search : StructureSearch or None
        The fitted flights, the hypotheses and the settings: what further questions about the estimate are asked of.
    """

    aircraft: Aircraft
    plain: AerodynamicModel
    declared: AerodynamicModel
    candidates: tuple[Entry, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    validation: tuple[Manoeuvre, ...]
    agreement: KinematicConsistency | None
    found: Attribution | None
    rivals: tuple[CoefficientRival, ...] = ()
    search: StructureSearch | None = field(default=None, repr=False, compare=False)


def identify(
    logs: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    settings: LoopSettings = USUAL,
    progress: Progress = lambda _stage: None,
) -> Identification:
    """What the declared model lacks, from the logs that are fitted and those that are only predicted.

    Parameters
    ----------
    logs : sequence of FlightLog
        Manoeuvres to fit, one joint estimate; at least one.
    aircraft : Aircraft
        The declared model.
    validation : sequence of FlightLog
        Manoeuvres that are only predicted: what lowers their prediction is not named.
    progress : callable
        Told the name of each stage as it begins.

    Raises
    ------
    LogError
        Where a log lacks a channel that the model needs.
    AircraftError
        Where the aircraft file declares an effect without its numbers, or on a channel that the model does not hold, or
        lateral coefficients.
    EstimationError
        Where the declared model cannot be simulated at all.
    """
    aircraft.require_longitudinal("the search for what a model lacks")
    progress("reading the logs into the flight model")
    aircraft, logs, validation = at_own_loading(aircraft, logs, validation)
    logs, validation = (
        [with_declared_noise(log, aircraft.noise, aircraft.resolution) for log in part] for part in (logs, validation)
    )
    candidates = candidate_entries(aircraft, [*logs, *validation])
    plain = declared_model(aircraft, _mean_airspeed(logs[0]), [term for _, term in candidates])
    manoeuvres = tuple(prepare(log, aircraft, plain.columns) for log in logs)
    others = tuple(prepare(log, aircraft, plain.columns) for log in validation)
    given = declared_effects(aircraft, controls_of(plain), manoeuvres)
    declared = with_columns_of(plain, given)

    progress("comparing the instruments with each other")
    agreement = check_kinematics(logs) if settings.kinematics else None
    if agreement is not None and agreement.verdict is Agreement.INCONSISTENT:
        return Identification(aircraft, plain, declared, candidates, manoeuvres, others, agreement, None)

    progress("re-estimating the declared model")
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives if not d.fixed)
    begun = _begun(declared, settings.start)
    priors = _priors(aircraft) if settings.priors else ()
    fit = NEARBY if settings.start else WRONG_STRUCTURE
    before: Refinement | None
    try:
        before = refine(begun, manoeuvres, free, effects=given, priors=priors, settings=fit)
    except EstimationError:
        if settings.catalogue == "terms" or declared.axes != LONGITUDINAL:
            raise
        before = None

    progress("tracing the residual")
    found, rivals, search = _traced(
        before, declared, candidates, manoeuvres, others, aircraft, agreement, settings, free, given
    )
    return Identification(aircraft, plain, declared, candidates, manoeuvres, others, agreement, found, rivals, search)


def _traced(
    before: Refinement | None,
    declared: AerodynamicModel,
    candidates: Sequence[Entry],
    manoeuvres: Sequence[Manoeuvre],
    others: Sequence[Manoeuvre],
    aircraft: Aircraft,
    agreement: KinematicConsistency | None,
    settings: LoopSettings,
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
) -> tuple[Attribution, tuple[CoefficientRival, ...], StructureSearch]:
    """What is missing among the hypotheses that the settings allow, and what one coefficient could not tell from it."""
    hypotheses = term_hypotheses(candidates)
    if settings.catalogue == "terms":
        assert before is not None
        quiet = replace(settings.attribution, disturbances=False)
        found = attribute(before, manoeuvres, hypotheses, (), quiet, declared, others)
        search = StructureSearch(tuple(manoeuvres), hypotheses, (), before, quiet, declared)
        return significant(found, search), (), search
    hypotheses += effect_hypotheses(declared, manoeuvres, aircraft.coefficients)
    if declared.axes == LONGITUDINAL:
        decision = decide(
            declared, free, given, hypotheses, aircraft.coefficients, manoeuvres, others, settings.equation_error
        )
        found = attribute_by_equations(decision, manoeuvres, before)
        asked = tuple(aircraft.coefficients)
        search = StructureSearch(tuple(manoeuvres), hypotheses, asked, found.before, settings.attribution, declared)
        return found, (), search
    assert before is not None
    found = attribute(
        before,
        manoeuvres,
        hypotheses,
        aircraft.coefficients,
        settings.attribution,
        declared,
        others,
        moving_air=agreement is not None and agreement.is_gusty,
    )
    search = StructureSearch(
        tuple(manoeuvres), tuple(hypotheses), aircraft.coefficients, before, settings.attribution, declared
    )
    found = significant(found, search)
    rivals = coefficient_rivals(found, manoeuvres, hypotheses)
    return with_rivals(found, rivals, settings.attribution.reach), tuple(rivals), search


def _mean_airspeed(log: FlightLog) -> float:
    """U0 of V_hat where the aircraft file gives none, m/s."""
    return float(np.nanmean(log["V"])) if "V" in log and np.isfinite(log["V"]).any() else 0.0


def _begun(declared: AerodynamicModel, start: Sequence[float]) -> AerodynamicModel:
    """The declared model with other values of its terms to begin from, where some are given."""
    if not start:
        return declared
    values = declared.values.copy()
    values[: len(start)] = start
    return declared.with_values(values)


def _priors(aircraft: Aircraft) -> tuple[tuple[Entry, float, float], ...]:
    return tuple(
        ((d.coefficient, d.term), d.value, d.sigma) for d in aircraft.derivatives if d.sigma is not None and not d.fixed
    )
