"""Structure search in the presence of gusts or unmodelled forces."""

from __future__ import annotations

from dataclasses import dataclass, replace

from aerosid.effects import ActiveEffect, NoiseEffect, at_first_trials
from aerosid.effects.disturbance import gusts_of, unmodelled_forces
from aerosid.estimation.competing_fits import refine_from_effect_values
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import BACKGROUND, RefinementSettings
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.findings import Finding
from aerosid.search.forward_selection import forward_selection
from aerosid.search.replacement import replace_parts
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class SearchResult:
    """Result of a search: the estimate, the alternatives to its parts, the scores of each round.

    `disturbance_alone`: the estimate with the disturbance only, from which the search started.
    """

    estimate: Refinement
    alternatives: tuple[Finding, ...] = ()
    rounds: tuple[tuple[Score, ...], ...] = ()
    disturbance_alone: Refinement | None = None


def search_with_gust_or_forces(
    search: StructureSearch, start: Refinement, in_gusts: SearchResult | None = None
) -> SearchResult:
    """The search in the presence of a disturbance: a gust, or unmodelled forces.

    A term must then gain more than a random force could, so that standard deviations and likelihoods are valid although
    the model is still wrong somewhere. A gust is named only where it gains more than unmodelled forces, which follow
    any model error and explain none. `in_gusts`: the search with a gust, where it was made already.
    """
    air = in_gusts.disturbance_alone if in_gusts is not None else None
    air = with_likeliest_gust(search, start) if air is None else air
    forced = with_unmodelled_forces(search, start) if search.step_coefficients else None
    margin = search.critical**2
    # Both without further parts: those found with one of them would decide against the other.
    if forced is None or search.penalised_cost(forced) > search.penalised_cost(air) + margin:
        return search_with_disturbance(search, air) if in_gusts is None else in_gusts
    found = search_with_disturbance(search, forced)
    if (
        in_gusts is not None
        and search.penalised_cost(in_gusts.estimate) < search.penalised_cost(found.estimate) - margin
    ):
        return in_gusts
    return found


def with_likeliest_gust(search: StructureSearch, start: Refinement) -> Refinement:
    """The estimate with the gust of least penalised cost among those along its axes.

    A gust along two axes is tried where it is significant along each.
    """
    effects = gusts_of(start.model.axes)
    along_one = [_with_gust(search, start, effect) for effect in effects if len(effect.columns) == 1]
    with_gusts = list(along_one)
    shown = search.penalised_cost(start) - search.critical**2
    if len(along_one) > 1 and all(search.penalised_cost(each) < shown for each in along_one):
        (length,) = (each.effects[-1].values[-1] for each in [min(along_one, key=search.penalised_cost)])
        sizes = [each.effects[-1].values[0] for each in along_one]
        for effect in effects:
            if len(effect.columns) == len(along_one):
                numbers = zip(effect.parameters, (*sizes, length), strict=True)
                near = tuple(replace(parameter, trials=(value,)) for parameter, value in numbers)
                with_gusts.append(_with_gust(search, start, replace(effect, parameters=near)))
    return min(with_gusts, key=search.penalised_cost)


def _with_gust(search: StructureSearch, start: Refinement, effect: NoiseEffect) -> Refinement:
    """The estimate with one kind of gust."""
    extended = search.with_step_columns(start)
    initial = at_first_trials(effect)
    return with_disturbance(search, replace(extended, model=with_columns_of(extended.model, [initial])), effect)


def with_unmodelled_forces(search: StructureSearch, start: Refinement) -> Refinement:
    """The estimate with unmodelled forces, in place of a gust that it may hold."""
    effects = tuple(active for active in start.effects if not isinstance(active.effect, NoiseEffect))
    return with_disturbance(
        search, search.with_step_columns(replace(start, effects=effects)), unmodelled_forces(search.step_coefficients)
    )


def is_gust_preferred(search: StructureSearch, current: Refinement) -> bool:
    """Whether a gust gains more than unmodelled forces, which follow any model error."""
    return (
        search.penalised_cost(current)
        < search.penalised_cost(with_unmodelled_forces(search, current)) - search.critical**2
    )


def search_with_disturbance(search: StructureSearch, start: Refinement, max_entries: int | None = None) -> SearchResult:
    """The search in the presence of a disturbance; `max_entries`: largest number of hypotheses that may enter."""
    current, rounds = forward_selection(search, eliminate_insignificant(search, start), max_entries)
    current, alternatives = replace_parts(search, current)
    return SearchResult(current, alternatives, tuple(rounds), start)


def with_disturbance(
    search: StructureSearch, start: Refinement, effect: NoiseEffect, settings: RefinementSettings = BACKGROUND
) -> Refinement:
    """The estimate with a disturbance, started from each of its trial values; the most likely one."""
    initial, rest = replace(start, variance=search.noise_variances(start)), [p.trials[0] for p in effect.parameters[1:]]
    starting_effects = [(*start.effects, ActiveEffect(effect, (first, *rest))) for first in effect.parameters[0].trials]
    trials = refine_from_effect_values(initial, search.manoeuvres, settings, starting_effects)
    return min(trials, key=lambda trial: trial.cost)
