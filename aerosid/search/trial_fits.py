"""Trial fits of hypotheses from a given estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import ActiveEffect, whole
from aerosid.effects.sudden import at_moment
from aerosid.estimation.contest import contest
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, Start
from aerosid.estimation.score_test import Score
from aerosid.search.backward_elimination import pruned
from aerosid.search.structure_search import UNLIKE_THEIR_SCORE, StructureSearch


def shortlisted(search: StructureSearch, scores: Sequence[Score]) -> list[Score]:
    """The hypotheses worth a fit: the best few whose score could pass, one a label, and the best of some kinds.

    The score of a large effect that is not linear, as of a rate limit, can rank below terms that only follow it.
    """
    settings = search.settings.trials
    able = [score for score in scores if _left(search, score) > search.critical**2]
    worth: dict[tuple[str, str, str], Score] = {}
    for score in able:
        # Of a sensor's place along one axis or two, which have one label, that which brings most for its price.
        known = worth.setdefault(score.hypothesis.label, score)
        if _left(search, score) > _left(search, known):
            worth[score.hypothesis.label] = score
    splines = [score for score in worth.values() if score.hypothesis.searched]
    ranked = [score for score in worth.values() if not score.hypothesis.searched]
    chosen = ranked[: search.settings.shortlist]
    # One spline follows another closely: the best stands for all, where it is about as good as a simpler term.
    chosen += [score for score in splines[:1] if not chosen or score.gain > settings.spline_share * chosen[0].gain]
    kinds = {score.hypothesis.kind for score in chosen}
    for score in ranked[search.settings.shortlist :]:
        kind = score.hypothesis.kind
        if kind not in kinds and kind in UNLIKE_THEIR_SCORE and score.gain > settings.unlike_share * ranked[0].gain:
            kinds.add(kind)
            chosen.append(score)
    return chosen


def _left(search: StructureSearch, score: Score) -> float:
    """What a score promises less the price of its numbers beyond the first."""
    return score.gain - search.settings.price * (score.hypothesis.parameters - 1)


def tried(
    search: StructureSearch,
    current: Refinement,
    scores: Sequence[Score],
    level: float | None = None,
    margin: float = 0.0,
    further: Sequence[Start] = (),
) -> list[Refinement]:
    """The estimate with one more hypothesis, for each of several, and from `further` starts.

    Those are not followed to the end that stay more than `margin` above the price `level`, or above the best.
    """
    starts = [*(start_with(search, current, score) for score in scores), *further]
    fares = [search.fare(start) - spare(search, start, current) for start in starts]
    fits = contest(starts, search.manoeuvres, TRIAL, fares, level, margin)
    search.keep(fits)
    return fits


def start_with(search: StructureSearch, current: Refinement, score: Score) -> Start:
    """Where the fit of one more hypothesis begins."""
    hypothesis = score.hypothesis
    start = score.start[len(hypothesis.entries) :]
    effects = hypothesis.at(start, score.trial).effects
    base = current.model
    if hypothesis.kind == "step_change":
        base = search.with_room(current).model
    if hypothesis.time is not None:
        effects = tuple(moving(search, active, hypothesis.time) for active in effects)
    effects = tuple(whole(active) for active in effects)
    base = with_columns_of(base, effects).extended(hypothesis.entries)
    point = None
    if not effects and current.held_to_data == 0.0 and search.linearised is not None:
        known, linearised = search.linearised
        if known is current:
            point = replace(linearised.with_terms(hypothesis.entries), values=np.array(base.values))
    return Start(
        base,
        (*current.free, *hypothesis.entries),
        (*current.effects, *effects),
        current.states,
        current.variance,
        point,
    )


def moving(search: StructureSearch, active: ActiveEffect, time: float) -> ActiveEffect:
    """A jump whose moment is estimated too, near `time` s."""
    manoeuvre = next(m for m in search.manoeuvres if m.name == active.log)
    interval = manoeuvre.interval
    return at_moment(active, time, active.log, interval)


def spare(search: StructureSearch, trial: Refinement | Start, current: Refinement) -> float:
    """What a trial may save: coefficients jump all at once at first, though one of them may be all that does."""
    new = len([a for a in trial.effects if a.effect.kind == "step_change"])
    new -= len([a for a in current.effects if a.effect.kind == "step_change"])
    return search.settings.price * 2 * max(new - 1, 0)


def lightened(
    search: StructureSearch, current: Refinement, trials: Sequence[Refinement], level: float
) -> list[Refinement]:
    """The trials, without their idle jumps those that could then cost less than `level`."""
    return [
        pruned(search, trial) if 0.0 < search.price(trial) - level < spare(search, trial, current) else trial
        for trial in trials
    ]
