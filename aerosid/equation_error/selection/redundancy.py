"""Redundant hypotheses: different errors of one channel, or of one distance, that replace one another."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import UNIT, axes_of
from aerosid.effects.sensor_position import AHEAD
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.selection.joint_errors import DELAY_KINDS
from aerosid.equation_error.selection.penalties import Label
from aerosid.equation_error.selection.structure import SelectedEffect
from aerosid.flight_model.axes import ACCELEROMETERS

PLACE = "sensor_position"
"""The kind of a sensor that is not where it is declared."""

CONTROL_DELAY_KINDS = frozenset({"control_delay", "control_lag"})
"""Kinds of time delay of a control."""

SENSOR_DELAY_KINDS = DELAY_KINDS | {PLACE}
"""Kinds that model the time delay of an instrument: each is the other's alternative."""

EQUIVALENT_DELAYS = (SENSOR_DELAY_KINDS, CONTROL_DELAY_KINDS)
"""Kinds that model the time delay of one channel. A lag and a delay of one control may both be in a structure: in the
angular acceleration, the dead time is distinct from the exponential approach, and each is the other's alternative only
where a single one suffices."""

COLLINEAR_POSITIONS = (
    frozenset({(PLACE, "alpha"), (PLACE, "a_z")}),
    frozenset({(PLACE, "V"), (PLACE, "a_x")}),
    frozenset({(PLACE, "beta"), (PLACE, "a_y")}),
    *(frozenset({(PLACE, channel), (PLACE, UNIT)}) for channel in ("alpha", "beta", "V", *ACCELEROMETERS)),
)
"""Kinematics determine the distance of each vane, and the pitot tube, from its accelerometer, and not the position of
either; a unit of accelerometers has the position of each of them."""


def share_a_distance(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether kinematics determine only the distance between the positions of two sensors."""
    pair = {(one.kind, one.where), (other.kind, other.where)}
    return any(pair <= distance for distance in COLLINEAR_POSITIONS) and not _lie_across(one, other)


def is_unit_ahead(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is the position of the accelerometers' unit that pitching shows, along x alone."""
    return (hypothesis.kind, hypothesis.where) == (PLACE, UNIT) and axes_of(hypothesis.effects[0]) == AHEAD


def _lie_across(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether one is the unit ahead of its place, as pitching shows it, and the other a height."""
    heights = [each for each in (one, other) if AHEAD not in axes_of(each.effects[0])]
    return any(map(is_unit_ahead, (one, other))) and bool(heights)


def are_redundant(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses both model the delay of one channel, or the distance between the same two sensors."""
    return _replace_each_other(one, other, EQUIVALENT_DELAYS)


def _replace_each_other(one: Hypothesis, other: Hypothesis, delays: Iterable[frozenset[str]]) -> bool:
    if share_a_distance(one, other):
        return True
    return one.where == other.where and any(one.kind in kinds and other.kind in kinds for kinds in delays)


def is_redundant(hypothesis: Hypothesis, chosen: Sequence[SelectedEffect]) -> bool:
    """Whether a selected hypothesis already models the delay or distance that another would model."""
    return any(are_redundant(hypothesis, each.hypothesis) for each in chosen)


def non_redundant(
    hypotheses: Iterable[Hypothesis], chosen: Sequence[SelectedEffect], barred: Collection[Label] = ()
) -> list[Hypothesis]:
    """The hypotheses that can be tested in the presence of selected ones; `barred`: labels left out as well."""
    taken = {*barred, *(each.hypothesis.label for each in chosen)}
    return [h for h in hypotheses if h.label not in taken and not any(_excludes(each, h) for each in chosen)]


def without_held_timings(hypotheses: Iterable[Hypothesis], point: Point) -> list[Hypothesis]:
    """The hypotheses without delays of channels that have one held at a value, as a vane's dead time beside its lag."""
    held = {active.name for active in point.effects if active.effect.kind in DELAY_KINDS and not active.values}
    return [h for h in hypotheses if (h.kind, h.where) not in held]


def _excludes(selected: SelectedEffect, hypothesis: Hypothesis) -> bool:
    """Whether a selected effect leaves no room for a hypothesis, as a vane's delay for its position.

    Kinematics tell a dead time from a lag; what they cannot tell, forces and moments are not asked one by one.
    """
    one = selected.hypothesis
    are_timings = {one.kind, hypothesis.kind} == DELAY_KINDS and one.where == hypothesis.where
    if are_timings and selected.kinematic:
        return False
    return _replace_each_other(hypothesis, one, (SENSOR_DELAY_KINDS,))
