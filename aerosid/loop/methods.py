"""Identification methods by name: evidence, equations, likelihood and IEBMEE."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.compatibility import KinematicConsistency
from aerosid.compiled.cores import Begun, begun
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.estimation.fit_settings import NEARBY, WRONG_STRUCTURE
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.loop.equation_error_method import identified_by_equations
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.loop.settings import LoopSettings, Method, Progress
from aerosid.notation import number
from aerosid.search.attribution import Attribution, attribute_by_search, attribute_without_disturbances
from aerosid.search.cross_validation import is_inadequate_on
from aerosid.search.declared_inertia import with_declared_inertia
from aerosid.search.equivalent_causes import with_equivalent_causes
from aerosid.search.final_significance import eliminate_by_wald_test
from aerosid.search.indistinguishable_terms import (
    IndistinguishableTerm,
    indistinguishable_terms,
    with_indistinguishable_terms,
)
from aerosid.search.lowered_coefficients import lowered_coefficients
from aerosid.search.other_derivatives import other_derivatives_by_equations, other_derivatives_by_likelihood
from aerosid.search.partial_correlation.attribution import attribute_by_model_error, note_on_unobservable
from aerosid.search.structure_search import StructureSearch
from aerosid.search.unreached_position import note_on_unreached, with_unreached_positions

BY_EQUATIONS = "estimating by equation error"
"""Display: the stage of the kinematic and coefficient equations."""


@dataclass(frozen=True)
class MethodResult:
    """Result of an identification method: attribution, indistinguishable terms and notes.

    `search`: the fitted flights, the hypotheses and the settings for further estimates; `method`: the deciding
    method; `agreement`: its data compatibility check; `decision`: of the equation-error method, where that decided.
    """

    found: Attribution
    search: StructureSearch
    rivals: tuple[IndistinguishableTerm, ...] = ()
    notes: tuple[str, ...] = ()
    method: Method = "likelihood"
    agreement: KinematicConsistency | None = None
    decision: EquationErrorDecision | None = None


def run_method(problem: IdentificationProblem, settings: LoopSettings, progress: Progress) -> MethodResult:
    """Run the method selected in the settings; of the problem with its instrument errors where they were asked for.

    Raises
    ------
    EstimationError
        Where the declared model cannot be simulated.
    """
    methods: dict[Method, Callable[[IdentificationProblem, LoopSettings, Progress], MethodResult]] = {
        "evidence": by_data_compatibility,
        "equations": by_equations,
        "likelihood": by_likelihood,
        "iebmee": by_model_error,
    }
    return _compared_on_validation(methods[settings.method](problem, settings, progress), problem)


def _compared_on_validation(result: MethodResult, problem: IdentificationProblem) -> MethodResult:
    """The result with what differs on a validation flight, by the estimator that the values are from."""
    found, decision = result.found, result.decision
    # Of both structures with all derivatives free: an output-error estimate in calm air takes that structure over.
    lowered = lowered_coefficients(decision) if decision is not None and found.predictions and found.findings else ()

    def compared(found: Attribution) -> Attribution:
        if decision is not None and found.regressed:
            others = other_derivatives_by_equations(decision)
        else:
            others = other_derivatives_by_likelihood(found.completed, found.completed_deviations, problem.others)
        return replace(found, other_derivatives=others, lowered=lowered)

    regression = None if found.by_regression is None else compared(found.by_regression)
    return replace(result, found=replace(compared(found), by_regression=regression))


def by_data_compatibility(problem: IdentificationProblem, settings: LoopSettings, progress: Progress) -> MethodResult:
    """Maximum likelihood where open-loop simulations can follow the flights, equation error elsewhere.

    In turbulence and behind filtering recorders an open-loop simulation does not follow a flight: its errors are not
    the measurement noise that the likelihood assumes. The same holds in calm air where a force or moment is missing
    that no effect of the catalogue describes, such as a slow change of trim: the motion integrates it, whereas the
    coefficient equations have it in their coloured residual alone.
    """
    instrument_errors = problem.instrument_errors
    if instrument_errors is None or settings.catalogue == "terms":
        return by_likelihood(problem, settings, progress)
    ratio = instrument_errors.noise_ratio
    if ratio <= settings.equation_error.closed:
        return _in_closed_kinematics(instrument_errors, problem, settings, progress)
    progress(BY_EQUATIONS)
    found = _by_equations(instrument_errors, problem, settings)
    sentence = (
        f"The residuals of the kinematic equations are {_times(ratio)} the level expected from the white noise between "
        "successive samples: there is turbulence or recorder filtering. The kinematic and coefficient equations decide "
        "(method equations); errors of open-loop simulations are predictions, no measure of the model."
    )
    return replace(found, notes=(sentence, *found.notes))


def _in_closed_kinematics(
    instrument_errors: InstrumentErrors, problem: IdentificationProblem, settings: LoopSettings, progress: Progress
) -> MethodResult:
    """The likelihood where a structure without disturbances is adequate, else the equations."""
    ahead: list[Begun[MethodResult]] = []

    def equations() -> MethodResult:
        return _by_equations(instrument_errors, problem, settings)

    def begin_equations() -> None:
        flights = (*problem.manoeuvres, *problem.others, *problem.held_out)
        if sum(each.flight.time.size for each in flights) <= settings.samples_ahead:
            ahead.append(begun(equations, [problem, instrument_errors, problem.declared, problem.aircraft, *flights]))

    plain = by_likelihood_without_disturbances(
        problem, settings, progress, closed=problem.shows_air, doubted=begin_equations
    )
    if plain is not None and _is_adequate(plain.found, problem):
        for each in ahead:
            each.abandon()
        return plain
    progress(BY_EQUATIONS)
    found = ahead[0]() if ahead else equations()
    closed = "The kinematic equations close within the noise of the instruments, but"
    if not problem.has_path:
        closed = (
            "Without accelerometers kinematics check neither the vane nor the airspeed, and gusts cannot be told from "
            "missing forces: forces are derived from air data, which is less precise. As"
        )
    sentence = (
        f"{closed} no structure without flow separation and disturbances follows the flights in open-loop simulation. "
        "The kinematic and coefficient equations decide (method equations): a force or moment that no effect of the "
        "catalogue describes is in their coloured residuals, where a simulation would integrate it."
    )
    return replace(found, notes=(sentence, *found.notes))


def _is_adequate(found: Attribution, problem: IdentificationProblem) -> bool:
    """Whether the completed model, simulated open loop, follows all fitted and validation flights within the noise."""
    return not unexplained_channels(found.completed, problem.manoeuvres) and not any(
        is_inadequate_on(found.completed, each) for each in problem.others
    )


def _times(ratio: float) -> str:
    """A multiple of the noise; beyond 100 the recorder's filter determines the noise, and the number is meaningless."""
    return f"up to {number(ratio, 2)} times" if ratio < 100.0 else "more than 100 times"


