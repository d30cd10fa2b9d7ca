"""Structure selection by equation error: proved sensor faults first, then the aerodynamic coefficients."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import both
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.estimate import Estimate, RegressionProblem, estimate, weights_restricted_to
from aerosid.equation_error.regression.input_interpolation import likelier_input_interpolation
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.regression.vane_smoothing import likelier_vane_smoothing
from aerosid.equation_error.selection.alternatives import Alternative, alternatives_of, gains_by_deletion
from aerosid.equation_error.selection.backward_elimination import Labels, eliminate_insignificant, improves_prediction
from aerosid.equation_error.selection.candidates import distinct_name, is_instrument_error
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.cross_validation import CoefficientFit, fits_of
from aerosid.equation_error.selection.damping_collinearity import (
    DampingCollinearity,
    damping_collinearity,
    downwash_prior,
)
from aerosid.equation_error.selection.instrument_errors import (
    InstrumentErrors,
    on_identification_records,
    with_instrument_errors,
)
from aerosid.equation_error.selection.joint_time_delays import (
    DelayDiscrepancy,
    JointDelays,
    delay_discrepancies,
    is_within,
    joint_delays,
    joint_gain,
    kinematic_delays,
    likeliest_delay_kinds,
    with_errors_held,
)
from aerosid.equation_error.selection.kinematic_evidence import kinematic_evidence
from aerosid.equation_error.selection.model_averaging import averaged_covariance
from aerosid.equation_error.selection.near_significant import (
    NearSignificant,
    near_significant_effect,
    with_validation_fits,
)
from aerosid.equation_error.selection.penalties import KinematicEvidence, Label, criterion_for, effects_of
from aerosid.equation_error.selection.replication import is_replicated
from aerosid.equation_error.selection.selection_rounds import add_terms_at_raised_odds, select_structure
from aerosid.equation_error.selection.stepwise import recordings_agree
from aerosid.equation_error.selection.structure import SelectedStructure, structure_without
from aerosid.equation_error.selection.turbulence import Turbulence, gust_fraction, turbulence_of
from aerosid.equation_error.selection.wald_tests import (
    EffectEstimate,
    confirmed_unknowns,
    effect_estimates,
    least_significant_of,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EquationErrorDecision:
    """What the equations show to be missing, with the estimates of the declared and the completed structure.

    Attributes
    ----------
    findings : tuple of EffectEstimate
        Those of kinematics by certainty, then the others by gain.
    alternatives : tuple of Alternative
        What could stand in place of a finding.
    before, completed : Estimate
        Declared and completed structure, coefficients regressed on the identification recordings alone.
    covariance : ndarray, shape (P, P)
        Of the completed estimate's unknowns, corrected for coloured residuals; that of declared derivatives with what
        the choice among the alternatives adds.
    before_covariance : ndarray
        The same of the declared structure.
    turbulence : tuple of Turbulence
        What vanes and forces show of the air.
    coefficient_fits : tuple of (CoefficientFit, CoefficientFit)
        R^2 before and after, of each coefficient and recording.
    gust_fraction : float
        What the sideslip's vane shows beyond the inertial path over all that it shows, 1; infinite where none is there.
    kinematic_estimate : Estimate
        The instruments' faults as the kinematics of the identification recordings alone measure them.
    hypothesis_count : int
        Hypotheses.
    refuted : tuple of (kind, where, term)
        What the validation recordings refused.
    damping : DampingCollinearity or None
        What the completed C_m q_hat holds of an undeclared C_m alpha_dot_hat.
    delay_discrepancies : tuple of DelayDiscrepancy
        Instruments that kinematics alone and all equations find late in different ways.
    joint_evidence : mapping of label to KinematicEvidence
        What kinematics show of the instruments' faults that they and the coefficients name together.
    near_significant : tuple of NearSignificant
        What would be named were it the only question: of kinematics, then of coefficients.
    """

    findings: tuple[EffectEstimate, ...]
    alternatives: tuple[Alternative, ...]
    before: Estimate
    completed: Estimate
    covariance: Array
    before_covariance: Array
    turbulence: tuple[Turbulence, ...]
    coefficient_fits: tuple[tuple[CoefficientFit, CoefficientFit], ...]
    gust_fraction: float
    kinematic_estimate: Estimate
    hypothesis_count: int
    refuted: tuple[tuple[str, str, str], ...]
    damping: DampingCollinearity | None = None
    delay_discrepancies: tuple[DelayDiscrepancy, ...] = ()
    joint_evidence: Mapping[Label, KinematicEvidence] = field(default_factory=dict)
    near_significant: tuple[NearSignificant, ...] = ()


def decide(
    errors: InstrumentErrors, coefficients: Sequence[str], log: Callable[[str], None] = lambda _text: None
) -> EquationErrorDecision:
    """Select the undeclared effects from the coefficient equations, given the proved sensor faults.

    Parameters
    ----------
    coefficients : sequence of str
        Drag or axial force, lift or normal force, moment, as the aircraft file names them.
    log : callable
        Hears what enters and leaves, for a journal.
    """
    start, hypotheses = errors.start, errors.hypotheses
    settings = errors.selected.estimate.problem.settings
    sensors = [h for h in hypotheses if is_instrument_error(h)]
    identified, other_delays, search, outcome = _selected_jointly(errors, errors.selected, tuple(coefficients), log)
    fitted, evidence = search.fitted, search.criterion.evidence
    (structure, on_fitted, completed, covariance), refuted = _accepted_structure(identified, search, outcome)
    fitted_estimate, chosen = on_fitted.estimate, (*identified.chosen, *structure.chosen)
    jointly = [each.hypothesis for each in structure.chosen if distinct_name(each.hypothesis) in evidence]
    of_errors, of_structure = (
        alternatives_of(identified, sensors),
        alternatives_of(structure, search.hypotheses_except(refuted)),
    )
    gains = {**gains_by_deletion(identified), **gains_by_deletion(structure)}
    for hypothesis in jointly:
        (active,) = effects_of(structure.estimate.point, hypothesis)
        gains[hypothesis.label] += evidence[distinct_name(hypothesis)].gain_at(active.values)
    findings = effect_estimates(completed, covariance, chosen, gains, improves_prediction(structure, on_fitted))
    other_delays = tuple(replace(row, gain=gains[row.replaces.label] - row.deficit) for row in other_delays)
    # What another flight refutes stands in nobody's place, and so does what both kinds of equations name together.
    excluded_labels = {*refuted, *(hypothesis.label for hypothesis in jointly)}
    before = estimate(fitted_estimate.problem, start)
    as_measured = replace(settings, blend=settings.blend_compared, blend_aside=settings.blend_compared)
    compared = replace(fitted_estimate.problem, settings=as_measured, all_fitted=True)
    of_errors = tuple(row for row in of_errors if row.hypothesis.label not in excluded_labels)
    alternatives = (*other_delays, *_not_among(other_delays, of_errors), *of_structure)
    derivatives = [unknown for unknown in before.design.unknowns if unknown[0] == "term"]
    after = fits_of(compared, completed)
    near_significant = _near_significant(errors, identified, structure, search, alternatives, refuted)
    return EquationErrorDecision(
        findings=findings,
        alternatives=alternatives,
        before=before,
        completed=completed,
        covariance=averaged_covariance(
            completed, covariance, fitted_estimate, alternatives, derivatives, near_significant
        ),
        before_covariance=corrected_covariance(before.design, before.solution),
        turbulence=turbulence_of(identified.estimate, fitted_estimate),
        coefficient_fits=tuple(zip(fits_of(compared, before), after, strict=True)),
        gust_fraction=gust_fraction(identified.estimate, "beta"),
        kinematic_estimate=on_identification_records(identified).estimate,
        hypothesis_count=len(hypotheses),
        refuted=refuted,
        damping=damping_collinearity(fitted_estimate),
        delay_discrepancies=delay_discrepancies(errors.selected.estimate, outcome.delays, settings.deviations),
        joint_evidence={hypothesis.label: evidence[distinct_name(hypothesis)] for hypothesis in jointly},
        near_significant=tuple(with_validation_fits(row, after, fitted, compared) for row in near_significant),
    )


class _Accepted(NamedTuple):
    """A structure, the same on the fitted recordings alone, and its estimate and covariance beside the instruments."""

    structure: SelectedStructure
    on_fitted: SelectedStructure
    completed: Estimate
    covariance: Array


def _accepted_structure(
    identified: SelectedStructure, search: CoefficientSearch, outcome: _Selection
) -> tuple[_Accepted, Labels]:
    """The structure without what the instruments' own uncertainty could have made, and all that was refuted.

    What leaves for that may have stood in another's place, as a power of alpha whose bias is known badly: the others
    are asked again, as they are of what does not stand in the search itself.
    """
    settings = search.fitted.settings
    structure, refuted = outcome.structure, outcome.refuted
    eliminated: Labels = ()
    for _ in range(settings.rounds):
        accepted = _significant(identified, search, outcome.delays, structure)
        removed = structure.labels_not_in(accepted.structure)
        if not removed:
            return accepted, refuted
        eliminated = (*eliminated, *removed)
        grown = search.forward(
            accepted.structure, search.hypotheses_except(refuted), settings.most, excluded=eliminated
        )
        if grown is accepted.structure:
            return accepted, refuted
        structure, refuted_now = eliminate_insignificant(search, grown)
        refuted = (*refuted, *refuted_now)
    return _significant(identified, search, outcome.delays, structure), refuted


def _significant(
    identified: SelectedStructure, search: CoefficientSearch, delays: JointDelays, structure: SelectedStructure
) -> _Accepted:
    """A structure less what is nearer to none than the deviations that a final value must keep."""
    while True:
        point = structure.estimate.point
        on_fitted = likelier_input_interpolation(
            estimate(search.fitted, point, weights_restricted_to(structure.estimate, search.fitted, point))
        )
        fitted = SelectedStructure(on_fitted, structure.chosen)
        completed, covariance = _with_covariance(delays, fitted, structure)
        findings = effect_estimates(completed, covariance, (*identified.chosen, *structure.chosen))
        insignificant = least_significant_of(findings, structure.chosen, search.fitted.settings.deviations)
        if insignificant is None:
            return _Accepted(structure, fitted, completed, covariance)
        search.log(f"  does not stand beside the instruments: {insignificant.hypothesis.label}")
        structure = structure_without(structure, insignificant)


def _near_significant(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    structure: SelectedStructure,
    search: CoefficientSearch,
    alternatives: Sequence[Alternative],
    refuted: Sequence[Label],
) -> tuple[NearSignificant, ...]:
    """What kinematics and coefficients each would name were it all that was asked, and nothing lists yet."""
    listed = {*refuted, *(row.hypothesis.label for row in alternatives)}
    listed |= {*identified.labels, *structure.labels}
    sensors = [h for h in errors.hypotheses if h.label not in listed and is_instrument_error(h)]
    terms = [h for h in search.hypotheses if h.label not in listed and not is_instrument_error(h)]
    rows = both(
        functools.partial(near_significant_effect, identified, errors.criterion, sensors, recordings_agree),
        functools.partial(near_significant_effect, structure, search.criterion, terms, search.admitted),
        [identified.estimate.problem, structure.estimate.problem],
    )
    return tuple(row for row in rows if row is not None)


class _JointSelection(NamedTuple):
    """The faults, the other ways in which a channel may be late, the search in the coefficients, and its outcome."""

    identified: SelectedStructure
    other_delays: tuple[Alternative, ...]
    search: CoefficientSearch
    outcome: _Selection


def _selected_jointly(
    errors: InstrumentErrors, identified: SelectedStructure, coefficients: tuple[str, ...], log: Callable[[str], None]
) -> _JointSelection:
    """The structure that both kinds of equations show, no lateness in it for which they do not pay together."""
    start, settings = errors.start, identified.estimate.problem.settings
    sensors = [h for h in errors.hypotheses if is_instrument_error(h)]
    whole = RegressionProblem(identified.estimate.problem.recordings, COEFFICIENT, settings, all_fitted=True)
    declared = estimate(whole, with_errors_held(start, identified.estimate.point.effects))
    likelier, other_delays = likeliest_delay_kinds(identified, declared, sensors, log)
    if likelier is not identified:
        identified, declared = likelier, estimate(whole, with_errors_held(start, likelier.estimate.point.effects))
    declared = likelier_vane_smoothing(likelier_input_interpolation(declared))
    search = _coefficient_search(errors, identified, declared, coefficients, log)
    outcome = _selected_with_delays(identified.estimate, declared, search)
    for each in identified.chosen:
        gain = joint_gain(identified, each, outcome.delays, outcome.structure.estimate)
        if gain is not None and gain < search.criterion.penalty(each.hypothesis):
            log(f"  both kinds of equations together gain {gain:.1f} by {each.hypothesis.label}")
            return _selected_jointly(errors, structure_without(identified, each), coefficients, log)
    undeclared = slice(len(start.effects), len(outcome.delays.effects))
    search, structure, refuted = add_terms_at_raised_odds(search, outcome.structure, outcome.refuted, undeclared)
    return _JointSelection(identified, other_delays, search, replace(outcome, structure=structure, refuted=refuted))


def _with_covariance(
    delays: JointDelays, on_fitted: SelectedStructure, structure: SelectedStructure
) -> tuple[Estimate, Array]:
    """The estimate with the instruments' numbers, and the covariance of all.

    An effect that one event of the fitted recordings shows keeps the deviation of the deleted blocks, unless it would
    be lost by that alone and the unseen recordings show it too.
    """
    completed, covariance = with_instrument_errors(delays, on_fitted.estimate)
    replicated = functools.partial(is_replicated, structure, on_fitted)
    confirmed = confirmed_unknowns(completed, covariance, structure.chosen, replicated)
    return with_instrument_errors(delays, on_fitted.estimate, confirmed) if confirmed else (completed, covariance)


def _coefficient_search(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    declared: Estimate,
    coefficients: tuple[str, ...],
    log: Callable[[str], None],
) -> CoefficientSearch:
    """What is asked of the coefficients: what is no sensor's fault, and the faults that kinematics support."""
    hypotheses, settings = errors.hypotheses, declared.problem.settings
    evidence = kinematic_evidence(identified, [h for h in hypotheses if is_instrument_error(h)])
    candidates = tuple(h for h in hypotheses if not is_instrument_error(h) or distinct_name(h) in evidence)
    alarm = settings.alarm(declared.point.model.axes)
    criterion = criterion_for(hypotheses, declared.design.target.size, alarm, settings.factor_odds)
    criterion = replace(criterion, evidence=evidence, prior_sizes=downwash_prior(errors.start.model))

    def admitted(found: Estimate, hypothesis: Hypothesis) -> bool:
        known = evidence.get(distinct_name(hypothesis))
        return known is None or known.agrees(found.point.effects[-1].values, settings.agreement)

    fitted = replace(declared.problem, all_fitted=False)
    return CoefficientSearch(candidates, coefficients, fitted, criterion, admitted, log)


