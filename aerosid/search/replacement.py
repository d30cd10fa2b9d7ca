"""Replacement of selected parts by rival hypotheses, and the list of alternatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from aerosid.effects import KINDS, InputEffect, OutputEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sudden import is_sudden
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.search.backward_elimination import eliminate_insignificant, variance_inflation
from aerosid.search.finding_evidence import finding_from_part
from aerosid.search.findings import Finding, Part, named
from aerosid.search.noise_filtering import explains_beyond_noise_averaging
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import shortlisted, start_with_hypothesis, trial_fits, without_idle_step_changes

LARGEST_RARITY_PENALTY = max(kind.rarity for kind in KINDS.values())
"""What a rival may lose by its rareness alone and still be listed."""


def replace_parts(
    search: StructureSearch, current: Refinement, *, alike: bool = False
) -> tuple[Refinement, tuple[Finding, ...]]:
    """Try others in the place of each found part: take a better one, list those within reach.

    `alike`: none of those that bring much the same beside it, nor a sudden change, which follows whatever is left.
    """
    listed: list[Finding] = []
    replaced: set[tuple[str, str, str]] = set()
    for _ in range(2 * search.settings.rounds):
        groups = [group for group in search.groups(current) if group[0].label not in replaced]
        if not groups:
            break
        group = groups[0]
        replaced.add(group[0].label)
        # Before the trials, whose own deviations take the place of the estimate's among those that are kept.
        cost = partial(
            search.penalised_cost, inflation=inflation_of_labels(search, current, {part.label for part in group})
        )
        reduced, trials = replacement_fits(search, current, group, alike=alike)
        if alike:
            step_changes = sum(map(is_sudden, current.effects))
            trials = [trial for trial in trials if sum(map(is_sudden, trial.effects)) <= step_changes]
            best = _best_replacement(search, trials, current, reduced, cost)
        else:
            best = min(trials, key=cost, default=None)
            if best is not None and not (cost(best) < cost(current) and needs_all_parts(search, best, reduced)):
                best = None
        if best is not None:
            trials = [*(trial for trial in trials if trial is not best), current]
            current = best
            entered = {part.label for part in search.parts(best, None)} - {p.label for p in search.parts(reduced, None)}
            replaced |= entered
            listed = [other for other in listed if other.instead_of != named(group[0].label)]
        listed.extend(indistinguishable_fits(search, current, reduced, trials))
    return current, tuple(listed)


def _best_replacement(
    search: StructureSearch,
    trials: Sequence[Refinement],
    current: Refinement,
    reduced: Refinement,
    cost: Callable[[Refinement], float],
) -> Refinement | None:
    """The first trial, in the order of their worth, that is better than the estimate without its own idle parts too.

    A fault of an instrument or a control gives place to another such fault alone: a term has to show itself.
    """
    base = {part.label for part in search.parts(reduced, None)}
    own = [part for part in search.parts(current, None) if part.label not in base]
    for trial in sorted(trials, key=cost):
        if cost(trial) >= cost(current):
            break
        reduced_trial = eliminate_insignificant(search, trial)
        entered = [part for part in search.parts(reduced_trial, None) if part.label not in base]
        if any(part.entry is not None for part in entered) and all(part.entry is None for part in own):
            continue
        if (
            entered
            and cost(reduced_trial) < cost(current)
            and explains_beyond_noise_averaging(search, reduced_trial, reduced)
        ):
            return reduced_trial
    return None


def alternatives_to_parts(search: StructureSearch, current: Refinement) -> tuple[Finding, ...]:
    """What could stand in the place of each found part, the estimate kept as it is."""
    found: list[Finding] = []
    for group in search.groups(current):
        found.extend(indistinguishable_fits(search, current, *replacement_fits(search, current, group, alike=True)))
    return tuple(found)


def replacement_fits(
    search: StructureSearch, current: Refinement, group: Sequence[Part], *, alike: bool = False
) -> tuple[Refinement, list[Refinement]]:
    """The estimate without a group of parts, and with each rival that could take its place.

    `alike`: none of those that bring much the same beside the group as in its place, which are about another thing.
    """
    margin = indifference_margin(search, current, {part.label for part in group})
    if not has_competitors(search, current, group, margin):
        return current, []
    # All that is asked of the present estimate first: the fits beside the reduced one begin at its linearisation.
    collinear = {score.hypothesis.label: score for score in collinear_candidates(search, current, group)}
    in_addition = {score.hypothesis.key: score.gain for score in search.scores(current)} if alike else {}
    reduced = search.re_estimated_without(current, group)
    scores = search.scores(reduced)
    competitors = {score.hypothesis.label: score for score in competing_candidates(search, scores, group)}
    if alike:
        in_replacement = {score.hypothesis.key: score.gain for score in scores}
        competitors = {
            label: score
            for label, score in competitors.items()
            if in_addition.get(score.hypothesis.key, 0.0)
            < search.settings.replacement.otherwise_good * in_replacement.get(score.hypothesis.key, np.inf)
        }
    # What does the same to the motion is found from where that motion is, not from the fit without it.
    without_group = search.reduced_structure(current, group)
    further = [
        start_with_hypothesis(search, without_group, score)
        for score in (*collinear.values(), *simultaneous_step_changes(search, group))
    ]
    margin += LARGEST_RARITY_PENALTY
    rest = [score for label, score in competitors.items() if label not in collinear]
    trials = trial_fits(search, reduced, rest, search.penalised_cost(current), margin, further)
    return reduced, without_idle_step_changes(search, reduced, trials, search.penalised_cost(current) + margin)


def needs_all_parts(search: StructureSearch, trial: Refinement, reduced: Refinement) -> bool:
    """Whether an estimate needs all its parts, none of them a filter alone."""
    return eliminate_insignificant(search, trial) is trial and explains_beyond_noise_averaging(search, trial, reduced)


def has_competitors(search: StructureSearch, current: Refinement, group: Sequence[Part], margin: float) -> bool:
    """Whether anything could win back nearly all that striking out a group costs.

    Terms are judged without a fit; an effect that is far from linear in its number is always worth one.
    """
    entries = [part.entry for part in group if part.entry is not None]
    if len(entries) < len(group):
        return True
    loss, scores = search.linearised_with_candidates(current).in_place_of(entries)
    # A spline follows any curve closely; it counts where it does so to the last.
    limits = search.settings.replacement
    close = limits.surely_apart * margin
    near = close, limits.nearly_all * loss + close
    return any(loss - score.gain < near[score.hypothesis.searched == 0] for score in scores)


def collinear_candidates(search: StructureSearch, current: Refinement, group: Sequence[Part]) -> list[Score]:
    """Hypotheses that do about the same to the motion as a group of parts: so the rivals of a large effect show.

    Where a large effect was struck out, the fit without it has moved so far that scores rank what follows the rest
    of the misfit, not what could take its place.
    """
    effects = [part.active for part in group if part.active is not None]
    if not effects or any(not isinstance(active.effect, OutputEffect | InputEffect) for active in effects):
        return []
    entries = [part.entry for part in group if part.entry is not None]
    loss, scores = search.linearised_with_candidates(current).in_place_of(entries, effects)
    return shortlisted(
        search, [score for score in scores if score.gain > search.settings.replacement.stand_in_share * loss]
    )


def competing_candidates(search: StructureSearch, scores: Sequence[Score], group: Sequence[Part]) -> list[Score]:
    """Hypotheses whose score, of those where a group was struck out, is not far below the group's own."""
    labels = {part.label for part in group}

    def is_own(hypothesis: Hypothesis) -> bool:
        alike = group[0].time and hypothesis.time and hypothesis.kind == group[0].label[0]
        return hypothesis.label in labels or bool(alike)

    own = [s.gain for s in scores if is_own(s.hypothesis)]
    others = [s for s in scores if not is_own(s.hypothesis)]
    least = search.settings.replacement.rival_share * max(own, default=0.0)
    return shortlisted(search, [score for score in others if score.gain > least])


