"""Structure selection by kinematics and coefficients together: some instrument errors change both."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import NamedTuple

from aerosid.compiled.cores import both
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.refutation import Refutation
from aerosid.equation_error.regression.declared_values import DeclaredValues
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.linear_or_smooth_inputs import likelier_input_interpolation
from aerosid.equation_error.regression.related_problems import coefficients_of_all, compared_with
from aerosid.equation_error.regression.vane_smoothing import likelier_vane_smoothing
from aerosid.equation_error.selection.accelerometer_unit import (
    ALONE,
    DisplacedUnit,
    in_one_unit,
    single_as_alternative,
    units_of,
    with_unit_favoured,
)
from aerosid.equation_error.selection.airspeed_bias import (
    AirspeedBias,
    reestimated,
    scale_as_alternative,
    selected_bias,
    with_bias_free,
    with_bias_held,
    with_joint_gain,
    without_errors_of_airspeed,
)
from aerosid.equation_error.selection.alternatives import Alternative
from aerosid.equation_error.selection.calibration import BIAS
from aerosid.equation_error.selection.candidates import distinct_name, is_instrument_error
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.damping_collinearity import downwash_prior
from aerosid.equation_error.selection.dead_time import likelier_dead_times
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.joint_errors import (
    JointErrors,
    is_timing_of,
    is_within,
    joint_errors,
    kinematic_errors,
    with_errors_held,
)
from aerosid.equation_error.selection.kinematic_evidence import kinematic_evidence
from aerosid.equation_error.selection.lag_exchange import resolve_lag_exchange
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion, criterion_for
from aerosid.equation_error.selection.profiled_error import ProfiledError, likeliest_value
from aerosid.equation_error.selection.rotary_gusts import rotary_gusts_shown, with_rotary_gusts
from aerosid.equation_error.selection.selection_rounds import add_terms_at_raised_odds, select_structure
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    penalised_likelihood,
    structure_without,
)
from aerosid.equation_error.selection.time_delays import JointGain, joint_gain, likeliest_delay_kinds
from aerosid.equation_error.selection.vane_position import IdentifiedVane, likelier_places


@dataclass(frozen=True)
class ErrorsAndStructure:
    """Instrument errors estimated jointly, the structure selected with them, and the refuted labels."""

    errors: JointErrors
    structure: SelectedStructure
    refuted: dict[Label, Refutation]


class JointSelection(NamedTuple):
    """Instrument errors, their alternatives by both kinds of equations, the coefficient search and the structure.

    `vane`: the position or dead time of a vane that both kinds of equations show together. It is among the outcome's
    errors, and held among those of kinematics; so is `bias`, one of the airspeed. `compared`: labels of errors told
    from those identified by both kinds of equations.
    """

    identified: SelectedStructure
    alternatives: tuple[Alternative, ...]
    search: CoefficientSearch
    outcome: ErrorsAndStructure
    vane: IdentifiedVane | None = None
    compared: tuple[Label, ...] = ()
    bias: AirspeedBias | None = None

    @property
    def log_likelihood(self) -> float:
        """Of both kinds of equations."""
        outcome = self.outcome
        coefficients = outcome.structure.estimate.log_likelihood
        return self.identified.estimate.log_likelihood + coefficients - outcome.errors.penalty

    @property
    def rotary_gusts(self) -> tuple[str, ...]:
        """The vanes whose rotary gusts are among the regressors."""
        return self.outcome.structure.estimate.problem.rotary_gusts

    @property
    def instrument_errors(self) -> tuple[SelectedEffect, ...]:
        """Those of kinematics, the position or dead time of a vane, and a bias of the airspeed."""
        return (*self.identified.chosen, *(each.effect for each in (self.vane, self.bias) if each is not None))


def selected_jointly(
    errors: InstrumentErrors, identified: SelectedStructure, coefficients: tuple[str, ...], values: DeclaredValues
) -> JointSelection:
    """The structure selected by both kinds of equations; a bias of the airspeed among it is estimated from both.

    The selection is repeated with the bias held: what stood for a part of it leaves, and kinematics may show others.
    """
    found = _selected_with_unit(errors, identified, coefficients, values)
    bias = selected_bias(found.outcome.structure, found.search.criterion)
    if bias is None:
        return found
    settings = identified.estimate.problem.settings
    others = replace(errors, hypotheses=without_errors_of_airspeed(errors.hypotheses))
    for _ in range(settings.rounds):
        placed = _selected_with_unit(others, with_bias_held(identified, bias), coefficients, values)
        before, bias = bias, reestimated(bias, placed.outcome.structure.estimate)
        if bias.is_settled(before):
            break
    if not bias.is_significant(settings.deviations):
        unbiased = replace(errors, hypotheses=without_errors_of_airspeed(errors.hypotheses, (BIAS,)))
        return _selected_with_unit(unbiased, identified, coefficients, values)
    bias = with_joint_gain(bias, placed.outcome.structure.estimate)
    free = with_bias_free(placed.outcome.errors, placed.identified.estimate, bias)
    scale = scale_as_alternative(bias, placed.identified, placed.outcome.structure.estimate, errors.hypotheses)
    alternatives = placed.alternatives if scale is None else (*placed.alternatives, scale)
    outcome = replace(placed.outcome, errors=free)
    return placed._replace(outcome=outcome, alternatives=alternatives, bias=bias)


def _selected_with_unit(
    errors: InstrumentErrors, identified: SelectedStructure, coefficients: tuple[str, ...], values: DeclaredValues
) -> JointSelection:
    """The structure selected by both kinds of equations, accelerometers in one unit where they do not contradict that.

    Terms of the axial force may stand for what else the unit does, or undo it: with the unit the search is continued.
    """
    apart = _selected_with_rotary_gusts(errors, identified, coefficients, values)
    unit = None if apart.vane is not None else in_one_unit(apart.identified, errors.hypotheses)
    if unit is None:
        return apart
    near = apart.outcome.structure
    if _most_gain_in_unit(unit, apart) < unit.least_gain:
        return apart
    together = _selected(errors, unit.identified, coefficients, values, apart.rotary_gusts, near)
    gain = _penalised(together, errors.criterion) - _penalised(apart, errors.criterion)
    if gain < unit.least_gain:
        return apart
    single = single_as_alternative(together.identified, apart.identified, unit.label, apart.outcome.errors, gain)
    alternatives = together.alternatives if single is None else (*together.alternatives, single)
    return together._replace(alternatives=alternatives, compared=(ALONE, unit.label))


def _most_gain_in_unit(unit: DisplacedUnit, apart: JointSelection) -> float:
    """What a search continued with the unit may gain in penalised ln L: the terms selected beside it may all leave.

    The selected structure with the unit is as much likelier or less likely in both kinds of equations; what differs by
    less than the margin of alternatives, a search may still find.
    """
    found, errors = apart.outcome.structure.estimate, apart.outcome.errors.effects
    pairs = zip(errors, unit.identified.estimate.point.effects, strict=True)
    held = tuple(own if own.name == moved.name else moved for own, moved in pairs)
    tried = estimate(found.problem, with_errors_held(found.point, held), found.solution.weights)
    kinematic = unit.identified.estimate.gain_over(apart.identified.estimate)
    may_leave = sum(apart.search.criterion.penalty(each.hypothesis) for each in apart.outcome.structure.chosen)
    return kinematic + tried.gain_over(found) + may_leave + found.problem.settings.alike_instruments


def _selected_with_rotary_gusts(
    errors: InstrumentErrors, identified: SelectedStructure, coefficients: tuple[str, ...], values: DeclaredValues
) -> JointSelection:
    """The structure selected by both kinds of equations, with a vane beside its time delay where they show that.

    The declared structure first says whether the moments respond to rotary gusts. What it lacks, as a late vane, may
    look like a response, or hide one: where the selected structure says otherwise, and one that is selected accordingly
    says so too, that is taken.
    """
    found = _selected_with_vane(errors, identified, coefficients, values, None)
    shown = rotary_gusts_shown(found.outcome.structure.estimate)
    if shown == found.rotary_gusts:
        return found
    other = _selected_with_vane(errors, identified, coefficients, values, shown)
    return other if rotary_gusts_shown(other.outcome.structure.estimate) == shown else found


def _selected_with_vane(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    coefficients: tuple[str, ...],
    values: DeclaredValues,
    rotary_gusts: tuple[str, ...] | None,
) -> JointSelection:
    """The same with the rotary gusts of given vanes; None: of those that the declared structure shows."""
    alone = _selected(errors, identified, coefficients, values, rotary_gusts)
    outcome, criterion = alone.outcome, alone.search.criterion
    worsens = functools.partial(alone.search.worsens_prediction, outcome.structure.estimate)
    confirmed: list[tuple[float, JointSelection]] = []
    known = alone.identified, outcome.errors, outcome.structure, errors.hypotheses, criterion
    begun_at = [*likelier_places(*known), *likelier_dead_times(*known)]
    for begun in begun_at:
        if worsens(begun.coefficients):
            continue
        placed, vane = _selected_with(begun, errors, coefficients, values)
        gain = _penalised(placed, errors.criterion) - _penalised(alone, errors.criterion)
        if vane.is_confirmed and gain > criterion.penalty(vane.hypothesis) and not worsens(vane.coefficients):
            others = (other.timing.where for other in begun_at if other.timing.where != begun.timing.where)
            unplaced = tuple(dict.fromkeys(others))
            confirmed.append((gain, _with_vane(alone, placed, begun, vane, unplaced)))
    return max(confirmed, key=lambda pair: pair[0])[1] if confirmed else alone


def _with_vane(
    alone: JointSelection, placed: JointSelection, begun: ProfiledError, vane: ProfiledError, unplaced: tuple[str, ...]
) -> JointSelection:
    """A selection with a vane's position or dead time, and what was selected in its place without it."""
    outcome = replace(placed.outcome, errors=vane.with_value_free())
    named = set(outcome.structure.labels)
    alternatives = (*placed.alternatives, *(row for row in begun.alternatives if row.hypothesis.label not in named))
    gain = vane.log_likelihood - alone.log_likelihood
    effect = SelectedEffect(vane.hypothesis, kinematic=False, gain=gain)
    instead = alone.outcome.structure.labels_not_in(outcome.structure)
    chosen = (each.hypothesis for each in alone.identified.chosen)
    (timing,) = (hypothesis for hypothesis in chosen if is_timing_of(hypothesis, begun.timing.where))
    found = IdentifiedVane(effect, *alone.outcome.errors.estimate_of(timing), instead, unplaced)
    return placed._replace(outcome=outcome, alternatives=alternatives, vane=found)


