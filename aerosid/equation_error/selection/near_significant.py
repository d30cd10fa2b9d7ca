"""Hypotheses that the likelihood prefers and that their prior odds keep from being named.

Of some sixty hypotheses chance alone makes a few look real, so that each has to pay for all that are asked. What would
pay were it the only question is worth another flight, and an engineer who expects it should know how near it came.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import Weights
from aerosid.equation_error.regression.estimate import Estimate, Frame, estimate, likeliest_numbers, weights_on
from aerosid.equation_error.selection.alternatives import last_number
from aerosid.equation_error.selection.candidates import (
    BESIDE,
    Candidate,
    candidates_kept,
    joined,
    likeliest,
    regressed_beside,
    scores,
    to_first_order,
)
from aerosid.equation_error.selection.cross_validation import Share, shares_of
from aerosid.equation_error.selection.penalties import Rules, price_alone
from aerosid.equation_error.selection.redundancy import open_beside
from aerosid.equation_error.selection.stepwise import Admitted, may_stand
from aerosid.equation_error.selection.structure import Selected
from aerosid.equation_error.selection.wald_tests import null_of


@dataclass(frozen=True)
class NearlyProven:
    """A hypothesis that would be named were it the only one asked.

    Attributes
    ----------
    hypothesis : Hypothesis
    active : ActiveEffect or None
        The effect with its numbers; None for a term.
    value, std_error : float
        Of its leading number, from all recordings; the deviation corrected for coloured residuals.
    gain, price : float
        In ln L: what it brings beside the structure that stands, and what is asked among so many.
    estimate : Estimate
        The structure with it.
    rivals : tuple of Hypothesis
        Others that would no longer be worth asking beside it: the recordings show one of them.
    unseen : tuple of (Share, Share)
        How well its coefficient is predicted on unseen recordings, by the structure that stands and with it.
    """

    hypothesis: Hypothesis
    active: ActiveEffect | None
    value: float
    std_error: float
    gain: float
    price: float
    estimate: Estimate = field(repr=False, compare=False)
    rivals: tuple[Hypothesis, ...] = ()
    unseen: tuple[tuple[Share, Share], ...] = ()


def nearly_proven(
    selected: Selected,
    rules: Rules,
    hypotheses: Sequence[Hypothesis],
    admitted: Admitted = lambda _found, _hypothesis: True,
) -> NearlyProven | None:
    """The likeliest of what would be named beside a structure were it asked alone; None where nothing would.

    Parameters
    ----------
    selected : Selected
        The structure that stands.
    rules : Rules
        Prices among all that were asked.
    hypotheses : sequence of Hypothesis
        What was asked and was neither named, nor refused, nor listed as an alternative.
    admitted : callable
        What may stand on other grounds than the likelihood.
    """
    base = selected.estimate
    candidates = candidates_kept(selected.instead, BESIDE, base, open_beside(hypotheses, selected.chosen))
    scored = scores(base, candidates)

    def may_pay(n: int) -> bool:
        hypothesis = candidates[n].hypothesis
        distinct = rules.is_distinct(hypothesis, scored.own[n], scored.gains[n], base.frame.settings)
        return distinct and scored.gains[n] >= price_alone(hypothesis, rules.samples)

    order = likeliest(scored, candidates, base.frame.settings.shortlist, may_pay)
    rows = [row for n in order if (row := _first_order(base, candidates[n], rules)) is not None]
    for row in sorted(rows, key=lambda row: rules.price(row.candidate.hypothesis) - row.gain):
        rows = [other for other in rows if other is not row]
        found = _estimated(base, row, rules, admitted)
        if found is not None:
            return replace(found, rivals=_rivals(base, row, rows, rules))
    return None


def with_unseen(row: NearlyProven, standing: Sequence[Share], fitted: Frame, compared: Frame) -> NearlyProven:
    """A hypothesis with what it would do to the coefficients of unseen recordings.

    Parameters
    ----------
    standing : sequence of Share
        Of the structure that stands.
    fitted, compared : Frame
        The coefficient equations of the fitted recordings, and of all as shares are told.
    """
    named = {coefficient for coefficient, _ in row.hypothesis.entries}
    if not named:
        return row
    alone = estimate(fitted, row.estimate.point, weights_on(row.estimate, fitted, row.estimate.point), steps=4)
    pairs = zip(standing, shares_of(compared, alone), strict=True)
    return replace(row, unseen=tuple((a, b) for a, b in pairs if not a.fitted and a.coefficient in named))


class _Row(NamedTuple):
    """A candidate with what it brings to first order."""

    candidate: Candidate
    gain: float
    hypothesis: Hypothesis
    weights: Weights


def _first_order(base: Estimate, candidate: Candidate, rules: Rules) -> _Row | None:
    """A candidate that would pay alone, to first order with the colour estimated anew."""
    solution, hypothesis = to_first_order(base, candidate)
    gain = base.gain_by(solution)
    if gain < price_alone(hypothesis, rules.samples):
        return None
    return _Row(candidate, gain, hypothesis, solution.weights)


def _rivals(base: Estimate, told: _Row, others: Sequence[_Row], rules: Rules) -> tuple[Hypothesis, ...]:
    """What brings about as much by itself, and beside the one that is told would no longer pay alone."""

    def stands_beside(row: _Row) -> bool:
        columns = np.column_stack([told.candidate.columns, row.candidate.columns])
        both = regressed_beside(base, columns, told.weights)
        return base.gain_by(both) - told.gain >= price_alone(row.candidate.hypothesis, rules.samples)

    near = [row for row in others if told.gain - row.gain < base.frame.settings.alike]
    return tuple(row.candidate.hypothesis for row in near if not stands_beside(row))


def _estimated(base: Estimate, row: _Row, rules: Rules, admitted: Admitted) -> NearlyProven | None:
    """A candidate with all numbers estimated anew, where it still would pay alone and may stand."""
    begun = joined(base.point, row.hypothesis)
    found = likeliest_numbers(base.frame, begun, row.weights, steps=5).estimate
    gain, settings = found.gain_over(base), base.frame.settings
    active, value, error = last_number(found, row.hypothesis)
    certain = error > 0.0 and abs(value - null_of(active)) >= settings.near_deviations * error
    price = rules.cost(row.hypothesis, found.point)
    even = price + float(np.log(rules.chance(row.hypothesis)))
    if gain < max(even, settings.near_share * price) or not certain:
        return None
    if not may_stand(found, row.hypothesis, admitted):
        return None
    return NearlyProven(row.hypothesis, active, value, error, gain, price, found)