def _not_among(known: Sequence[Alternative], rows: Sequence[Alternative]) -> list[Alternative]:
    """The rows whose hypotheses are not among the known ones."""
    labels = {row.hypothesis.label for row in known}
    return [row for row in rows if row.hypothesis.label not in labels]


def _selected_with_delays(identified: Estimate, declared: Estimate, search: CoefficientSearch) -> _Selection:
    """The structure with the timings of instruments that kinematics and coefficients show together.

    A structure found with a wrong timing has something in its place, and a timing found with a wrong structure is
    off: the search begins with the timings of kinematics alone and with those that the declared structure prefers, and
    the likelier outcome counts.
    """

    def outcome(search: CoefficientSearch, initial: JointDelays) -> _Selection:
        start = estimate(declared.problem, with_errors_held(declared.point, initial.effects), declared.solution.weights)
        structure, refuted = select_structure(search, SelectedStructure(start, ()))
        delays = joint_delays(identified, initial, structure.estimate, search.log)
        if delays is initial:
            return _Selection(initial, structure, refuted)
        moved = estimate(
            declared.problem,
            with_errors_held(structure.estimate.point, delays.effects),
            structure.estimate.solution.weights,
        )
        if search.worsens_prediction(structure.estimate, moved):
            search.log("  an unseen recording keeps the timings as they were")
            return _Selection(initial, structure, refuted)
        return _Selection(delays, SelectedStructure(moved, structure.chosen), refuted)

    kinematic = kinematic_delays(identified)
    joint = joint_delays(identified, kinematic, declared, search.log)
    if is_within(kinematic, joint, declared.problem.settings.deviations):
        return outcome(search, joint)
    found, other = search.in_parallel(
        functools.partial(outcome, initial=joint), functools.partial(outcome, initial=kinematic), [declared.problem]
    )
    best, alternative = (search.penalised_likelihood(each.structure) - each.delays.penalty for each in (found, other))
    return other if alternative > best else found


@dataclass(frozen=True)
class _Selection:
    """The timings of instruments, the structure found with them, and what the unseen recordings refused."""

    delays: JointDelays
    structure: SelectedStructure
    refuted: tuple[tuple[str, str, str], ...]
