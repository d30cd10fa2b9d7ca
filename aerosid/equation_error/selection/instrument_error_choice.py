"""Choice among instrument errors that kinematics hardly distinguish, by the likelihood of the coefficient equations.

Biases of a gyro, an accelerometer and an attitude all appear as one drift of the sideslip; a vane ahead of its position
and an accelerometer behind it give one path. Kinematics assign each the same likelihood; the side force does not, nor
do the constants of a nearly symmetric aircraft.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from aerosid.compiled.cores import mapped
from aerosid.effects import frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.selection.candidate_scores import best_candidates, score_candidates
from aerosid.equation_error.selection.candidates import (
    effect_candidates,
    linearised,
    with_hypothesis,
    within_limits,
)
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.redundancy import non_redundant
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, estimate_without


@dataclass(frozen=True)
class CoefficientCheck:
    """The coefficient equations as a check of instrument errors identified by kinematics.

    `problem`: the equations of all records; `start`: the declared structure.
    """

    problem: RegressionProblem
    start: Point

    def log_likelihood(self, kinematic: Estimate) -> float:
        """Ln L of the declared structure's coefficients with the instrument errors of a kinematic estimate."""
        effects = tuple(frozen(active) for active in kinematic.point.effects)
        return estimate(self.problem, replace(self.start, effects=effects)).log_likelihood

    def admits(self, found: Estimate, hypothesis: Hypothesis) -> bool:
        """Whether the coefficients lose less in ln L by the last error of a kinematic estimate than kinematics gain.

        The kinematic gain is evaluated with the same weights.
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
    """The errors, each replaced by one of about equal kinematic likelihood where the joint likelihood prefers that.

    `may_replace`: which errors may replace a selected one at all.
    """
    for each in selected.chosen:
        eligible = [hypothesis for hypothesis in hypotheses if may_replace(each.hypothesis, hypothesis)]
        if not eligible:
            continue
        settings, reduced = selected.estimate.problem.settings, estimate_without(selected, each)
        gain = selected.estimate.gain_over(reduced)
        # Both leave about the same residual: each is weighted by its own noise.
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
    """Estimates with each of the likeliest other errors in place of a selected one, added to the `reduced` structure.

    Each is preceded by the joint ln L less its penalty; those of less than `least_gain` are left out.
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