def simultaneous_step_changes(search: StructureSearch, group: Sequence[Part]) -> list[Score]:
    """Other kinds of sudden change at the moment of one that was found.

    Where a jump was struck out the fit has moved so far that scores no longer show its moment.
    """
    time, found = group[0].time, group[0].active
    if time is None or found is None:
        return []
    nearest = {
        hypothesis.kind: replace(hypothesis, time=time)
        for hypothesis in search.hypotheses
        if hypothesis.time is not None
        and hypothesis.kind not in (group[0].label[0], "step_change")
        and hypothesis.effects[0].log == found.log
    }
    return [Score(each, 0.0, (0.0,) * each.parameters, 0.0) for each in nearest.values()]


def indistinguishable_fits(
    search: StructureSearch, current: Refinement, reduced: Refinement, trials: Sequence[Refinement]
) -> list[Finding]:
    """Those trials that the data hardly tell from the chosen estimate."""
    base = {part.label for part in search.parts(reduced, None)}
    chosen = [part.label for part in search.parts(current, None) if part.label not in base]
    if not chosen:
        return []
    margin = indifference_margin(search, current, set(chosen))
    base.update(chosen)
    found: list[Finding] = []
    for trial in trials:
        # What is rarer loses a tie, and is as much within reach as before.
        loss = (
            search.penalised_cost(trial)
            - search.rarity_penalty(trial)
            - search.penalised_cost(current)
            + search.rarity_penalty(current)
        )
        if loss < margin:
            uncertainty = search.quick_deviations(trial)
            least = search.settings.replacement.listed
            others = [
                part for part in search.parts(trial, uncertainty) if part.label not in base and part.ratio > least
            ]
            place = named(chosen[0])
            found.extend(
                replace(finding_from_part(search, part, -loss, place), fit=trial, worse_by=loss, margin=margin)
                for part in others
            )
    return found


def indifference_margin(search: StructureSearch, current: Refinement, labels: set[tuple[str, str, str]]) -> float:
    """Difference in price that decides nothing: wider where coloured residuals widen these parts' variance."""
    return search.settings.reach * inflation_of_labels(search, current, labels)


def inflation_of_labels(search: StructureSearch, current: Refinement, labels: set[tuple[str, str, str]]) -> float:
    """By how much coloured residuals widen the variance of some parts, at least 1."""
    return variance_inflation(search, current, search.quick_deviations(current), labels)
