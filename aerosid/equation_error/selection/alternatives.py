"""Indistinguishable alternatives: hypotheses that are nearly as likely as a selected one when they replace it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from aerosid.compiled.cores import allowed, mapped, on_cores
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import uses_no_instruments
from aerosid.equation_error.regression.estimate import Estimate, maximise_likelihood
from aerosid.equation_error.regression.least_squares import Solution
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.candidate_scores import best_candidates, score_candidates
from aerosid.equation_error.selection.candidates import (
    Candidate,
    cached_candidates,
    effect_candidates,
    full_identity,
    limits_of,
    linearised,
    size_penalty,
    with_hypothesis,
    within_limits,
)
from aerosid.equation_error.selection.penalties import SelectionCriterion, effects_of
from aerosid.equation_error.selection.redundancy import is_redundant, non_redundant, without_held_timings
from aerosid.equation_error.selection.starting_values import MAINLY, step_changes_in_place_of
from aerosid.equation_error.selection.stepwise import Admitted
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, deletions, estimate_without
from aerosid.equation_error.selection.wald_tests import null_value
from aerosid.equation_error.settings import TRIALS

_Result = TypeVar("_Result")

_REPLACED = 2
"""Numerical: hypotheses of a structure that are replaced in turn, at most."""

LargestDeficit = Callable[[Hypothesis], float]
"""Deficit in ln L to the selected hypothesis up to which a replacement is of interest."""


@dataclass(frozen=True)
class Alternative:
    """An indistinguishable alternative of a selected hypothesis.

    `active`: effect with its parameter values, None for a term; `gain` in ln L as replacement; `deficit` in ln L to the
    selected hypothesis, not significant up to `margin`; `independent`: fraction of its columns that no other column
    explains; `prior_deficit`: by how much its size is less probable a priori than the selected one's, in ln L.
    """

    hypothesis: Hypothesis
    active: ActiveEffect | None
    value: float
    std_error: float
    gain: float
    deficit: float
    margin: float
    replaces: Hypothesis
    estimate: Estimate = field(repr=False, compare=False)
    independent: float = 1.0
    prior_deficit: float = 0.0

    @property
    def ratio(self) -> float:
        """Distance of the leading parameter from its null value in standard errors; infinite without any."""
        return abs(self.value - null_value(self.active)) / self.std_error if self.std_error > 0.0 else np.inf


def alike_margin(least: float, gain: float) -> float:
    """Deficit in ln L up to which a difference is not significant, of the `least` one and what was selected gains."""
    return least + 0.03 * gain


def gains_by_deletion(selected: SelectedStructure) -> dict[tuple[str, str, str], float]:
    """Gain in ln L of each selected hypothesis by label: the loss when it is deleted from the structure."""
    reduced_fits = deletions(selected, selected.chosen, with_columns=not uses_no_instruments(selected.estimate.design))
    return {
        each.hypothesis.label: selected.estimate.gain_over(reduced)
        for each, reduced in zip(selected.chosen, reduced_fits, strict=True)
    }


def alternatives_of(selected: SelectedStructure, hypotheses: Sequence[Hypothesis]) -> tuple[Alternative, ...]:
    """The alternatives of every selected hypothesis, the likeliest first.

    Alternatives of implausible size are left out: an aircraft with the centre of gravity half a chord from its weighed
    position would not have flown.
    """
    rows = _for_each(
        selected,
        lambda each: replacements_of(selected, each, hypotheses),
        lambda each: _cached(selected, each, hypotheses) is not None,
    )
    return tuple(row for of_one in rows for row in of_one if row.deficit + row.prior_deficit < row.margin)


def with_replacements(
    selected: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
    admitted: Admitted = lambda _found, _hypothesis: True,
) -> SelectedStructure:
    """The structure with each hypothesis replaced by a likelier one, in terms of penalised likelihood."""
    for _ in range(_REPLACED):
        better = functools.partial(
            _likeliest_replacement, selected, hypotheses=hypotheses, criterion=criterion, admitted=admitted
        )
        is_cached = functools.partial(_is_cached_winner, selected, hypotheses=hypotheses, criterion=criterion)
        found = _for_each(selected, better, is_cached, until=lambda row: row is not None)
        row = found[-1] if found else None
        if row is None:
            return selected
        removed = selected.chosen[len(found) - 1]
        others = tuple(other for other in selected.chosen if other is not removed)
        entering = SelectedEffect(row.hypothesis, removed.kinematic, row.gain)
        selected = SelectedStructure(row.estimate, (*others, entering))
    return selected


def _for_each(
    selected: SelectedStructure,
    evaluate: Callable[[SelectedEffect], _Result],
    is_cached: Callable[[SelectedEffect], bool],
    until: Callable[[_Result], bool] = lambda _result: False,
) -> list[_Result]:
    """Evaluate a function of each selected hypothesis in turn, up to the first result for which `until` holds.

    Entries that it adds to the structure's cache are kept. `is_cached`: whether the result needs no new estimate.
    """

    def with_new(each: SelectedEffect) -> tuple[_Result, dict[object, list[Any]]]:
        before = dict(selected.cache)
        result = evaluate(each)
        new = {key: entry for key, entry in selected.cache.items() if entry is not before.get(key)}
        # Replicas that did other parts keep the same: what is behind a result that ends it is lost.
        selected.cache.clear()
        selected.cache.update(before)
        return result, new

    with on_cores(1 if all(map(is_cached, selected.chosen)) else allowed()):
        results = mapped(
            with_new, selected.chosen, common=[selected.estimate.problem], until=lambda pair: until(pair[0])
        )
    for _, new in results:
        selected.cache.update(new)
    return [result for result, _ in results]


def _likeliest_replacement(
    selected: SelectedStructure,
    each: SelectedEffect,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
    admitted: Admitted,
) -> Alternative | None:
    """The likeliest replacement of an effect that is clearly better and admitted."""
    penalty, clearly = (
        criterion.penalty_at(each.hypothesis, selected.estimate.point),
        selected.estimate.problem.settings.clearly,
    )
    rows = [
        (penalty - criterion.penalty_at(row.hypothesis, row.estimate.point) - row.deficit, row)
        for row in replacements_of(selected, each, hypotheses, _largest_winning_deficit(selected, each, criterion))
    ]
    for better, row in sorted(rows, key=lambda pair: -pair[0]):
        distinct = criterion.is_distinct(row.hypothesis, row.independent, row.gain, row.estimate.problem.settings)
        if better > clearly and distinct and admitted(row.estimate, row.hypothesis):
            return row
    return None


def _largest_winning_deficit(
    selected: SelectedStructure, each: SelectedEffect, criterion: SelectionCriterion
) -> LargestDeficit:
    """The deficit in ln L up to which a replacement can still have a clearly higher penalised likelihood."""
    penalty = (
        criterion.penalty_at(each.hypothesis, selected.estimate.point) - selected.estimate.problem.settings.clearly
    )
    return lambda hypothesis: penalty - criterion.least_penalty(hypothesis)


def _is_cached_winner(
    selected: SelectedStructure, each: SelectedEffect, hypotheses: Sequence[Hypothesis], criterion: SelectionCriterion
) -> bool:
    return _cached(selected, each, hypotheses, _largest_winning_deficit(selected, each, criterion)) is not None


def replacements_of(
    selected: SelectedStructure,
    each: SelectedEffect,
    hypotheses: Sequence[Hypothesis],
    largest_deficit: LargestDeficit | None = None,
) -> list[Alternative]:
    """Replacements of a selected effect, the likeliest first; cached with the structure.

    `largest_deficit`: by default the margin of alternatives. Candidates predicted to exceed it are not estimated.
    """
    cached = _cached(selected, each, hypotheses, largest_deficit)
    if cached is None:
        cached = _estimated_replacements(selected, each, hypotheses, largest_deficit)
        selected.cache[_cache_key(each, hypotheses, largest_deficit)] = cached
    return cached


def _cached(
    selected: SelectedStructure,
    each: SelectedEffect,
    hypotheses: Sequence[Hypothesis],
    largest_deficit: LargestDeficit | None = None,
) -> list[Alternative] | None:
    """Replacements found before; those without a limit include all others."""
    unlimited = selected.cache.get(_cache_key(each, hypotheses))
    return unlimited if unlimited is not None else selected.cache.get(_cache_key(each, hypotheses, largest_deficit))


def _cache_key(
    each: SelectedEffect, hypotheses: Sequence[Hypothesis], largest_deficit: LargestDeficit | None = None
) -> tuple[object, ...]:
    """Key of the cache: the same hypotheses may be tested again within narrower limits."""
    limits = ((h.label, limits_of(h), None if largest_deficit is None else largest_deficit(h)) for h in hypotheses)
    return each.hypothesis.label, tuple(limits)


def _estimated_replacements(
    selected: SelectedStructure,
    each: SelectedEffect,
    hypotheses: Sequence[Hypothesis],
    largest_deficit: LargestDeficit | None,
) -> list[Alternative]:
    problem, settings = selected.estimate.problem, selected.estimate.problem.settings
    reduced = estimate_without(selected, each)
    rest = [other for other in selected.chosen if other is not each]
    eligible = without_held_timings(non_redundant(hypotheses, rest, [each.hypothesis.label]), reduced.point)
    candidates = [
        *cached_candidates(selected.cache, (each.hypothesis.label,), reduced, eligible),
        *_step_change_candidates(selected, each, reduced),
    ]
    scored = score_candidates(reduced, candidates)
    least_margin = settings.alike_instruments if each.kinematic else settings.alike
    replacement = _Replacement(each, reduced, selected.estimate.gain_over(reduced), least_margin)
    usual_penalty = size_penalty(effects_of(selected.estimate.point, each.hypothesis))
    order = best_candidates(scored, candidates, settings.shortlist)

    def trial_key(n: int) -> tuple[object, ...]:
        return ("tried", each.hypothesis.label, *full_identity(candidates[n].hypothesis), candidates[n].trial)

    def fit_candidate(n: int) -> _Estimated | _NotEstimated | None:
        return replacement.fit_candidate(candidates[n], largest_deficit)

    missing = [n for n in order if trial_key(n) not in selected.cache]
    for n, fit in zip(missing, mapped(fit_candidate, missing, common=[problem], names=missing), strict=True):
        if not isinstance(fit, _NotEstimated):
            selected.cache[trial_key(n)] = [fit]
    rows = []
    for n in order:
        (found,) = selected.cache.get(trial_key(n), (None,))
        if found is not None:
            hypothesis, estimated = found.hypothesis, found.estimate
            row = _row(estimated, hypothesis, each.hypothesis, replacement.loss - found.deficit, found.deficit)
            # Where the selected effect gains little more than the margin, having no effect would be an alternative as
            # well. Another kind of time delay of the same channel remains an alternative.
            if row.ratio >= settings.deviations or is_redundant(hypothesis, [each]):
                prior_deficit = size_penalty(effects_of(estimated.point, hypothesis)) - usual_penalty
                rows.append(
                    replace(
                        row,
                        margin=replacement.margin,
                        independent=float(scored.independent[n]),
                        prior_deficit=prior_deficit,
                    )
                )
    return sorted(rows, key=lambda row: row.deficit)


def _step_change_candidates(selected: SelectedStructure, each: SelectedEffect, reduced: Estimate) -> list[Candidate]:
    """Step changes that may replace an effect, those of the kinds selected left out."""
    point = selected.estimate.point
    effects = effects_of(point, each.hypothesis)  # at the estimated instant
    coefficients = [name for name in MAINLY if any(name == of for of, _ in point.model.entries)]
    steps = step_changes_in_place_of(reduced, replace(each.hypothesis, effects=effects), coefficients)
    others = [hypothesis for hypothesis in steps if hypothesis.label not in selected.labels]
    return effect_candidates(reduced.problem, reduced, others)


class _NotEstimated(NamedTuple):
    """A candidate predicted to exceed the deficit of interest; another search may still need its estimate."""


class _Estimated(NamedTuple):
    """A replacement with its starting values, its maximum-likelihood estimate and its deficit in ln L."""

    hypothesis: Hypothesis
    estimate: Estimate
    deficit: float


@dataclass(frozen=True)
class _Replacement:
    """A structure with one hypothesis removed, for the estimation of replacements.

    `removed`: the hypothesis; `reduced`: the structure without it; `loss`: its loss in ln L; `least_margin` in ln L.
    """

    removed: SelectedEffect
    reduced: Estimate
    loss: float
    least_margin: float

    @property
    def margin(self) -> float:
        """Deficit in ln L up to which a difference is not significant."""
        return alike_margin(self.least_margin, self.loss)

    def fit_candidate(
        self, candidate: Candidate, largest_deficit: LargestDeficit | None
    ) -> _Estimated | _NotEstimated | None:
        """A candidate's estimate; None if it is no alternative, `_NotEstimated` if the predicted deficit is large."""
        trial, hypothesis = linearised(self.reduced, candidate)
        # A selected effect of implausible size may be replaced by what is far less likely without its prior.
        winning = -np.inf if largest_deficit is None else largest_deficit(hypothesis)
        if self._is_far_behind(trial, hypothesis, max(TRIALS.hopeless * self.least_margin, winning)):
            return None
        most = np.inf if largest_deficit is None else winning + TRIALS.losing_share * self.loss
        margin = max(self.margin, winning)
        deficits = [self._predicted_deficit(trial)]

        def is_predicted_to_lose() -> bool:
            # The gain by a lag, a limit or an instant deviates strongly from that predicted at its null value: some
            # candidates that were predicted to lose won. Steps of its own parameters predict it well.
            return deficits[-1] > most and (not hypothesis.effects or len(deficits) > 2)

        if is_predicted_to_lose():
            return _NotEstimated()
        initial = with_hypothesis(self.reduced.point, hypothesis)

        def is_promising(predicted: Solution) -> bool:
            deficits.append(self._predicted_deficit(predicted))
            return not (self._is_far_behind(predicted, hypothesis, margin) or is_predicted_to_lose())

        found = maximise_likelihood(
            self.reduced.problem,
            initial,
            trial.weights,
            steps=5,
            is_promising=is_promising,
            near=self.reduced,
            keep_near=True,
        )
        if is_predicted_to_lose():
            return _NotEstimated()
        deficit = self.loss - found.gain_over(self.reduced)
        if not (deficit < margin and within_limits(found, hypothesis)):
            return None
        return _Estimated(hypothesis, found.estimate, deficit)

    def _predicted_deficit(self, predicted: Solution) -> float:
        return self.loss - self.reduced.gain_by(predicted)

    def _is_far_behind(self, predicted: Solution, hypothesis: Hypothesis, most: float) -> bool:
        # Other kinds of time delay are as nonlinear as the selected one.
        far = self._predicted_deficit(predicted) > most + TRIALS.hopeless_share * self.loss
        return far and not is_redundant(hypothesis, [self.removed])


def _row(found: Estimate, hypothesis: Hypothesis, chosen: Hypothesis, gain: float, deficit: float) -> Alternative:
    active, value, error = last_parameter(found, hypothesis)
    return Alternative(hypothesis, active, value, error, gain, deficit, deficit, chosen, found)


def last_parameter(found: Estimate, hypothesis: Hypothesis) -> tuple[ActiveEffect | None, float, float]:
    """Effect of the last hypothesis of an estimate, None for a term, with its leading parameter and standard error."""
    deviations = np.sqrt(np.diag(corrected_covariance(found.design, found.solution)))
    if hypothesis.entries:
        entry = hypothesis.entries[0]
        unknown: tuple[object, ...] = ("term", entry)
        active, value = None, found.point.model.value(entry)
    else:
        index = len(found.point.effects) - 1
        active = found.point.effects[index]
        unknown, value = ("effect", index, 0), active.values[0]
    is_estimated = unknown in found.design.unknowns
    return active, value, float(deviations[found.design.unknowns.index(unknown)]) if is_estimated else float("inf")
