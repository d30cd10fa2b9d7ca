"""Near-significant effects: preferred by the likelihood, but below the penalty for multiple testing.

Among some sixty hypotheses a few appear real by chance, so each is penalised for the number tested. An effect that
would be significant as a single hypothesis justifies another flight, and an engineer who expects it should know its
distance from significance.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from aerosid.compiled.cores import both
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import Weights
from aerosid.equation_error.regression.estimate import Estimate, estimate, maximise_likelihood
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.related_problems import weights_restricted_to
from aerosid.equation_error.selection.alternatives import last_parameter
from aerosid.equation_error.selection.calibration import exceeds_calibration
from aerosid.equation_error.selection.candidate_scores import best_candidates, score_candidates
from aerosid.equation_error.selection.candidates import (
    CURRENT_MODEL,
    Candidate,
    cached_candidates,
    is_instrument_error,
    linearised,
    regressed_with,
    with_hypothesis,
)
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.cross_validation import CoefficientFit
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion, schwarz_penalty
from aerosid.equation_error.selection.redundancy import non_redundant, without_held_timings
from aerosid.equation_error.selection.stepwise import Admitted, is_acceptable, recordings_agree
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.equation_error.selection.wald_tests import null_value


@dataclass(frozen=True)
class NearSignificant:
    """A hypothesis that would be significant as the only one tested.

    Attributes
    ----------
    hypothesis : Hypothesis
    active : ActiveEffect or None
        The effect with its parameter values; None for a term.
    value, std_error : float
        Of its leading parameter, from all records; the standard error corrected for coloured residuals.
    gain, penalty : float
        In ln L: gain over the selected structure, and penalty for the number of hypotheses tested.
    estimate : Estimate
        The structure with it.
    indistinguishable : tuple of Hypothesis
        Others that lose their significance in its presence: the records support one of them.
    validation_fits : tuple of (CoefficientFit, CoefficientFit)
        Prediction of its coefficient in validation records by the selected structure and with it.
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

    @property
    def is_retained(self) -> bool:
        """Whether it is an instrument error within the accuracy of a calibration."""
        return self.active is not None and not exceeds_calibration(self.estimate, self.hypothesis)


def near_significant_effects(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    structure: SelectedStructure,
    search: CoefficientSearch,
    listed: Collection[Label],
) -> tuple[NearSignificant, ...]:
    """The near-significant effect of the kinematic and of the coefficient equations, each if there is one.

    Parameters
    ----------
    errors : InstrumentErrors
        The hypotheses, and the criterion of the kinematic equations.
    identified, structure : SelectedStructure
        The structures selected by the kinematic and by the coefficient equations.
    search : CoefficientSearch
        Hypotheses and criterion of the coefficient equations.
    listed : collection of Label
        Hypotheses that were selected or refuted, or are alternatives.
    """
    sensors = [h for h in errors.hypotheses if h.label not in listed and is_instrument_error(h)]
    terms = [h for h in search.hypotheses if h.label not in listed and not is_instrument_error(h)]
    rows = both(
        functools.partial(near_significant_effect, identified, errors.criterion, sensors, recordings_agree),
        functools.partial(near_significant_effect, structure, search.criterion, terms, search.admitted),
        [identified.estimate.problem, structure.estimate.problem],
    )
    return tuple(row for row in rows if row is not None)


def near_significant_effect(
    selected: SelectedStructure,
    criterion: SelectionCriterion,
    hypotheses: Sequence[Hypothesis],
    admitted: Admitted = lambda _found, _hypothesis: True,
) -> NearSignificant | None:
    """The likeliest effect that would be significant as a single hypothesis; None where there is none.

    Parameters
    ----------
    selected : SelectedStructure
        The selected structure.
    criterion : SelectionCriterion
        With the penalties for all hypotheses tested.
    hypotheses : sequence of Hypothesis
        Those that were tested and neither selected, nor refuted, nor listed as alternatives.
    admitted : callable
        Admission by criteria other than the likelihood.
    """
    base = selected.estimate
    eligible = without_held_timings(non_redundant(hypotheses, selected.chosen), base.point)
    candidates = cached_candidates(selected.cache, CURRENT_MODEL, base, eligible)
    scored = score_candidates(base, candidates)

    def may_be_significant(n: int) -> bool:
        hypothesis = candidates[n].hypothesis
        distinct = criterion.is_distinct(hypothesis, scored.independent[n], scored.gains[n], base.problem.settings)
        return distinct and scored.gains[n] >= schwarz_penalty(hypothesis, criterion.samples)

    order = best_candidates(scored, candidates, base.problem.settings.shortlist, may_be_significant)
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
    fits: Callable[[Estimate], Sequence[CoefficientFit]],
) -> NearSignificant:
    """An effect with its influence on the prediction of the coefficients of validation records.

    Parameters
    ----------
    selected_fits : sequence of CoefficientFit
        Of the selected structure.
    fitted : RegressionProblem
        The coefficient equations of the identification records.
    fits : callable
        The reported fits of an estimate.
    """
    named = {coefficient for coefficient, _ in row.hypothesis.entries}
    if not named:
        return row
    alone = estimate(
        fitted, row.estimate.point, weights_restricted_to(row.estimate, fitted, row.estimate.point), steps=4
    )
    pairs = zip(selected_fits, fits(alone), strict=True)
    return replace(row, validation_fits=tuple((a, b) for a, b in pairs if not a.fitted and a.coefficient in named))


class _Row(NamedTuple):
    """A candidate with its first-order gain."""

    candidate: Candidate
    gain: float
    hypothesis: Hypothesis
    weights: Weights


def _linearised(base: Estimate, candidate: Candidate, criterion: SelectionCriterion) -> _Row | None:
    """A candidate significant as a single hypothesis to first order, the colour re-estimated."""
    solution, hypothesis = linearised(base, candidate)
    gain = base.gain_by(solution)
    if gain < schwarz_penalty(hypothesis, criterion.samples):
        return None
    return _Row(candidate, gain, hypothesis, solution.weights)


def _indistinguishable(
    base: Estimate, chosen: _Row, others: Sequence[_Row], criterion: SelectionCriterion
) -> tuple[Hypothesis, ...]:
    """Candidates of about the same gain that are no longer significant in the presence of the chosen one."""

    def is_significant_in_addition(row: _Row) -> bool:
        columns = np.column_stack([chosen.candidate.columns, row.candidate.columns])
        with_both = regressed_with(base, columns, chosen.weights)
        return base.gain_by(with_both) - chosen.gain >= schwarz_penalty(row.candidate.hypothesis, criterion.samples)

    close = [row for row in others if chosen.gain - row.gain < base.problem.settings.alike]
    return tuple(row.candidate.hypothesis for row in close if not is_significant_in_addition(row))


def _reestimated(
    base: Estimate, row: _Row, criterion: SelectionCriterion, admitted: Admitted
) -> NearSignificant | None:
    """A candidate with all parameters re-estimated, if still significant as a single hypothesis and admissible."""
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