def by_equations(problem: IdentificationProblem, settings: LoopSettings, progress: Progress) -> MethodResult:
    """Equation error with coloured residuals: kinematic equations first, coefficient equations second.

    A study of terms alone, with a start of its own, uses the likelihood.
    """
    instrument_errors = problem.instrument_errors
    if instrument_errors is None or settings.catalogue == "terms":
        return by_likelihood(problem, settings, progress)
    progress(BY_EQUATIONS)
    return _by_equations(instrument_errors, problem, settings)


def _by_equations(
    instrument_errors: InstrumentErrors, problem: IdentificationProblem, settings: LoopSettings
) -> MethodResult:
    """Attribution by the coefficient equations, with the identified instrument errors applied."""
    a_priori = {entry: (value, sigma) for entry, value, sigma in _priors(problem.aircraft)}
    known = identified_by_equations(instrument_errors, problem, settings, a_priori)
    agreement = problem.agreement(settings)
    return MethodResult(
        known.found, known.search, notes=known.notes, method="equations", agreement=agreement, decision=known.decision
    )


def _declared_estimate(problem: IdentificationProblem, settings: LoopSettings, progress: Progress) -> Refinement:
    """Maximum-likelihood estimate of the declared structure."""
    progress("re-estimating the declared model")
    start = settings.start
    return refine(
        problem.declared if start is None else _with_start_values(problem.declared, start.values),
        problem.manoeuvres,
        problem.free,
        effects=problem.given,
        variance=None if start is None else np.array(start.variance),
        priors=_priors(problem.aircraft) if settings.priors else (),
        settings=WRONG_STRUCTURE if start is None else NEARBY,
    )


def by_likelihood(problem: IdentificationProblem, settings: LoopSettings, progress: Progress) -> MethodResult:
    """Score tests, trial fits and maximum likelihood."""
    search, agreement = _likelihood_search(problem, settings, progress, closed=False)
    moving_air = agreement is not None and agreement.is_gusty
    found = attribute_by_search(search.without_stored_fits(), problem.others, moving_air=moving_air)
    if settings.catalogue == "terms":
        return MethodResult(eliminate_by_wald_test(found, search), search, agreement=agreement)
    return _likelihood_result(found, search, problem, settings, agreement)