def _selected_with(
    begun: ProfiledError, errors: InstrumentErrors, coefficients: tuple[str, ...], values: DeclaredValues
) -> tuple[JointSelection, ProfiledError]:
    """The structure selected with an error of a vane held, and its likeliest value with that structure.

    What was selected without the error may have stood in its place, and the value moves without it: the selection is
    repeated where that is more than its standard error.
    """
    vane = begun
    for _ in range(begun.coefficients.problem.settings.rounds):
        placed = _selected(errors, vane.identified, coefficients, values, vane.coefficients.problem.rotary_gusts)
        outcome, before = placed.outcome, vane.value
        found = replace(
            vane, identified=placed.identified, errors=outcome.errors, coefficients=outcome.structure.estimate
        )
        vane = likeliest_value(found)
        if abs(vane.value - before) <= vane.std_error:
            break
    structure = SelectedStructure(vane.coefficients, outcome.structure.chosen)
    outcome = replace(outcome, errors=vane.errors, structure=structure)
    return placed._replace(identified=vane.identified, outcome=outcome), vane


def _penalised(found: JointSelection, of_kinematics: SelectionCriterion) -> float:
    """Ln L of both kinds of equations less the penalties of all effects but a held error of a vane."""
    outcome = found.outcome
    kinematic = penalised_likelihood(found.identified, of_kinematics)
    return kinematic + found.search.penalised_likelihood(outcome.structure) - outcome.errors.penalty


