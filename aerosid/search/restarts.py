"""Restarts from the declared values where the re-estimated model leaves a gross residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.contest import begun, contest
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, Start
from aerosid.estimation.score_test import Score
from aerosid.search.command_filters import FILTERS
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import start_with


def afresh(search: StructureSearch, current: Refinement, shortlist: Sequence[Score], level: float) -> list[Start]:
    """Starts from the declared numbers, where what is missing is gross; `level`: a price that is reached already.

    The re-estimated ones then imitate it: from there the way to the truth may lead uphill, and scores mislead. So
    all that is far from linear is asked too, whatever its score.
    """
    # Gusts and forces of any shape leave no gross residual to be led astray by.
    if search.given is None or not search.is_gross(current) or current.is_disturbed:
        return []
    numbers = {entry: search.given.value(entry) for entry in search.declared.free if entry in search.given.entries}
    values = current.model.values.copy()
    for entry, value in numbers.items():
        values[current.model.index(entry)] = value
    untouched = replace(current, model=current.model.with_values(values))
    asked = [(s.hypothesis, s.trial) for s in shortlist if s.hypothesis.kind not in FILTERS]
    filters = [h for h in search.open_hypotheses(current) if h.kind in FILTERS]
    starts = profiled(search, untouched, filters, level)
    for hypothesis, trial in asked:
        effects = tuple(
            replace(a, values=tuple(p.trials[min(trial, len(p.trials) - 1)] for p in a.effect.parameters))
            for a in hypothesis.effects
        )
        score = Score(replace(hypothesis, effects=effects), 0.0, (0.0,) * hypothesis.parameters, 0.0, trial)
        starts.append(replace(start_with(search, untouched, score), states=None))
    return starts


def worth_restarting(
    search: StructureSearch, current: Refinement, shortlist: Sequence[Score], trials: Sequence[Refinement], level: float
) -> list[Score]:
    """The hypotheses that may come to more from the declared numbers than their own trial did, at the price `level`.

    A term is linear in its number, and where it begins moves little of where it ends: one whose trial stayed far behind
    the best is not asked again. `trials`: those of the shortlist, in its order.
    """
    behind = search.settings.trials.restart_share * (search.price(current) - level)
    return [
        score
        for score, trial in zip(shortlist, trials, strict=True)
        if score.hypothesis.effects or search.price(trial) <= level + behind
    ]


def profiled(
    search: StructureSearch, untouched: Refinement, hypotheses: Sequence[Hypothesis], level: float
) -> list[Start]:
    """Where the fit of each effect of a control begins: the likeliest of many values, all else estimated at each.

    A surface that is far behind its record is at times on the wrong side of every step, and only from a limit or a
    lag near the true one does the likelihood lead there. At each value the linearisation at the numbers that all begin
    with says how likely it will be; the most promising few are followed.
    """
    settings = search.settings.trials
    starts, owners = [], []
    for hypothesis in hypotheses:
        (active,) = hypothesis.effects
        parameter = active.effect.parameters[0]
        late = [trial for trial in parameter.trials if trial > 0.0]
        last = min(settings.profile_reach * max(late), 0.99 * parameter.highest)
        for value in np.geomspace(min(late), last, settings.profile):
            tried = replace(active, values=(float(value),))
            effects = (*untouched.effects, frozen(tried))
            model = with_columns_of(untouched.model, effects)
            starts.append(Start(model, untouched.free, effects, None, untouched.variance))
            owners.append(tried)
    if not starts:
        return []
    begins = begun(starts, search.manoeuvres, TRIAL)
    owned = {h.key: [n for n, tried in enumerate(owners) if tried.name == (h.kind, h.where)] for h in hypotheses}
    promising = {
        key: sorted((n for n in own if begins[n].promised < np.inf), key=lambda n: (begins[n].promised, n))[
            : settings.profile_followed
        ]
        for key, own in owned.items()
    }
    followed = sorted(n for own in promising.values() for n in own)
    chosen = [begins[n].start for n in followed]
    ends = contest(chosen, search.manoeuvres, TRIAL, [search.fare(start) for start in chosen], level, near=False)
    fits = dict(zip(followed, ends, strict=True))
    found = []
    for own in filter(None, promising.values()):
        n = min(sorted(own), key=lambda place: fits[place].cost)
        effects = (*untouched.effects, owners[n])
        found.append(Start(fits[n].model, untouched.free, effects, fits[n].states, fits[n].variance))
    return found
