"""Forward selection by score tests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from aerosid.effects import NoiseEffect
from aerosid.estimation.fit_settings import BACKGROUND
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.score_test import Score
from aerosid.search.backward_elimination import pruned
from aerosid.search.command_filters import is_no_filter
from aerosid.search.restarts import afresh, worth_restarting
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import lightened, shortlisted, tried


def forward(
    search: StructureSearch, start: Refinement, most: int | None = None
) -> tuple[Refinement, list[tuple[Score, ...]]]:
    """Let hypotheses enter one at a time, `most` in all, and leave again when a later one explains them."""
    current = start
    rounds = []
    for _ in range(search.settings.rounds if most is None else most):
        scores = search.scores(current)
        rounds.append(scores)
        shortlist = shortlisted(search, scores)
        trials = tried(search, current, shortlist)
        if all(search.is_gross(trial) for trial in trials):
            level = min(map(search.price, trials), default=search.price(current))
            again = worth_restarting(search, current, shortlist, trials, level)
            trials += tried(search, current, [], level, further=afresh(search, current, again, level))
        trials = lightened(search, current, trials, min(map(search.price, trials), default=np.inf))
        trials = [trial for trial in trials if search.price(trial) < search.price(current)]
        improved = next((better for better in pruned_trials(search, trials) if is_news(search, better, current)), None)
        if improved is None:
            break
        current = settled(search, improved)
    return current, rounds


def pruned_trials(search: StructureSearch, trials: Sequence[Refinement]) -> Iterator[Refinement]:
    """The trials without their weak parts, the most likely first."""
    return (pruned(search, trial) for trial in sorted(trials, key=search.price))


def is_news(search: StructureSearch, trial: Refinement, current: Refinement) -> bool:
    """Whether a trial names something else than the present estimate does, at a lower price."""
    known = {(part.label, part.time and round(part.time, 1)) for part in search.parts(current, None)}
    told = {(part.label, part.time and round(part.time, 1)) for part in search.parts(trial, None)}
    return told != known and search.price(trial) < search.price(current) and is_no_filter(search, trial, current)


def settled(search: StructureSearch, current: Refinement) -> Refinement:
    """The estimate with the statistics of its disturbances moved too, which trials keep: less is left for them."""
    if not any(isinstance(active.effect, NoiseEffect) and active.values for active in current.effects):
        return current
    return refine_on(current, search.manoeuvres, BACKGROUND)
