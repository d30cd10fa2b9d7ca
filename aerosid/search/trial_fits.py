"""Trial fits of hypotheses from a given estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import with_all_parameters
from aerosid.estimation.competing_fits import fit_competing_structures
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, Start
from aerosid.estimation.score_test import Score
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.step_change_instants import with_free_instant
from aerosid.search.structure_search import NONLINEAR_KINDS, StructureSearch


def shortlisted(search: StructureSearch, scores: Sequence[Score]) -> list[Score]:
    """Shortlist for trial fits: the best few hypotheses of sufficient score, one per label, and the best of some kinds.

    The score of a large nonlinear effect, such as a rate limit, can rank below terms that only imitate it.
    """
    settings = search.settings.trials
    candidates = [score for score in scores if _net_gain(search, score) > search.critical**2]
    best_by_label: dict[tuple[str, str, str], Score] = {}
    for score in candidates:
        # A sensor position along one axis and along two have the same label: the one of larger net gain.
        known = best_by_label.setdefault(score.hypothesis.label, score)
        if _net_gain(search, score) > _net_gain(search, known):
            best_by_label[score.hypothesis.label] = score
    splines = [score for score in best_by_label.values() if score.hypothesis.searched_parameters]
    ranked = [score for score in best_by_label.values() if not score.hypothesis.searched_parameters]
    chosen = ranked[: search.settings.shortlist]
    # Splines are nearly collinear: the best represents all, where it is about as good as a simpler term.
    chosen += [score for score in splines[:1] if not chosen or score.gain > settings.spline_share * chosen[0].gain]
    kinds = {score.hypothesis.kind for score in chosen}
    for score in ranked[search.settings.shortlist :]:
        kind = score.hypothesis.kind
        if kind not in kinds and kind in NONLINEAR_KINDS and score.gain > settings.unlike_share * ranked[0].gain:
            kinds.add(kind)
            chosen.append(score)
    return chosen


def _net_gain(search: StructureSearch, score: Score) -> float:
    """Predicted gain of a score less the penalty of its parameters beyond the first."""
    return score.gain - search.settings.price * (score.hypothesis.parameters - 1)


def trial_fits(
    search: StructureSearch,
    current: Refinement,
    scores: Sequence[Score],
    level: float | None = None,
    margin: float = 0.0,
    further: Sequence[Start] = (),
) -> list[Refinement]:
    """The estimates with one more hypothesis, for each of several, and from `further` starts.

    A fit is abandoned where it will stay more than `margin` above the penalised cost `level`, or above the best.
    """
    starts = [*(start_with_hypothesis(search, current, score) for score in scores), *further]
    penalties = [search.penalty(start) - removable_penalty(search, start, current) for start in starts]
    fits = fit_competing_structures(starts, search.manoeuvres, TRIAL, penalties, level, margin)
    search.store_trials(fits)
    return fits


def start_with_hypothesis(search: StructureSearch, current: Refinement, score: Score) -> Start:
    """Start of the fit with one more hypothesis."""
    hypothesis = score.hypothesis
    start = score.start[len(hypothesis.entries) :]
    effects = hypothesis.at(start, score.trial).effects
    base = current.model
    if hypothesis.kind == "step_change":
        base = search.with_step_columns(current).model
    if hypothesis.time is not None:
        effects = tuple(with_free_instant(active, hypothesis.time, search.manoeuvres) for active in effects)
    effects = tuple(with_all_parameters(active) for active in effects)
    base = with_columns_of(base, effects).extended(hypothesis.entries)
    point = None
    if not effects and current.held_to_data == 0.0 and search.last_linearised is not None:
        known, linearised = search.last_linearised
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


def removable_penalty(search: StructureSearch, trial: Refinement | Start, current: Refinement) -> float:
    """Penalty that elimination may save: a step change enters in all coefficients, though only one may need it."""
    new = len([a for a in trial.effects if a.effect.kind == "step_change"])
    new -= len([a for a in current.effects if a.effect.kind == "step_change"])
    return search.settings.price * 2 * max(new - 1, 0)


def without_idle_step_changes(
    search: StructureSearch, current: Refinement, trials: Sequence[Refinement], level: float
) -> list[Refinement]:
    """The trials; those whose penalised cost could fall below `level`, without their insignificant step changes."""
    return [
        eliminate_insignificant(search, trial, current)
        if 0.0 < search.penalised_cost(trial) - level < removable_penalty(search, trial, current)
        else trial
        for trial in trials
    ]
