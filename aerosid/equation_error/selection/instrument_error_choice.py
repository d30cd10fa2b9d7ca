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
    RegressionProblem,
    estimate,
)
from aerosid.equation_error.selection.candidates import (
    best_candidates,
    effect_candidates,
    linearised,
    score_candidates,
    with_hypothesis,
    within_limits,
)
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.redundancy import non_redundant
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, estimate_without


@dataclass(frozen=True)
class CoefficientCheck:
    """The coefficient equations beside some kinematic ones.

    `problem` of them on all recordings; `start` the declared structure.
    """

    problem: RegressionProblem
    start: Point

    def log_likelihood(self, kinematic: Estimate) -> float:
        """Ln L of the declared structure's coefficients where the instruments have the faults of an estimate."""
        effects = tuple(frozen(active) for active in kinematic.point.effects)
        return estimate(self.problem, replace(self.start, effects=effects)).log_likelihood

    def admits(self, found: Estimate, hypothesis: Hypothesis) -> bool:
        """Whether the last fault of a kinematic estimate costs the coefficients less than it brings.

        What it brings is asked of the kinematic equations with the same weights.
        """
        count = len(hypothesis.effects)
        before = replace(found.point, effects=found.point.effects[:-count])
        base = estimate(found.problem, before, found.solution.weights, steps=4)
        loss = self.log_likelihood(base) - self.log_likelihood(found)
        return loss < found.gain_over(base)


def choose_by_coefficients(
    selected: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
    coefficients: CoefficientCheck,
    may_replace: Callable[[Hypothesis, Hypothesis], bool] = lambda _chosen, _other: True,
) -> SelectedStructure:
    """The faults, each changed for one that does about the same to the kinematics where the coefficients say so.

    `may_replace`: which other may stand in a chosen one's place at all.
    """
    for each in selected.chosen:
        eligible = [hypothesis for hypothesis in hypotheses if may_replace(each.hypothesis, hypothesis)]
        if not eligible:
            continue
        settings, reduced = selected.estimate.problem.settings, estimate_without(selected, each)
        gain = selected.estimate.gain_over(reduced)
        # Both leave about the same: each is judged by the noise that it leaves itself.
        current = (
            coefficients.log_likelihood(selected.estimate)
            + selected.estimate.log_likelihood
            - criterion.penalty(each.hypothesis)
        )
        best: tuple[float, Estimate, Hypothesis] | None = None
        least_gain = settings.choice_share * gain
        for total, found, hypothesis in _replacements(
            reduced, selected, each, eligible, least_gain, criterion, coefficients
        ):
            if total - current > settings.choice_gain and (best is None or total > best[0]):
                best = total, found, hypothesis
        if best is not None:
            others = tuple(other for other in selected.chosen if other is not each)
            selected = SelectedStructure(best[1], (*others, SelectedEffect(best[2], each.kinematic, each.gain)))
    return selected


def _replacements(
    reduced: Estimate,
    selected: SelectedStructure,
    each: SelectedEffect,
    hypotheses: Sequence[Hypothesis],
    least_gain: float,
    criterion: SelectionCriterion,
    coefficients: CoefficientCheck,
) -> list[tuple[float, Estimate, Hypothesis]]:
    """Estimates with each of the likeliest other faults in the place of a chosen one, beside the `reduced` structure.

    Before each, ln L of both kinds of equations less its price; none that brings less than the `least_gain` gain.
    """
    problem = selected.estimate.problem
    rest = [other for other in selected.chosen if other is not each]
    eligible = non_redundant(hypotheses, rest, [each.hypothesis.label])
    candidates = effect_candidates(problem, reduced, eligible)

    def tried(n: int) -> tuple[float, Estimate, Hypothesis] | None:
        trial, hypothesis = linearised(reduced, candidates[n])
        found = estimate(problem, with_hypothesis(reduced.point, hypothesis), trial.weights, steps=5)
        if not within_limits(found, hypothesis) or found.gain_over(reduced) < least_gain:
            return None
        return (
            coefficients.log_likelihood(found) + found.log_likelihood - criterion.penalty(hypothesis),
            found,
            hypothesis,
        )

    order = best_candidates(score_candidates(reduced, candidates), candidates, problem.settings.shortlist)
    return [row for row in mapped(tried, order, common=[problem]) if row is not None]
