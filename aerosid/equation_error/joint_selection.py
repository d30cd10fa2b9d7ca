"""Structure selection by kinematics and coefficients together: time delays of instruments change both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from aerosid.compiled.cores import both
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.refutation import Refutation
from aerosid.equation_error.regression.declared_values import DeclaredValues
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.input_interpolation import likelier_input_interpolation
from aerosid.equation_error.regression.related_problems import coefficients_of_all, compared_with
from aerosid.equation_error.regression.vane_smoothing import likelier_vane_smoothing
from aerosid.equation_error.selection.alternatives import Alternative
from aerosid.equation_error.selection.candidates import distinct_name, is_instrument_error
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.damping_collinearity import downwash_prior
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.joint_time_delays import (
    JointDelays,
    JointGain,
    is_within,
    joint_delays,
    joint_gain,
    kinematic_delays,
    likeliest_delay_kinds,
    with_errors_held,
)
from aerosid.equation_error.selection.kinematic_evidence import kinematic_evidence
from aerosid.equation_error.selection.lag_exchange import resolve_lag_exchange
from aerosid.equation_error.selection.penalties import Label, criterion_for
from aerosid.equation_error.selection.selection_rounds import add_terms_at_raised_odds, select_structure
from aerosid.equation_error.selection.structure import SelectedStructure, structure_without


@dataclass(frozen=True)
class DelaySelection:
    """Time delays of instruments, the structure selected with them, and the refuted labels."""

    delays: JointDelays
    structure: SelectedStructure
    refuted: dict[Label, Refutation]


class JointSelection(NamedTuple):
    """Instrument errors, alternative models of time delays, the coefficient search and the selected structure."""

    identified: SelectedStructure
    other_delays: tuple[Alternative, ...]
    search: CoefficientSearch
    outcome: DelaySelection


def selected_jointly(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    coefficients: tuple[str, ...],
    values: DeclaredValues,
    near: SelectedStructure | None = None,
) -> JointSelection:
    """The structure selected by both kinds of equations.

    No time delay is retained whose joint gain is below its penalty or that the coefficients refute. `near`: the
    structure selected with such a delay, from which the search is continued without it.
    """
    start, settings = errors.start, identified.estimate.problem.settings
    sensors = [h for h in errors.hypotheses if is_instrument_error(h)]
    whole = coefficients_of_all(identified.estimate.problem.recordings, settings, start.model)
    declared = estimate(whole, with_errors_held(start, identified.estimate.point.effects))
    likelier, other_delays = likeliest_delay_kinds(identified, declared, sensors)
    if likelier is not identified:
        identified, declared = likelier, estimate(whole, with_errors_held(start, likelier.estimate.point.effects))
    declared = compared_with(values, likelier_vane_smoothing(likelier_input_interpolation(declared)))
    search = _coefficient_search(errors, identified, declared, coefficients)
    outcome = _selected_with_delays(identified, declared, search, near)
    for each in identified.chosen:
        joint = joint_gain(identified, each, outcome.delays, outcome.structure.estimate)
        if joint is not None and _is_rejected(joint, search.criterion.penalty(each.hypothesis), outcome, search):
            others = structure_without(identified, each)
            near = SelectedStructure(joint.coefficients_without, outcome.structure.chosen)
            return selected_jointly(errors, others, coefficients, values, near)
    undeclared = slice(len(start.effects), len(outcome.delays.effects))
    search, structure, refuted = add_terms_at_raised_odds(search, outcome.structure, outcome.refuted, undeclared)
    search, structure = resolve_lag_exchange(search, structure)
    return JointSelection(identified, other_delays, search, replace(outcome, structure=structure, refuted=refuted))


def _is_rejected(joint: JointGain, penalty: float, outcome: DelaySelection, search: CoefficientSearch) -> bool:
    """Whether a time delay gains less than its penalty in both kinds of equations, or the coefficients refute it."""
    return joint.total < penalty or search.refutes(joint.coefficients_without, outcome.structure.estimate, penalty)


def _coefficient_search(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    declared: Estimate,
    coefficients: tuple[str, ...],
) -> CoefficientSearch:
    """Search among the hypotheses that are no instrument errors and the instrument errors with kinematic evidence."""
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
    return CoefficientSearch(candidates, coefficients, fitted, criterion, admitted)


def _selected_with_delays(
    identified: SelectedStructure, declared: Estimate, search: CoefficientSearch, near: SelectedStructure | None
) -> DelaySelection:
    """The structure with the time delays of instruments estimated jointly from kinematics and coefficients.

    A wrong time delay biases the structure and a wrong structure biases the time delay: the search starts from the
    delays of kinematics alone and from those that the declared structure prefers, and the outcome of higher penalised
    likelihood is taken. `near`: a structure to start from in place of the declared one.
    """
    origin = SelectedStructure(declared, ()) if near is None else near

    def at_delays(found: Estimate, delays: JointDelays) -> Estimate:
        point = with_errors_held(found.point, delays.effects)
        return estimate(declared.problem, point, found.solution.weights)

    def outcome(initial: JointDelays) -> DelaySelection:
        start = SelectedStructure(at_delays(origin.estimate, initial), origin.chosen)
        structure, refuted = select_structure(search, start)
        delays = joint_delays(identified.estimate, initial, structure.estimate)
        if delays is initial:
            return DelaySelection(initial, structure, refuted)
        at_joint = at_delays(structure.estimate, delays)
        if search.worsens_prediction(structure.estimate, at_joint):
            return DelaySelection(initial, structure, refuted)
        return DelaySelection(delays, SelectedStructure(at_joint, structure.chosen), refuted)

    kinematic = kinematic_delays(identified.estimate)
    joint = joint_delays(identified.estimate, kinematic, declared)
    if is_within(kinematic, joint, declared.problem.settings.deviations):
        return outcome(joint)
    found, other = both(lambda: outcome(joint), lambda: outcome(kinematic), [declared.problem])
    best, alternative = (search.penalised_likelihood(each.structure) - each.delays.penalty for each in (found, other))
    return other if alternative > best else found
