"""Stepwise regression: forward selection by score tests, with backward elimination after each entry."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from aerosid.effects import NoiseEffect
from aerosid.estimation.fit_settings import BACKGROUND
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.score_test import Score
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.findings import Identity, Part, identity
from aerosid.search.noise_filtering import explains_beyond_noise_averaging
from aerosid.search.restarts import restart_candidates, restarts_from_declared_values
from aerosid.search.shortlist_fits import ShortlistFit, fits_of, leading_fits
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import shortlisted, trial_fits, without_idle_step_changes


def forward_selection(
    search: StructureSearch,
    start: Refinement,
    max_entries: int | None = None,
    entered: Callable[[Refinement], None] = lambda _estimate: None,
) -> tuple[Refinement, list[tuple[Score, ...]]]:
    """Enter hypotheses one at a time, `max_entries` in all, and eliminate those that a later one makes insignificant.

    Returns the final estimate and the scores of each round; `entered` is called with the estimate after each entry.
    """
    current = start
    rounds = []
    for _ in range(search.settings.rounds if max_entries is None else max_entries):
        scores = search.scores(current)
        rounds.append(scores)
        fits, left_out = leading_fits(search, current, shortlisted(search, scores))
        improved = _improved(search, current, fits)
        if improved is None and left_out and _lowers_cost(search, current, fits):
            improved = _improved(search, current, fits_of(search, current, left_out))
        if improved is None:
            break
        current = with_disturbance_statistics(search, improved)
        entered(current)
    return current, rounds


def _lowers_cost(search: StructureSearch, current: Refinement, fits: Sequence[ShortlistFit]) -> bool:
    """Whether a trial fit has a lower penalised cost than the present estimate, whatever its parts' significance."""
    return any(search.penalised_cost(fit) < search.penalised_cost(current) for _, fit in fits)


def _improved(search: StructureSearch, current: Refinement, fits: Sequence[ShortlistFit]) -> Refinement | None:
    """The best new structure of some trial fits and their restarts, after backward elimination; None without one."""
    trials = [fit for _, fit in fits]
    if all(search.has_gross_residual(trial) for trial in trials):
        level = min(map(search.penalised_cost, trials), default=search.penalised_cost(current))
        restarted = restart_candidates(search, current, fits, level)
        trials += trial_fits(
            search, current, [], level, further=restarts_from_declared_values(search, current, restarted, level)
        )
    trials = without_idle_step_changes(search, current, trials, min(map(search.penalised_cost, trials), default=np.inf))
    trials = [trial for trial in trials if search.penalised_cost(trial) < search.penalised_cost(current)]
    return next(
        (better for better in _reduced_trials(search, trials, current) if is_new_structure(search, better, current)),
        None,
    )


def _reduced_trials(search: StructureSearch, trials: Sequence[Refinement], current: Refinement) -> Iterator[Refinement]:
    """The trials after backward elimination, the least penalised cost first."""
    return (eliminate_insignificant(search, trial, current) for trial in sorted(trials, key=search.penalised_cost))


def is_new_structure(search: StructureSearch, trial: Refinement, current: Refinement) -> bool:
    """Whether a trial has other parts than the present estimate, at a lower penalised cost."""
    return (
        _at_about(search.parts(trial, None)) != _at_about(search.parts(current, None))
        and search.penalised_cost(trial) < search.penalised_cost(current)
        and explains_beyond_noise_averaging(search, trial, current)
    )


def _at_about(parts: Sequence[Part]) -> set[Identity]:
    """What identifies some parts, a step change to a tenth of a second: it hardly moves in another fit."""
    return {
        (kind, where, term, None if time is None else round(time, 1), log)
        for kind, where, term, time, log in map(identity, parts)
    }


def with_disturbance_statistics(search: StructureSearch, current: Refinement) -> Refinement:
    """The estimate with the statistics of its disturbances re-estimated, which trials hold fixed."""
    if not any(isinstance(active.effect, NoiseEffect) and active.values for active in current.effects):
        return current
    return refine_on(current, search.manoeuvres, BACKGROUND)
