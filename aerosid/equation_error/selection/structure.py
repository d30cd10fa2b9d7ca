"""Deletion of one effect at a time from a selected structure, the others estimated anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from aerosid.compiled.cores import mapped
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import Estimate, Peak, likeliest_numbers
from aerosid.equation_error.selection.penalties import Label, Rules, own_effects, total_cost

STEPS = 4
"""Numerical: Gauss-Newton steps at most of a structure with one effect less."""


@dataclass(frozen=True)
class Chosen:
    """A hypothesis that entered, with its numbers at the estimate's point.

    `kinematic`: whether kinematics alone proved it. `gain` in ln L when it entered.
    """

    hypothesis: Hypothesis
    kinematic: bool
    gain: float


@dataclass(frozen=True)
class Selected:
    """A structure and its estimate; `chosen` in the order of the point's added effects and terms.

    `instead`: what was found without each and in its place, kept as long as the structure.
    """

    estimate: Estimate
    chosen: tuple[Chosen, ...]
    instead: dict[object, list[Any]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def labels(self) -> tuple[Label, ...]:
        """What the chosen ones are called, in their order."""
        return tuple(each.hypothesis.label for each in self.chosen)

    def labels_beyond(self, other: Selected) -> tuple[Label, ...]:
        """What of it another structure does not have."""
        known = set(other.labels)
        return tuple(label for label in self.labels if label not in known)


def paid(selected: Selected, rules: Rules) -> float:
    """Ln L of a structure less the cost of all that entered."""
    chosen = [each.hypothesis for each in selected.chosen]
    return selected.estimate.log_likelihood - total_cost(rules, selected.estimate.point, chosen)


def without(point: Point, chosen: Chosen) -> Point:
    """The point without a hypothesis: its terms struck out, its effects gone."""
    hypothesis = chosen.hypothesis
    own = own_effects(point, hypothesis)
    effects = tuple(active for active in point.effects if not any(active is one for one in own))
    dropped = set(hypothesis.entries)
    free = tuple(entry for entry in point.free if entry not in dropped)
    return replace(point, model=point.model.without(dropped), free=free, effects=effects)


def each_struck_out(selected: Selected, those: Sequence[Chosen], *, with_columns: bool = False) -> list[Peak]:
    """The structure without each of some, estimated anew; asked again of the same structure, none is made anew.

    `with_columns`: those of the effects' numbers as well, where more is to be asked of the rest than its likelihood.
    """
    found, frame = selected.estimate, selected.estimate.frame

    def known(each: Chosen) -> Peak | None:
        peaks = selected.instead.get(("without", each.hypothesis.label), (None,))
        return peaks[0]

    def made(each: Chosen) -> Peak:
        peak = known(each) or likeliest_numbers(frame, without(found.point, each), found.solution.weights, STEPS)
        return peak.with_columns() if with_columns else peak

    def is_there(each: Chosen) -> bool:
        peak = known(each)
        return peak is not None and (not with_columns or peak.has_columns)

    missing = [each for each in those if not is_there(each)]
    for each, peak in zip(missing, mapped(made, missing, common=[frame]), strict=True):
        selected.instead["without", each.hypothesis.label] = [peak]
    return [selected.instead["without", each.hypothesis.label][0] for each in those]


def struck_out(selected: Selected, each: Chosen) -> Estimate:
    """The structure without one, estimated anew."""
    (peak,) = each_struck_out(selected, [each], with_columns=True)
    return peak.estimate


def left_out(selected: Selected, gone: Chosen) -> Selected:
    """The structure without one, estimated anew, and those that stay."""
    return Selected(struck_out(selected, gone), tuple(each for each in selected.chosen if each is not gone))