def _selected(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    coefficients: tuple[str, ...],
    values: DeclaredValues,
    rotary_gusts: tuple[str, ...] | None,
    near: SelectedStructure | None = None,
) -> JointSelection:
    """The structure selected by both kinds of equations.

    No time delay is retained whose joint gain is below its penalty or that the coefficients refute. `near`: a
    structure selected with other errors, such a delay among them, from which the search is continued.
    """
    start, settings = errors.start, identified.estimate.problem.settings
    sensors = [h for h in errors.hypotheses if is_instrument_error(h)]
    whole = coefficients_of_all(identified.estimate.problem.recordings, settings, start.model)
    declared = estimate(whole, with_errors_held(start, identified.estimate.point.effects))
    likelier, other_kinds = likeliest_delay_kinds(identified, declared, sensors)
    if likelier is not identified:
        if len(likelier.chosen) != len(identified.chosen):
            near = None  # its first effects are no longer these errors
        identified, declared = likelier, estimate(whole, with_errors_held(start, likelier.estimate.point.effects))
    declared = likelier_vane_smoothing(likelier_input_interpolation(declared))
    declared = compared_with(values, with_rotary_gusts(declared, rotary_gusts))
    search = _coefficient_search(errors, identified, declared, coefficients)
    outcome = _selected_with_errors(identified, declared, search, near)
    for each in identified.chosen:
        gain = joint_gain(identified, each, outcome.errors, outcome.structure.estimate)
        if gain is not None and _is_rejected(gain, search.criterion.penalty(each.hypothesis), outcome, search):
            others = structure_without(identified, each)
            near = SelectedStructure(gain.coefficients_without, outcome.structure.chosen)
            return _selected(errors, others, coefficients, values, rotary_gusts, near)
    undeclared = slice(len(start.effects), len(outcome.errors.effects))
    search, structure, refuted = add_terms_at_raised_odds(search, outcome.structure, outcome.refuted, undeclared)
    search, structure = resolve_lag_exchange(search, structure)
    return JointSelection(identified, other_kinds, search, replace(outcome, structure=structure, refuted=refuted))


