"""Pairs of hypotheses that hide each other: neither pays its price alone, both together pay both.

A scale of theta and a delay of q bend the same equation in opposite ways; forward selection, which asks one hypothesis
at a time, sees little of either (Miller, Subset Selection in Regression, section 3.2). Two independent hypotheses have
the product of their prior odds, so that a pair costs the sum of both prices, and false alarms are no likelier by it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import Weights, uncoloured
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.selection.candidates import (
    BESIDE,
    Candidate,
    candidates_kept,
    joined,
    likeliest,
    regressed_beside,
    scores,
    started,
    to_first_order,
    told_apart,
)
from aerosid.equation_error.selection.penalties import Rules, price_alone, total_cost
from aerosid.equation_error.selection.redundancy import are_redundant, open_beside
from aerosid.equation_error.selection.stepwise import Admitted, backward, may_stand
from aerosid.equation_error.selection.structure import Chosen, Selected
from aerosid.equation_error.settings import TRIALS


def with_pair(
    selected: Selected,
    rules: Rules,
    hypotheses: Sequence[Hypothesis],
    admitted: Admitted = lambda _found, _hypothesis: True,
    told: Callable[[str], None] = lambda _text: None,
) -> Selected | None:
    """The structure of kinematic faults with the likeliest two that pay together; None where no two do.

    Parameters
    ----------
    selected : Selected
        The structure beside which no single hypothesis pays.
    hypotheses : sequence of Hypothesis
        Those of one number are asked; places along several axes are not.
    admitted : callable
        What each of the two must pass beside the other.
    """
    base, best, most = selected.estimate, None, 0.0
    if len(selected.chosen) + 2 > base.frame.settings.most:
        return None
    open_ = open_beside(hypotheses, selected.chosen)
    for begun, weights in _promising(base, candidates_kept(selected.instead, BESIDE, base, open_), rules):
        one, other = begun
        found = _with_both(base, one, other, weights)
        gain = found.gain_over(base)
        net = gain - total_cost(rules, found.point, begun)
        told(f"   tried together {one.label} and {other.label} {net:.1f}")
        # Each is judged as the last one of an estimate.
        if (
            net > most
            and may_stand(found, other, admitted)
            and may_stand(_with_both(base, other, one, weights), one, admitted)
        ):
            most, best = net, (found, begun, gain)
    if best is None:
        return None
    found, pair, gain = best
    told(f"  enter together {pair[0].label} and {pair[1].label}")
    chosen = (*selected.chosen, *(Chosen(hypothesis, kinematic=True, gain=gain) for hypothesis in pair))
    return backward(Selected(found, chosen), rules, keep=pair, told=told)


def _with_both(base: Estimate, first: Hypothesis, last: Hypothesis, weights: Weights) -> Estimate:
    """The estimate with two more hypotheses, in this order."""
    return estimate(base.frame, joined(joined(base.point, first), last), weights)


def _promising(
    base: Estimate, candidates: Sequence[Candidate], rules: Rules
) -> list[tuple[tuple[Hypothesis, Hypothesis], Weights]]:
    """The pairs that may pay both prices, by their gain to first order with the colour estimated anew."""
    rows = []
    for one, other in itertools.combinations(_asked(base, candidates, rules), 2):
        if are_redundant(one.hypothesis, other.hypothesis):
            continue
        trial = regressed_beside(base, np.column_stack([one.columns, other.columns]), base.solution.weights)
        cost = rules.least_cost(one.hypothesis) + rules.least_cost(other.hypothesis)
        net = base.gain_by(trial) - cost
        if net >= base.frame.settings.nearly:
            first, second = trial.values[-2:].tolist()
            rows.append((net, (started(one, [first]), started(other, [second])), trial.weights))
    rows.sort(key=lambda row: -row[0])
    return [(begun, weights) for _, begun, weights in rows[: TRIALS.pairs]]


def _asked(base: Estimate, candidates: Sequence[Candidate], rules: Rules) -> list[Candidate]:
    """The candidates of one number that would pay by themselves were they all that is asked, one of each name.

    To first order with the colour estimated anew: what is slow hides in a colour that was estimated without it.
    """
    white = replace(base, solution=uncoloured(base.design, base.solution.residuals))
    lone = [each for each in candidates if each.columns.shape[1] == 1]
    best: dict[tuple[str, ...], tuple[float, Candidate]] = {}
    for each in (base, white):
        scored = scores(each, lone)
        for n in likeliest(scored, lone, base.frame.settings.shortlist):
            least = price_alone(lone[n].hypothesis, rules.samples)
            if scored.gains[n] < least or scored.own[n] < base.frame.settings.distinct:
                continue
            solution, _ = to_first_order(base, lone[n])
            gain = base.gain_by(solution)
            name = told_apart(lone[n].hypothesis)
            if gain >= least and (name not in best or gain > best[name][0]):
                best[name] = gain, lone[n]
    rows = sorted(best.values(), key=lambda row: rules.least_cost(row[1].hypothesis) - row[0])
    return [candidate for _, candidate in rows[: TRIALS.asked_in_pairs]]
