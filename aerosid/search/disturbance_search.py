"""Structure search beside gusts or unmodelled forces."""

from __future__ import annotations

from dataclasses import dataclass, replace

from aerosid.effects import ActiveEffect, NoiseEffect
from aerosid.effects.disturbance import gusts_of, unmodelled_forces
from aerosid.estimation.contest import refined_on
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import BACKGROUND
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.search.backward_elimination import pruned
from aerosid.search.findings import Finding
from aerosid.search.forward_selection import forward
from aerosid.search.replacement import exchange
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class Searched:
    """Where a search ended: the estimate, what could stand in place of its parts, the scores of each round.

    `begun`: the disturbance alone, beside which it was made.
    """

    estimate: Refinement
    others: tuple[Finding, ...] = ()
    rounds: tuple[tuple[Score, ...], ...] = ()
    begun: Refinement | None = None


def beside_disturbances(search: StructureSearch, start: Refinement, gusty: Searched | None = None) -> Searched:
    """The search against a background of disturbances: a gust, or forces of any shape.

    Against it a term must bring more than what any force could: deviations and likelihoods then mean what they say
    although the model is still wrong somewhere. A gust is named only where it explains more than forces of any
    shape do, which follow whatever the model lacks and explain nothing. `gusty`: the search beside a gust, where
    that is known.
    """
    air = gusty.begun if gusty is not None else None
    air = in_moving_air(search, start) if air is None else air
    forced = in_forces(search, start) if search.stepping else None
    margin = search.critical**2
    # Both with nothing beside them yet: what was found beside one would win against the other alone.
    if forced is None or search.price(forced) > search.price(air) + margin:
        return through_air(search, air) if gusty is None else gusty
    found = through_air(search, forced)
    if gusty is not None and search.price(gusty.estimate) < search.price(found.estimate) - margin:
        return gusty
    return found


def in_moving_air(search: StructureSearch, start: Refinement) -> Refinement:
    """The estimate with a gust beside it: of those that its axes can meet, the likeliest for its price.

    Air that moves along two axes is asked where it shows along each.
    """
    effects = gusts_of(start.model.axes)
    along_one = [_met(search, start, effect) for effect in effects if len(effect.columns) == 1]
    met = list(along_one)
    shown = search.price(start) - search.critical**2
    if len(along_one) > 1 and all(search.price(each) < shown for each in along_one):
        (length,) = (each.effects[-1].values[-1] for each in [min(along_one, key=search.price)])
        spreads = [each.effects[-1].values[0] for each in along_one]
        for effect in effects:
            if len(effect.columns) == len(along_one):
                numbers = zip(effect.parameters, (*spreads, length), strict=True)
                near = tuple(replace(parameter, trials=(value,)) for parameter, value in numbers)
                met.append(_met(search, start, replace(effect, parameters=near)))
    return min(met, key=search.price)


def _met(search: StructureSearch, start: Refinement, effect: NoiseEffect) -> Refinement:
    """The estimate in air that moves in one way."""
    room = search.with_room(start)
    quiet = ActiveEffect(effect, tuple(parameter.trials[0] for parameter in effect.parameters))
    return with_noise(search, replace(room, model=with_columns_of(room.model, [quiet])), effect)


def in_forces(search: StructureSearch, start: Refinement) -> Refinement:
    """The estimate with forces of any shape, in place of a gust that it may hold."""
    effects = tuple(active for active in start.effects if not isinstance(active.effect, NoiseEffect))
    return with_noise(search, search.with_room(replace(start, effects=effects)), unmodelled_forces(search.stepping))


def is_gust(search: StructureSearch, current: Refinement) -> bool:
    """Whether a gust explains more than forces of any shape do, which follow whatever the model lacks."""
    return search.price(current) < search.price(in_forces(search, current)) - search.critical**2


def through_air(search: StructureSearch, start: Refinement, most: int | None = None) -> Searched:
    """The search beside a disturbance; `most`: how many may enter."""
    current, rounds = forward(search, pruned(search, start), most)
    current, others = exchange(search, current)
    return Searched(current, others, tuple(rounds), start)


def with_noise(search: StructureSearch, start: Refinement, effect: NoiseEffect) -> Refinement:
    """The estimate with a disturbance, from the most likely of its trial values."""
    quiet, rest = replace(start, variance=search.noise_level(start)), [p.trials[0] for p in effect.parameters[1:]]
    begins = [(*start.effects, ActiveEffect(effect, (first, *rest))) for first in effect.parameters[0].trials]
    trials = refined_on(quiet, search.manoeuvres, BACKGROUND, begins)
    return min(trials, key=lambda trial: trial.cost)
