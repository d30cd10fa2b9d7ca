"""Restarts from the declared values where the re-estimated model leaves a gross residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.competing_fits import evaluated_starts, fit_competing_structures
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, Start
from aerosid.estimation.score_test import Score
from aerosid.search.noise_filtering import NOISE_AVERAGING_KINDS
from aerosid.search.shortlist_fits import ShortlistFit
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import start_with_hypothesis


def restarts_from_declared_values(
    search: StructureSearch, current: Refinement, fits: Sequence[ShortlistFit], level: float
) -> list[Start]:
    """Starts from the declared values, where the residual is gross; `level`: the penalised cost reached already.

    The re-estimated derivatives then compensate a large missing effect: a local minimum of the cost, at which scores
    mislead. So every noise-averaging kind (lag, time delay, rate limit) is tried too, whatever its score. `fits`: what
    is tried again; a term's restart is given up where it leads back to the fit.
    """
    # With gusts and unmodelled forces no gross residual remains.
    if search.declared_values is None or not search.has_gross_residual(current) or current.is_disturbed:
        return []
    declared = {
        entry: search.declared_values.value(entry)
        for entry in search.declared.free
        if entry in search.declared_values.entries
    }
    values = current.model.values.copy()
    for entry, value in declared.items():
        values[current.model.index(entry)] = value
    at_declared_values = replace(current, model=current.model.with_values(values))
    candidates = [each for each in fits if each.score.hypothesis.kind not in NOISE_AVERAGING_KINDS]
    noise_averaging = [h for h in search.candidate_hypotheses(current) if h.kind in NOISE_AVERAGING_KINDS]
    starts = profile_starts(search, at_declared_values, noise_averaging, level)
    for candidate, fit in candidates:
        hypothesis, trial = candidate.hypothesis, candidate.trial
        effects = tuple(
            replace(a, values=tuple(p.trials[min(trial, len(p.trials) - 1)] for p in a.effect.parameters))
            for a in hypothesis.effects
        )
        score = Score(replace(hypothesis, effects=effects), 0.0, (0.0,) * hypothesis.parameters, 0.0, trial)
        known = fit if fit.converged and not fit.effects else None
        starts.append(replace(start_with_hypothesis(search, at_declared_values, score), states=None, known=known))
    return starts


def restart_candidates(
    search: StructureSearch, current: Refinement, fits: Sequence[ShortlistFit], level: float
) -> list[ShortlistFit]:
    """The fits that may improve from the declared values; `level`: the best penalised cost of all.

    The response is linear in a term's coefficient, so that the start hardly changes the final fit: a term whose trial
    stayed far behind the best is not tried again.
    """
    tolerated = search.settings.trials.restart_share * (search.penalised_cost(current) - level)
    return [
        each for each in fits if each.score.hypothesis.effects or search.penalised_cost(each.fit) <= level + tolerated
    ]


def profile_starts(
    search: StructureSearch, at_declared_values: Refinement, hypotheses: Sequence[Hypothesis], level: float
) -> list[Start]:
    """Starts of the fits of control effects from the maximum of the profile likelihood over a grid of values.

    A surface that lags far behind its record is at times on the wrong side of every step, and the likelihood has its
    maximum there only if the fit starts from a limit or a lag near the true one. At each value the linearisation at the
    common start predicts the likelihood; the best few by that prediction are fitted. A value with which the declared
    derivatives cannot be simulated is left out.
    """
    settings = search.settings.trials
    starts, trial_effects = [], []
    for hypothesis in hypotheses:
        (active,) = hypothesis.effects
        parameter = active.effect.parameters[0]
        positive = [trial for trial in parameter.trials if trial > 0.0]
        last = min(settings.profile_reach * max(positive), 0.99 * parameter.highest)
        for value in np.geomspace(min(positive), last, settings.profile):
            trial_effect = replace(active, values=(float(value),))
            effects = (*at_declared_values.effects, frozen(trial_effect))
            model = with_columns_of(at_declared_values.model, effects)
            starts.append(Start(model, at_declared_values.free, effects, None, at_declared_values.variance))
            trial_effects.append(trial_effect)
    if not starts:
        return []
    owned = {
        h.key: [n for n, trial_effect in enumerate(trial_effects) if trial_effect.name == (h.kind, h.where)]
        for h in hypotheses
    }
    evaluated = evaluated_starts(starts, search.manoeuvres)
    most_promising = {
        key: sorted(
            (n for n in own if evaluated[n].predicted_cost < np.inf), key=lambda n: (evaluated[n].predicted_cost, n)
        )[: settings.profile_followed]
        for key, own in owned.items()
    }
    followed = sorted(n for own in most_promising.values() for n in own)
    chosen = [evaluated[n].start for n in followed]
    final_fits = fit_competing_structures(
        chosen, search.manoeuvres, TRIAL, [search.penalty(start) for start in chosen], level, near=False
    )
    fits = dict(zip(followed, final_fits, strict=True))
    found = []
    for own in filter(None, most_promising.values()):
        n = min(sorted(own), key=lambda place: fits[place].cost)
        effects = (*at_declared_values.effects, trial_effects[n])
        found.append(Start(fits[n].model, at_declared_values.free, effects, fits[n].states, fits[n].variance))
    return found
