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
from aerosid.equation_error.regression.estimate import (
    Estimate,
    RegressionProblem,
    estimate,
    maximise_likelihood,
    weights_restricted_to,
)
from aerosid.equation_error.selection.alternatives import last_parameter
from aerosid.equation_error.selection.candidates import (
    CURRENT_MODEL,
    Candidate,
    best_candidates,
    cached_candidates,
    linearised,
    regressed_with,
    score_candidates,
    with_hypothesis,
)
from aerosid.equation_error.selection.cross_validation import CoefficientFit, fits_of
from aerosid.equation_error.selection.penalties import SelectionCriterion, schwarz_penalty
from aerosid.equation_error.selection.redundancy import non_redundant
from aerosid.equation_error.selection.stepwise import Admitted, is_acceptable
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.equation_error.selection.wald_tests import null_value


@dataclass(frozen=True)
class NearSignificant:
    """A hypothesis that would be named were it the only one asked.

    Attributes
    ----------
    hypothesis : Hypothesis
    active : ActiveEffect or None
        The effect with its numbers; None for a term.
    value, std_error : float
        Of its leading number, from all recordings; the deviation corrected for coloured residuals.
    gain, penalty : float
        In ln L: what it brings beside the structure that stands, and what is asked among so many.
    estimate : Estimate
        The structure with it.
    indistinguishable : tuple of Hypothesis
        Others that would no longer be worth asking beside it: the recordings show one of them.
    validation_fits : tuple of (CoefficientFit, CoefficientFit)
        How well its coefficient is predicted on unseen recordings, by the structure that stands and with it.
    """

    hypothesis: Hypothesis
    active: ActiveEffect | None
    value: float
    std_error: float
    gain: float
    penalty: float
    estimate: Estimate = field(repr=False, compare=False)
    indistinguishable: tuple[Hypothesis, ...] = ()
    validation_fits: tuple[tuple[CoefficientFit, CoefficientFit], ...] = ()


def near_significant_effect(
    selected: SelectedStructure,
    criterion: SelectionCriterion,
    hypotheses: Sequence[Hypothesis],
    admitted: Admitted = lambda _found, _hypothesis: True,
) -> NearSignificant | None:
    """The likeliest of what would be named beside a structure were it asked alone; None where nothing would.

    Parameters
    ----------
    selected : SelectedStructure
        The structure that stands.
    criterion : SelectionCriterion
        Prices among all that were asked.
    hypotheses : sequence of Hypothesis
        What was asked and was neither named, nor refused, nor listed as an alternative.
    admitted : callable
        What may stand on other grounds than the likelihood.
    """
    base = selected.estimate
    candidates = cached_candidates(selected.cache, CURRENT_MODEL, base, non_redundant(hypotheses, selected.chosen))
    scored = score_candidates(base, candidates)

    def may_pay(n: int) -> bool:
        hypothesis = candidates[n].hypothesis
        distinct = criterion.is_distinct(hypothesis, scored.independent[n], scored.gains[n], base.problem.settings)
        return distinct and scored.gains[n] >= schwarz_penalty(hypothesis, criterion.samples)

    order = best_candidates(scored, candidates, base.problem.settings.shortlist, may_pay)
    rows = [row for n in order if (row := _linearised(base, candidates[n], criterion)) is not None]
    for row in sorted(rows, key=lambda row: criterion.penalty(row.candidate.hypothesis) - row.gain):
        rows = [other for other in rows if other is not row]
        found = _reestimated(base, row, criterion, admitted)
        if found is not None:
            return replace(found, indistinguishable=_indistinguishable(base, row, rows, criterion))
    return None


def with_validation_fits(
    row: NearSignificant,
    selected_fits: Sequence[CoefficientFit],
    fitted: RegressionProblem,
    compared: RegressionProblem,
) -> NearSignificant:
    """A hypothesis with what it would do to the coefficients of unseen recordings.

    Parameters
    ----------
    selected_fits : sequence of CoefficientFit
        Of the structure that stands.
    fitted, compared : RegressionProblem
        The coefficient equations of the fitted recordings, and of all as shares are told.
    """
    named = {coefficient for coefficient, _ in row.hypothesis.entries}
    if not named:
        return row
    alone = estimate(
        fitted, row.estimate.point, weights_restricted_to(row.estimate, fitted, row.estimate.point), steps=4
    )
    pairs = zip(selected_fits, fits_of(compared, alone), strict=True)
    return replace(row, validation_fits=tuple((a, b) for a, b in pairs if not a.fitted and a.coefficient in named))


class _Row(NamedTuple):
    """A candidate with what it brings to first order."""

    candidate: Candidate
    gain: float
    hypothesis: Hypothesis
    weights: Weights


def _linearised(base: Estimate, candidate: Candidate, criterion: SelectionCriterion) -> _Row | None:
    """A candidate that would pay alone, to first order with the colour estimated anew."""
    solution, hypothesis = linearised(base, candidate)
    gain = base.gain_by(solution)
    if gain < schwarz_penalty(hypothesis, criterion.samples):
        return None
    return _Row(candidate, gain, hypothesis, solution.weights)


def _indistinguishable(
    base: Estimate, chosen: _Row, others: Sequence[_Row], criterion: SelectionCriterion
) -> tuple[Hypothesis, ...]:
    """What brings about as much by itself, and beside the one that is told would no longer pay alone."""

    def pays_in_addition(row: _Row) -> bool:
        columns = np.column_stack([chosen.candidate.columns, row.candidate.columns])
        with_both = regressed_with(base, columns, chosen.weights)
        return base.gain_by(with_both) - chosen.gain >= schwarz_penalty(row.candidate.hypothesis, criterion.samples)

    close = [row for row in others if chosen.gain - row.gain < base.problem.settings.alike]
    return tuple(row.candidate.hypothesis for row in close if not pays_in_addition(row))


def _reestimated(
    base: Estimate, row: _Row, criterion: SelectionCriterion, admitted: Admitted
) -> NearSignificant | None:
    """A candidate with all numbers estimated anew, where it still would pay alone and may stand."""
    initial = with_hypothesis(base.point, row.hypothesis)
    found = maximise_likelihood(base.problem, initial, row.weights, steps=5).estimate
    gain, settings = found.gain_over(base), base.problem.settings
    active, value, error = last_parameter(found, row.hypothesis)
    is_significant = error > 0.0 and abs(value - null_value(active)) >= settings.near_deviations * error
    penalty = criterion.penalty_at(row.hypothesis, found.point)
    even_odds = penalty + float(np.log(criterion.allowed_false_alarm(row.hypothesis)))
    if gain < max(even_odds, settings.near_share * penalty) or not is_significant:
        return None
    if not is_acceptable(found, row.hypothesis, admitted):
        return None
    return NearSignificant(row.hypothesis, active, value, error, gain, penalty, found)
