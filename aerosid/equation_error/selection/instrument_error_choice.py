"""Choice among instruments' faults that kinematics hardly tell apart, by the coefficients that they would leave.

A gyro's zero, an accelerometer's and an attitude's are one drift of the sideslip; a vane ahead of its place and an
accelerometer behind it are one path. Kinematics give each the same likelihood; the side force does not, nor do the
constants of an aircraft that is nearly symmetric.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from aerosid.compiled.cores import mapped
from aerosid.effects import frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import (
    Estimate,
    Frame,
    estimate,
)
from aerosid.equation_error.selection.candidates import (
    effect_candidates,
    joined,
    likeliest,
    scores,
    to_first_order,
    within_limits,
)
from aerosid.equation_error.selection.penalties import Rules
from aerosid.equation_error.selection.redundancy import open_beside
from aerosid.equation_error.selection.structure import Chosen, Selected, struck_out


@dataclass(frozen=True)
class CoefficientsBeside:
    """The coefficient equations beside some kinematic ones.

    `frame` of them on all recordings; `start` the declared structure.
    """

    frame: Frame
    start: Point

    def log_likelihood(self, kinematic: Estimate) -> float:
        """Ln L of the declared structure's coefficients where the instruments have the faults of an estimate."""
        effects = tuple(frozen(active) for active in kinematic.point.effects)
        return estimate(self.frame, replace(self.start, effects=effects)).log_likelihood

    def admit(self, found: Estimate, hypothesis: Hypothesis) -> bool:
        """Whether the last fault of a kinematic estimate costs the coefficients less than it brings.

        What it brings is asked of the kinematic equations with the same weights.
        """
        count = len(hypothesis.effects)
        before = replace(found.point, effects=found.point.effects[:-count])
        base = estimate(found.frame, before, found.solution.weights, steps=4)
        cost = self.log_likelihood(base) - self.log_likelihood(found)
        return cost < found.gain_over(base)


def chosen_with_coefficients(
    selected: Selected,
    asked: Sequence[Hypothesis],
    rules: Rules,
    beside: CoefficientsBeside,
    alike: Callable[[Hypothesis, Hypothesis], bool] = lambda _chosen, _other: True,
) -> Selected:
    """The faults, each changed for one that does about the same to the kinematics where the coefficients say so.

    `alike`: which other may stand in a chosen one's place at all.
    """
    for each in selected.chosen:
        open_ = [hypothesis for hypothesis in asked if alike(each.hypothesis, hypothesis)]
        if not open_:
            continue
        settings, bare = selected.estimate.frame.settings, struck_out(selected, each)
        brought = selected.estimate.gain_over(bare)
        # Both leave about the same: each is judged by the noise that it leaves itself.
        kept = (
            beside.log_likelihood(selected.estimate) + selected.estimate.log_likelihood - rules.price(each.hypothesis)
        )
        best: tuple[float, Estimate, Hypothesis] | None = None
        least = settings.choice_share * brought
        for more, found, hypothesis in _in_its_place(bare, selected, each, open_, least, rules, beside):
            if more - kept > settings.choice_gain and (best is None or more > best[0]):
                best = more, found, hypothesis
        if best is not None:
            others = tuple(other for other in selected.chosen if other is not each)
            selected = Selected(best[1], (*others, Chosen(best[2], each.kinematic, each.gain)))
    return selected


def _in_its_place(
    bare: Estimate,
    selected: Selected,
    each: Chosen,
    asked: Sequence[Hypothesis],
    least: float,
    rules: Rules,
    beside: CoefficientsBeside,
) -> list[tuple[float, Estimate, Hypothesis]]:
    """Estimates with each of the likeliest other faults in the place of a chosen one, beside the `bare` structure.

    Before each, ln L of both kinds of equations less its price; none that brings less than the `least` gain.
    """
    frame = selected.estimate.frame
    rest = [other for other in selected.chosen if other is not each]
    open_ = open_beside(asked, rest, [each.hypothesis.label])
    candidates = effect_candidates(frame, bare, open_)

    def tried(n: int) -> tuple[float, Estimate, Hypothesis] | None:
        trial, hypothesis = to_first_order(bare, candidates[n])
        found = estimate(frame, joined(bare.point, hypothesis), trial.weights, steps=5)
        if not within_limits(found, hypothesis) or found.gain_over(bare) < least:
            return None
        return beside.log_likelihood(found) + found.log_likelihood - rules.price(hypothesis), found, hypothesis

    order = likeliest(scores(bare, candidates), candidates, frame.settings.shortlist)
    return [row for row in mapped(tried, order, common=[frame]) if row is not None]
