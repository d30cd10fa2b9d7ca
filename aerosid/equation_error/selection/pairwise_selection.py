"""Pairwise forward selection: neither of two hypotheses is significant alone, both together are.

A scale factor of theta and a delay of q have opposite effects on one equation; forward selection, which tests one
hypothesis at a time, detects neither (Miller, Subset Selection in Regression, section 3.2). Two independent hypotheses
have the product of their prior odds, so that the penalty of a pair is the sum of both, and the false-alarm rate is not
raised.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import Weights
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.least_squares import uncoloured
from aerosid.equation_error.selection.candidate_scores import best_candidates, score_candidates
from aerosid.equation_error.selection.candidates import (
    CURRENT_MODEL,
    Candidate,
    at_regressed_values,
    cached_candidates,
    distinct_name,
    linearised,
    regressed_with,
    with_hypothesis,
)
from aerosid.equation_error.selection.penalties import SelectionCriterion, joint_penalty, schwarz_penalty
from aerosid.equation_error.selection.redundancy import are_redundant, non_redundant
from aerosid.equation_error.selection.stepwise import Admitted, eliminate_by_penalty, is_acceptable
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure
from aerosid.equation_error.settings import TRIALS


def add_pair(
    selected: SelectedStructure,
    criterion: SelectionCriterion,
    hypotheses: Sequence[Hypothesis],
    admitted: Admitted = lambda _found, _hypothesis: True,
) -> SelectedStructure | None:
    """The structure of instrument errors with the likeliest pair that is significant jointly; None where there is none.

    Parameters
    ----------
    selected : SelectedStructure
        The structure to which no single hypothesis can be added.
    hypotheses : sequence of Hypothesis
        Only those of one parameter are tested; positions along several axes are not.
    admitted : callable
        Test that each of the two must pass in the presence of the other.
    """
    base, best, most = selected.estimate, None, 0.0
    if len(selected.chosen) + 2 > base.problem.settings.most:
        return None
    eligible = non_redundant(hypotheses, selected.chosen)
    for initial, weights in _promising(
        base, cached_candidates(selected.cache, CURRENT_MODEL, base, eligible), criterion
    ):
        one, other = initial
        found = _with_both(base, one, other, weights)
        gain = found.gain_over(base)
        net = gain - joint_penalty(criterion, found.point, initial)
        # The test applies to the last hypothesis of an estimate.
        if (
            net > most
            and is_acceptable(found, other, admitted)
            and is_acceptable(_with_both(base, other, one, weights), one, admitted)
        ):
            most, best = net, (found, initial, gain)
    if best is None:
        return None
    found, pair, gain = best
    chosen = (*selected.chosen, *(SelectedEffect(hypothesis, kinematic=True, gain=gain) for hypothesis in pair))
    return eliminate_by_penalty(SelectedStructure(found, chosen), criterion, protected=pair)


def _with_both(base: Estimate, first: Hypothesis, last: Hypothesis, weights: Weights) -> Estimate:
    """The estimate with two more hypotheses, in this order."""
    return estimate(base.problem, with_hypothesis(with_hypothesis(base.point, first), last), weights)


def _promising(
    base: Estimate, candidates: Sequence[Candidate], criterion: SelectionCriterion
) -> list[tuple[tuple[Hypothesis, Hypothesis], Weights]]:
    """The pairs whose first-order gain, with the colour re-estimated, may exceed both penalties."""
    rows = []
    for one, other in itertools.combinations(_eligible(base, candidates, criterion), 2):
        if are_redundant(one.hypothesis, other.hypothesis):
            continue
        trial = regressed_with(base, np.column_stack([one.columns, other.columns]), base.solution.weights)
        penalty = criterion.least_penalty(one.hypothesis) + criterion.least_penalty(other.hypothesis)
        net = base.gain_by(trial) - penalty
        if net >= base.problem.settings.nearly:
            first, second = trial.values[-2:].tolist()
            rows.append((net, (at_regressed_values(one, [first]), at_regressed_values(other, [second])), trial.weights))
    rows.sort(key=lambda row: -row[0])
    return [(initial, weights) for _, initial, weights in rows[: TRIALS.pairs]]


def _eligible(base: Estimate, candidates: Sequence[Candidate], criterion: SelectionCriterion) -> list[Candidate]:
    """The candidates of one parameter that are significant as single hypotheses, one of each name.

    To first order with the colour re-estimated: a slow effect is absorbed by a colour estimated without it.
    """
    white = replace(base, solution=uncoloured(base.design, base.solution.residuals))
    single = [each for each in candidates if each.columns.shape[1] == 1]
    best: dict[tuple[str, ...], tuple[float, Candidate]] = {}
    for each in (base, white):
        scored = score_candidates(each, single)
        for n in best_candidates(scored, single, base.problem.settings.shortlist):
            least = schwarz_penalty(single[n].hypothesis, criterion.samples)
            if scored.gains[n] < least or scored.independent[n] < base.problem.settings.distinct:
                continue
            solution, _ = linearised(base, single[n])
            gain = base.gain_by(solution)
            name = distinct_name(single[n].hypothesis)
            if gain >= least and (name not in best or gain > best[name][0]):
                best[name] = gain, single[n]
    rows = sorted(best.values(), key=lambda row: criterion.least_penalty(row[1].hypothesis) - row[0])
    return [candidate for _, candidate in rows[: TRIALS.asked_in_pairs]]
