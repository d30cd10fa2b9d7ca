"""Hypotheses that say the same of one channel, or of one distance between two: together they are a fit, no finding."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.selection.penalties import Label
from aerosid.equation_error.selection.structure import SelectedEffect

CONTROL_DELAY_KINDS = frozenset({"control_delay", "control_lag"})
"""Kinds that say of a control that it is late."""

EQUIVALENT_DELAYS = (frozenset({"sensor_delay", "sensor_lag", "sensor_position"}), CONTROL_DELAY_KINDS)
"""Kinds that say of one channel that it is late: two of them on the same one are a fit and no finding."""

COLLINEAR_POSITIONS = (
    frozenset({("sensor_position", "alpha"), ("sensor_position", "a_z")}),
    frozenset({("sensor_position", "V"), ("sensor_position", "a_x")}),
    frozenset({("sensor_position", "beta"), ("sensor_position", "a_y")}),
)
"""Kinematics show how far each vane, and the pitot tube, is from its accelerometer, and not where either is."""


def share_a_distance(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether kinematics tell the places of two sensors by their distance alone."""
    return any({(one.kind, one.where), (other.kind, other.where)} <= distance for distance in COLLINEAR_POSITIONS)


def are_redundant(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses both say when the same channel answers, or how far the same two sensors are apart."""
    if share_a_distance(one, other):
        return True
    return one.where == other.where and any(one.kind in kinds and other.kind in kinds for kinds in EQUIVALENT_DELAYS)


def is_redundant(hypothesis: Hypothesis, chosen: Sequence[SelectedEffect]) -> bool:
    """Whether a chosen hypothesis says already what another would say of the same channel or distance."""
    return any(are_redundant(hypothesis, each.hypothesis) for each in chosen)


def non_redundant(
    hypotheses: Iterable[Hypothesis], chosen: Sequence[SelectedEffect], barred: Collection[Label] = ()
) -> list[Hypothesis]:
    """What may still be asked beside some chosen ones; `barred`: what is not asked either."""
    taken = {*barred, *(each.hypothesis.label for each in chosen)}
    return [h for h in hypotheses if h.label not in taken and not is_redundant(h, chosen)]
