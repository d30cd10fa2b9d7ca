"""Position of a vane beside its time delay, by the likelihoods of kinematics and coefficients together.

A search that adds one effect at a time does not find it: where the delay has taken the position up its kinematic gain
vanishes, and the kinematic optimum of both may lie at a limit of either. Forces and moments tell them apart, because
they depend on the flow angle and on the rate by derivatives of their own, of which most are declared. Only a pair that
may exceed its penalty to first order is fitted, and it has to explain more than the delay of any kind alone or with a
term in the rate that moves the vane, which where it is not declared takes the position's part in its coefficient.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import axes_of
from aerosid.effects.sensor_position import AHEAD
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import (
    Alternative,
    alike_margin,
    last_parameter,
    replacements_of,
)
from aerosid.equation_error.selection.candidates import is_instrument_error, with_hypothesis
from aerosid.equation_error.selection.joint_errors import JointErrors, is_timing_of, kinematic_errors, with_errors_held
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion
from aerosid.equation_error.selection.profiled_error import ProfiledError, likeliest_value
from aerosid.equation_error.selection.redundancy import share_a_distance
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    point_without,
    structure_without,
)
from aerosid.equation_error.selection.time_delays import joint_gain
from aerosid.equation_error.settings import TRIALS

MOVED_BY = {"alpha": "q_hat", "beta": "r_hat"}
"""Standard: the variable of the rate that moves each vane sideways to the flow."""


class IdentifiedVane(NamedTuple):
    """A position or dead time that both kinds of equations show together, and what its delay is without it.

    `effect` with its gain in ln L; `timing` with its value alone, `std_error` of that; `instead` what is identified
    beside the delay alone and not with the effect; `unplaced` other vanes that are late, of which neither was looked
    for beside this one.
    """

    effect: SelectedEffect
    timing: ActiveEffect
    std_error: float
    instead: tuple[Label, ...] = ()
    unplaced: tuple[str, ...] = ()


def likelier_places(
    identified: SelectedStructure,
    errors: JointErrors,
    structure: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
) -> Iterator[ProfiledError]:
    """Vanes ahead of the centre of gravity by more than their penalty, each beside the delay that was selected for it.

    Neither a delay alone nor a lag alone explains as much, nor either with a term in the rate that moves the vane.

    Parameters
    ----------
    identified, errors : SelectedStructure, JointErrors
        Instrument errors, from kinematics and jointly.
    structure : SelectedStructure
        Of the coefficient equations of all records, its first effects these errors.
    hypotheses : sequence of Hypothesis
        All candidates.
    """
    for each in identified.chosen:
        hypothesis = _place_of(each, identified, structure, hypotheses)
        if hypothesis is None:
            continue
        penalty = criterion.penalty(hypothesis)
        selected = ProfiledError(hypothesis, each.hypothesis, 0.0, identified, errors, structure.estimate)
        instead = _in_place_of(hypothesis, [*identified.chosen, *structure.chosen])
        point = structure.estimate.point
        least = selected.log_likelihood - sum(criterion.penalty_at(other.hypothesis, point) for other in instead)
        begun = selected if not instead else _without(selected, instead)
        if begun.line.step <= 0.0 or begun.line.gain < TRIALS.asked * penalty:
            continue
        found = likeliest_value(begun)
        if found.log_likelihood - penalty <= max(begun.log_likelihood, least):
            continue
        rivals = _rivals(begun, each, hypotheses, criterion)
        if found.log_likelihood - penalty > max(rival.penalised for rival in rivals):
            joint = joint_gain(begun.identified, each, begun.errors, begun.coefficients)
            gain = found.log_likelihood - begun.log_likelihood + (joint.total if joint is not None else 0.0)
            yield replace(found, alternatives=_alternatives(found, rivals, gain))


def _in_place_of(hypothesis: Hypothesis, chosen: Sequence[SelectedEffect]) -> list[SelectedEffect]:
    """What may have been selected in place of a vane's position: its accelerometer's, and terms in the rate."""
    rate = MOVED_BY[hypothesis.where]
    return [
        each
        for each in chosen
        if share_a_distance(each.hypothesis, hypothesis)
        or (not each.hypothesis.effects and all(str(term) == rate for _, term in each.hypothesis.entries))
    ]


def _without(selected: ProfiledError, instead: Sequence[SelectedEffect]) -> ProfiledError:
    """The structure without some errors and terms, all else re-estimated, the vane as declared."""
    identified, found = selected.identified, selected.coefficients
    others = found.point.effects[len(identified.estimate.point.effects) :]
    for each in instead:
        if each.kinematic:
            identified = structure_without(identified, each)
    errors = kinematic_errors(identified.estimate)
    point = replace(found.point, effects=(*errors.effects, *others))
    for each in instead:
        if not each.kinematic:
            point = point_without(point, each.hypothesis)
    reduced = estimate(found.problem, with_errors_held(point, errors.effects), found.solution.weights)
    return replace(selected, identified=identified, errors=errors, coefficients=reduced).moved_to(0.0)


@dataclass(frozen=True)
class _Rival:
    """What may explain as much with the vane as declared; `penalty`: of what it has beside the delay."""

    hypothesis: Hypothesis
    estimated: ProfiledError
    penalty: float

    @property
    def penalised(self) -> float:
        """The joint ln L less the penalty."""
        return self.estimated.log_likelihood - self.penalty

    def as_alternative_to(self, found: ProfiledError, margin: float) -> Alternative:
        """As alternative of the position; a delay with its joint estimate."""
        estimated, coefficients = self.estimated, self.estimated.coefficients
        active, value, error = None, 0.0, 0.0
        if self.hypothesis.entries:
            _, value, error = last_parameter(coefficients, self.hypothesis)
        else:
            active, error = estimated.errors.estimate_of(self.hypothesis)
            value = active.values[0]
        deficit = found.log_likelihood - estimated.log_likelihood
        return Alternative(self.hypothesis, active, value, error, 0.0, deficit, margin, found.hypothesis, coefficients)


def _rivals(
    begun: ProfiledError, timing: SelectedEffect, hypotheses: Sequence[Hypothesis], criterion: SelectionCriterion
) -> list[_Rival]:
    """The time delay of either kind without the position, alone and with a term in the rate that moves the vane."""
    found = [_Rival(begun.timing, begun, 0.0), _Rival(begun.timing, begun.moved_to(0.0), 0.0)]
    rest = tuple(other for other in begun.identified.chosen if other is not timing)
    sensors = [hypothesis for hypothesis in hypotheses if is_instrument_error(hypothesis)]
    for row in replacements_of(begun.identified, timing, sensors):
        if is_timing_of(row.hypothesis, timing.hypothesis.where):
            other = SelectedStructure(row.estimate, (*rest, SelectedEffect(row.hypothesis, True, row.gain)))
            found.append(_Rival(row.hypothesis, replace(begun, identified=other).moved_to(0.0), 0.0))
    at = begun.coefficients
    for hypothesis in hypotheses:
        (coefficient, term), *_ = (*hypothesis.entries, ("", None))
        if hypothesis.effects or str(term) != MOVED_BY[timing.hypothesis.where]:
            continue
        if (coefficient, term) in at.point.free:
            continue
        wider = estimate(at.problem, with_hypothesis(at.point, hypothesis), at.solution.weights)
        estimated = replace(begun, coefficients=wider).moved_to(0.0)
        found.append(_Rival(hypothesis, estimated, criterion.penalty_at(hypothesis, estimated.coefficients.point)))
    return found


def _alternatives(found: ProfiledError, rivals: Sequence[_Rival], gain: float) -> tuple[Alternative, ...]:
    """The rivals that are no worse than an alternative may be, the likeliest of each name; `gain` of both in ln L."""
    settings = found.coefficients.problem.settings
    margin = alike_margin(settings.alike_instruments, gain)
    best: dict[Label, Alternative] = {}
    for rival in sorted(rivals, key=lambda each: -each.estimated.log_likelihood):
        row = rival.as_alternative_to(found, margin)
        if row.deficit < margin and row.ratio >= settings.deviations:
            best.setdefault(row.hypothesis.label, row)
    return tuple(best.values())


def _place_of(
    timing: SelectedEffect,
    identified: SelectedStructure,
    structure: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
) -> Hypothesis | None:
    """The undeclared position of the vane whose time delay was selected; None where there is nothing to be found."""
    channel = timing.hypothesis.where
    timings = [each for each in identified.chosen if is_timing_of(each.hypothesis, channel)]
    if timing not in timings or len(timings) > 1 or channel not in MOVED_BY:
        return None  # a position beside both a lag and a dead time would be a third number for one lateness
    # Zero is a position too: of a flow angle that was already referred to the centre of gravity.
    if any(channel in each.manoeuvre.log.positions for each in identified.estimate.problem.recordings):
        return None
    for hypothesis in hypotheses:
        if (
            hypothesis.kind != "sensor_position"
            or hypothesis.where != channel
            or axes_of(hypothesis.effects[0]) != AHEAD
        ):
            continue
        given = any(active.name == (hypothesis.kind, channel) for active in structure.estimate.point.effects)
        return None if given else hypothesis
    return None