def _is_rejected(gain: JointGain, penalty: float, outcome: ErrorsAndStructure, search: CoefficientSearch) -> bool:
    """Whether a time delay gains less than its penalty in both kinds of equations, or coefficients refute it."""
    without, found, proven = gain.coefficients_without, outcome.structure.estimate, gain.total - penalty
    return proven < 0.0 or search.refutes(without, found, penalty) or search.is_outvoted(without, found, proven)


def _coefficient_search(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    declared: Estimate,
    coefficients: tuple[str, ...],
) -> CoefficientSearch:
    """Search among the hypotheses that are no instrument errors and the instrument errors with kinematic evidence."""
    units = units_of(errors.hypotheses, identified.estimate.point, identified.estimate.problem.recordings)
    hypotheses, settings = (*errors.hypotheses, *units), declared.problem.settings
    evidence = kinematic_evidence(identified, [h for h in hypotheses if is_instrument_error(h)])
    candidates = tuple(h for h in hypotheses if not is_instrument_error(h) or distinct_name(h) in evidence)
    alarm = settings.alarm(declared.point.model.axes)
    criterion = criterion_for(hypotheses, declared.design.target.size, alarm, settings.factor_odds)
    criterion = replace(criterion, evidence=evidence, prior_sizes=downwash_prior(errors.start.model))
    criterion = with_unit_favoured(criterion, settings.factor_odds) if units else criterion

    def admitted(found: Estimate, hypothesis: Hypothesis) -> bool:
        known = evidence.get(distinct_name(hypothesis))
        return known is None or known.agrees(found.point.effects[-1].values, settings.agreement)

    fitted = replace(declared.problem, all_fitted=False)
    return CoefficientSearch(candidates, coefficients, fitted, criterion, admitted)


def _selected_with_errors(
    identified: SelectedStructure, declared: Estimate, search: CoefficientSearch, near: SelectedStructure | None
) -> ErrorsAndStructure:
    """The structure with the instrument errors estimated jointly from kinematics and coefficients.

    A wrong error biases the structure and a wrong structure biases the error: the search starts from the errors of
    kinematics alone and from those that the declared structure prefers, and the outcome of higher penalised likelihood
    is taken. `near`: a structure to start from in place of the declared one.
    """
    origin = SelectedStructure(declared, ()) if near is None else near

    def at_errors(found: Estimate, errors: JointErrors) -> Estimate:
        point = with_errors_held(found.point, errors.effects)
        return estimate(declared.problem, point, found.solution.weights)

    def outcome(initial: JointErrors) -> ErrorsAndStructure:
        start = SelectedStructure(at_errors(origin.estimate, initial), origin.chosen)
        structure, refuted = select_structure(search, start)
        errors = joint_errors(identified.estimate, initial, structure.estimate)
        if errors is initial:
            return ErrorsAndStructure(initial, structure, refuted)
        at_joint = at_errors(structure.estimate, errors)
        if search.worsens_prediction(structure.estimate, at_joint):
            return ErrorsAndStructure(initial, structure, refuted)
        return ErrorsAndStructure(errors, SelectedStructure(at_joint, structure.chosen), refuted)

    kinematic = kinematic_errors(identified.estimate)
    joint = joint_errors(identified.estimate, kinematic, declared)
    if is_within(kinematic, joint, declared.problem.settings.deviations):
        return outcome(joint)
    found, other = both(lambda: outcome(joint), lambda: outcome(kinematic), [declared.problem])
    best, alternative = (search.penalised_likelihood(each.structure) - each.errors.penalty for each in (found, other))
    return other if alternative > best else found
