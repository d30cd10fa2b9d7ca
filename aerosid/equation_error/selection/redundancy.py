"""Hypotheses that say the same of one channel, or of one distance between two: together they are a fit, no finding."""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.selection.deletion import Chosen

LATE_CONTROL = frozenset({"control_delay", "control_lag"})
"""Kinds that say of a control that it is late."""

TIMINGS = (frozenset({"sensor_delay", "sensor_lag", "sensor_position"}), LATE_CONTROL)
"""Kinds that say of one channel that it is late: two of them on the same one are a fit and no finding."""

ONE_DISTANCE = (
    frozenset({("sensor_position", "alpha"), ("sensor_position", "a_z")}),
    frozenset({("sensor_position", "V"), ("sensor_position", "a_x")}),
    frozenset({("sensor_position", "beta"), ("sensor_position", "a_y")}),
)
"""Kinematics show how far each vane, and the pitot tube, is from its accelerometer, and not where either is."""


def at_one_distance(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether kinematics tell the places of two sensors by their distance alone."""
    return any({(one.kind, one.where), (other.kind, other.where)} <= distance for distance in ONE_DISTANCE)


def is_told(hypothesis: Hypothesis, chosen: Sequence[Chosen]) -> bool:
    """Whether a chosen hypothesis says already when the same channel answers, or how far two sensors are apart."""
    name = (hypothesis.kind, hypothesis.where)
    known = {(each.hypothesis.kind, each.hypothesis.where) for each in chosen}
    if any(name in distance and known & distance for distance in ONE_DISTANCE):
        return True
    return any(
        each.hypothesis.where == hypothesis.where and each.hypothesis.kind in kinds and hypothesis.kind in kinds
        for each in chosen
        for kinds in TIMINGS
    )


def are_redundant(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses say the same of one channel or of one distance."""
    return is_told(one, [Chosen(other, kinematic=False, gain=0.0)])
