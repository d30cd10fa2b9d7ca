"""Replacement of selected parts by competing hypotheses, and the list of indistinguishable alternatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from aerosid.effects import KINDS, InputEffect, OutputEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_input import is_step_change
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.search.accelerometer_unit import with_unit_if_likelier
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.finding_evidence import finding_from_part
from aerosid.search.findings import Finding, Part, named
from aerosid.search.linearised_exchange import indifference_margin, inflation_of_labels, possible_replacements
from aerosid.search.noise_filtering import explains_beyond_noise_averaging
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import shortlisted, start_with_hypothesis, trial_fits, without_idle_step_changes

LARGEST_RARITY_PENALTY = max(kind.rarity for kind in KINDS.values())
"""Difference in penalised cost by rarity alone that leaves an alternative in the list."""


def replace_parts(
    search: StructureSearch, current: Refinement, *, exclusive: bool = False
) -> tuple[Refinement, tuple[Finding, ...]]:
    """Replace each part by a better hypothesis where there is one, and list the indistinguishable alternatives.

    `exclusive`: without hypotheses that gain about as much in addition to the part, and without further step changes,
    which follow any remaining residual.
    """
    current = with_unit_if_likelier(search, current)
    listed: list[Finding] = []
    replaced: set[tuple[str, str, str]] = set()
    for _ in range(2 * search.settings.rounds):
        groups = [group for group in search.groups(current) if group[0].label not in replaced]
        if not groups:
            break
        group = groups[0]
        replaced.add(group[0].label)
        # Before the trials, since only the last estimate's standard deviations are stored.
        cost = partial(
            search.penalised_cost, inflation=inflation_of_labels(search, current, {part.label for part in group})
        )
        reduced, trials = replacement_fits(search, current, group, exclusive=exclusive)
        if exclusive:
            step_changes = sum(map(is_step_change, current.effects))
            trials = [trial for trial in trials if sum(map(is_step_change, trial.effects)) <= step_changes]
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
        listed.extend(indistinguishable_findings(search, current, reduced, trials))
    return current, tuple(listed)


def _best_replacement(
    search: StructureSearch,
    trials: Sequence[Refinement],
    current: Refinement,
    reduced: Refinement,
    cost: Callable[[Refinement], float],
) -> Refinement | None:
    """The trial of least penalised cost that is better than the estimate even after backward elimination.

    An error of an instrument or a control is only replaced by another such error: a term must enter by itself.
    """
    base = {part.label for part in search.parts(reduced, None)}
    own = [part for part in search.parts(current, None) if part.label not in base]
    for trial in sorted(trials, key=cost):
        if cost(trial) >= cost(current):
            break
        reduced_trial = eliminate_insignificant(search, trial, reduced)
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
    """The indistinguishable alternatives to each found part, for an unchanged estimate."""
    found: list[Finding] = []
    for group in search.groups(current):
        found.extend(
            indistinguishable_findings(search, current, *replacement_fits(search, current, group, exclusive=True))
        )
    return tuple(found)


def replacement_fits(
    search: StructureSearch, current: Refinement, group: Sequence[Part], *, exclusive: bool = False
) -> tuple[Refinement, list[Refinement]]:
    """The estimate without a group of parts, and the fits with each competing hypothesis in its place.

    `exclusive`: without hypotheses that gain about as much in addition to the group as in its place: they explain
    another part of the residual.
    """
    margin = indifference_margin(search, current, {part.label for part in group})
    possible = possible_competitors(search, current, group, margin)
    if possible is not None and not possible:
        return current, []
    # Everything about the present estimate first: the fits from the reduced one start at its stored linearisation.
    collinear = {score.hypothesis.label: score for score in collinear_candidates(search, current, group)}
    gain_in_addition = {score.hypothesis.key: score.gain for score in search.scores(current)} if exclusive else {}
    reduced = search.re_estimated_without(current, group)
    scores = search.scores(reduced)
    competitors = {score.hypothesis.label: score for score in competing_candidates(search, scores, group)}
    if exclusive:
        gain_in_replacement = {score.hypothesis.key: score.gain for score in scores}
        competitors = {
            label: score
            for label, score in competitors.items()
            if gain_in_addition.get(score.hypothesis.key, 0.0)
            < search.settings.replacement.otherwise_good * gain_in_replacement.get(score.hypothesis.key, np.inf)
        }
    # Collinear hypotheses start from the present motion, not from that of the fit without the group.
    without_group = search.reduced_structure(current, group)
    further = [
        start_with_hypothesis(search, without_group, score)
        for score in (*collinear.values(), *simultaneous_step_changes(search, group))
    ]
    margin += LARGEST_RARITY_PENALTY
    rest = [
        score
        for label, score in competitors.items()
        if label not in collinear and (possible is None or score.hypothesis.effects or label in possible)
    ]
    trials = trial_fits(search, reduced, rest, search.penalised_cost(current), margin, further)
    return reduced, without_idle_step_changes(search, reduced, trials, search.penalised_cost(current) + margin)


def needs_all_parts(search: StructureSearch, trial: Refinement, reduced: Refinement) -> bool:
    """Whether all parts of an estimate are significant and none gains by averaging noise alone."""
    return eliminate_insignificant(search, trial, reduced) is trial and explains_beyond_noise_averaging(
        search, trial, reduced
    )


def possible_competitors(
    search: StructureSearch, current: Refinement, group: Sequence[Part], margin: float
) -> set[tuple[str, str, str]] | None:
    """The hypotheses that could recover nearly all of the loss by removing a group; None: all, with an effect in it.

    Terms are tested to second order, without a fit.
    """
    entries = [part.entry for part in group if part.entry is not None]
    if len(entries) < len(group):
        return None
    negligible_loss = search.settings.replacement.surely_apart * margin
    return {score.hypothesis.label for score in possible_replacements(search, current, entries, negligible_loss)}


def collinear_candidates(search: StructureSearch, current: Refinement, group: Sequence[Part]) -> list[Score]:
    """Hypotheses whose sensitivities are nearly collinear with those of a group of parts.

    The fit without a large effect is so far off that its scores rank hypotheses by the remaining misfit, not by how
    well they could replace the effect.
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
    """Hypotheses whose score without a group is not far below the group's own."""
    labels = {part.label for part in group}

    def is_own(hypothesis: Hypothesis) -> bool:
        is_same_step_change = group[0].time and hypothesis.time and hypothesis.kind == group[0].label[0]
        return hypothesis.label in labels or bool(is_same_step_change)

    own = [s.gain for s in scores if is_own(s.hypothesis)]
    others = [s for s in scores if not is_own(s.hypothesis)]
    least = search.settings.replacement.rival_share * max(own, default=0.0)
    return shortlisted(search, [score for score in others if score.gain > least])


def simultaneous_step_changes(search: StructureSearch, group: Sequence[Part]) -> list[Score]:
    """Other kinds of step change at the instant of one that was found.

    The fit without the step change is so far off that its scores no longer show the instant.
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


def indistinguishable_findings(
    search: StructureSearch, current: Refinement, reduced: Refinement, trials: Sequence[Refinement]
) -> list[Finding]:
    """Findings of those trials whose penalised cost is within the margin of indifference of the chosen estimate's."""
    base = {part.label for part in search.parts(reduced, None)}
    chosen = [part.label for part in search.parts(current, None) if part.label not in base]
    if not chosen:
        return []
    margin = indifference_margin(search, current, set(chosen))
    base.update(chosen)
    found: list[Finding] = []
    for trial in trials:
        # Rarity decides between equal fits, and makes an alternative no more distinguishable.
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
            replaced_part = named(chosen[0])
            found.extend(
                replace(finding_from_part(search, part, -loss, replaced_part), fit=trial, worse_by=loss, margin=margin)
                for part in others
            )
    return found