def by_likelihood_without_disturbances(
    problem: IdentificationProblem,
    settings: LoopSettings,
    progress: Progress,
    *,
    closed: bool,
    doubted: Callable[[], None] = lambda: None,
) -> MethodResult | None:
    """As `by_likelihood`; None where flow separation or unmodelled forces would have to be tried.

    `closed`: the air is calm by kinematics. `doubted` is called as soon as None is likely.
    """
    search, agreement = _likelihood_search(problem, settings, progress, closed=closed)
    moving_air = agreement is not None and agreement.is_gusty
    found = attribute_without_disturbances(
        search.without_stored_fits(), problem.others, moving_air=moving_air, doubted=doubted
    )
    return None if found is None else _likelihood_result(found, search, problem, settings, agreement)


def _likelihood_search(
    problem: IdentificationProblem, settings: LoopSettings, progress: Progress, *, closed: bool
) -> tuple[StructureSearch, KinematicConsistency | None]:
    """The hypotheses, the re-estimated declared structure and the settings of a search, and the compatibility check."""
    before = _declared_estimate(problem, settings, progress)
    progress("determining the structure from the residual")
    hypotheses, coefficients = problem.hypotheses(settings.catalogue), problem.aircraft.coefficients
    agreement = problem.agreement(settings)
    attribution = problem.attribution(settings.attribution, agreement, closed=closed)
    if settings.catalogue == "terms":
        coefficients, attribution = (), replace(settings.attribution, disturbances=False)
    search = StructureSearch(problem.manoeuvres, hypotheses, coefficients, before, attribution, problem.declared)
    return search, agreement


def _likelihood_result(
    found: Attribution,
    search: StructureSearch,
    problem: IdentificationProblem,
    settings: LoopSettings,
    agreement: KinematicConsistency | None,
) -> MethodResult:
    """The attribution without insignificant effects, with equivalent causes and indistinguishable terms."""
    found = eliminate_by_wald_test(found, search)
    found = with_equivalent_causes(found, problem.aircraft, problem.manoeuvres)
    found = with_declared_inertia(found, problem.aircraft, settings.attribution.inertia)
    rivals = indistinguishable_terms(
        found, problem.manoeuvres, search.hypotheses, settings.attribution.coefficient_rivals
    )
    found, unreached = with_unreached_positions(found, problem.aircraft, search)
    return MethodResult(
        with_indistinguishable_terms(found, rivals, settings.attribution.reach),
        search,
        tuple(rivals),
        tuple(note_on_unreached(each) for each in unreached),
        agreement=agreement,
    )


def by_model_error(
    problem: IdentificationProblem, settings: LoopSettings, progress: Progress, first: MethodResult | None = None
) -> MethodResult:
    """Prefilter, continuous IEBMEE with the fixed interval, partial correlation with d(t), recursive least squares.

    `first`: another method's result for the same problem, whose hypotheses and motion are used.
    """
    progress("re-estimating the declared model")
    known = first.search.hypotheses if first is not None else ()
    hypotheses = known or problem.hypotheses(settings.catalogue)
    found, selection = attribute_by_model_error(
        problem.declared,
        problem.manoeuvres,
        problem.free,
        problem.given,
        hypotheses,
        problem.aircraft.coefficients,
        settings.chain,
        settings.model_error,
        progress,
        first.found if first is not None else None,
    )
    search = StructureSearch(
        problem.manoeuvres,
        hypotheses,
        problem.aircraft.coefficients,
        found.before,
        settings.attribution,
        problem.declared,
    )
    notes = tuple(note_on_unobservable(selection))
    return MethodResult(found, search, notes=notes, method="iebmee", agreement=problem.agreement(settings))


def _with_start_values(declared: AerodynamicModel, start: Sequence[float]) -> AerodynamicModel:
    """The declared model with the given start values of its terms."""
    values = declared.values.copy()
    values[: len(start)] = start
    return declared.with_values(values)


def _priors(aircraft: Aircraft) -> tuple[tuple[Entry, float, float], ...]:
    return tuple(
        ((d.coefficient, d.term), d.value, d.sigma) for d in aircraft.derivatives if d.sigma is not None and not d.fixed
    )
