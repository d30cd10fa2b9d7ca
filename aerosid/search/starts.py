"""Multi-start structure selection: plain, in gusts, with flow separation, among unmodelled forces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from aerosid.effects import StateEffect
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.search.disturbance_search import Searched, beside_disturbances, in_moving_air, is_gust, through_air
from aerosid.search.forward_selection import forward, settled
from aerosid.search.refutation import cannot_follow
from aerosid.search.replacement import exchange
from aerosid.search.separation_search import is_patchwork, with_separation
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class Searches:
    """What was searched.

    Attributes
    ----------
    plain : Searched
        Without disturbances; beside gusts where those leave nothing to be asked.
    reached : Searched
        The likeliest of all.
    gusty : Searched or None
        Beside gusts that the instruments show by kinematics alone.
    explained : bool
        Whether those gusts, with what was found beside them, leave nothing wrong and are more than forces of any shape.
    begun : tuple or None
        The first round of the plain search, where it was made: its estimate and its scores.
    air : Refinement or None
        A gust alone, where that says more than the first round found.
    """

    plain: Searched
    reached: Searched
    gusty: Searched | None = None
    explained: bool = False
    begun: tuple[Refinement, list[tuple[Score, ...]]] | None = None
    air: Refinement | None = None


class Asked(NamedTuple):
    """What the searches begin with: the declared structure as estimated, flights that are not fitted, moving air."""

    before: Refinement
    validation: tuple[Manoeuvre, ...]
    moving_air: bool


class SearchStart(NamedTuple):
    """A beginning for the same forward selection, backward elimination and replacement, and when it is called for."""

    begins: str
    is_called_for: Callable[[StructureSearch, Asked, Searches], bool]
    searched: Callable[[StructureSearch, Asked, Searches], Searches]


def searches(
    search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre], *, moving_air: bool
) -> Searches:
    """Every search that what is left calls for; `moving_air`: kinematics show gusts, and they are asked first."""
    asked, made = Asked(before, tuple(validation), moving_air), Searches(Searched(before), Searched(before))
    for start in STARTS:
        if start.is_called_for(search, asked, made):
            made = start.searched(search, asked, made)
    return made


def _air_is_unknown(search: StructureSearch, asked: Asked, made: Searches) -> bool:  # noqa: ARG001
    """Whether no kinematics judged the air, and something is left that gusts may say."""
    unknown = not search.settings.air_judged and bool(search.stepping) and search.settings.disturbances
    return unknown and search.is_doubtful(asked.before)


def _gust_or_one(search: StructureSearch, asked: Asked, made: Searches) -> Searches:
    """The first round of the plain search, and a gust alone where that says more."""
    begun = forward(search, asked.before, 1)
    air = in_moving_air(search, asked.before) if search.is_doubtful(begun[0]) else None
    if air is not None and search.price(air) > search.price(begun[0]):
        air = None
    return replace(made, begun=begun, air=air)


def _gusts_are_shown(search: StructureSearch, asked: Asked, made: Searches) -> bool:
    """Whether the instruments show gusts, or the flights do, and something is left that they may say."""
    shown = asked.moving_air and bool(search.stepping) and search.settings.disturbances
    return made.air is not None or (shown and search.is_doubtful(asked.before))


def _in_gusts(search: StructureSearch, asked: Asked, made: Searches) -> Searches:
    """The search beside a gust, with flow separation where something is left."""
    air = in_moving_air(search, asked.before) if made.air is None else made.air
    gusty = through_air(search, air, search.settings.gusts.beside_gusts)
    left = search.separating and (
        search.is_doubtful(gusty.estimate) or _fails_elsewhere(search, gusty.estimate, asked.validation)
    )
    if left:
        beside = settled(search, with_separation(search, gusty.estimate))
        if search.price(beside) < search.price(gusty.estimate):
            gusty = replace(gusty, estimate=beside, others=())
    if not search.is_doubtful(gusty.estimate) and is_gust(search, gusty.estimate):
        return Searches(gusty, gusty, gusty, explained=True)
    return replace(made, gusty=gusty)


def _gusts_leave_something(search: StructureSearch, asked: Asked, made: Searches) -> bool:  # noqa: ARG001
    """Whether gusts are not all that is missing."""
    return not made.explained


def _plain(search: StructureSearch, asked: Asked, made: Searches) -> Searches:
    """The search from the declared structure, with nothing beside it."""
    current, rounds = forward(search, asked.before) if made.begun is None else made.begun
    if made.begun is not None and current is not asked.before:
        current, further = forward(search, current, search.settings.rounds - len(rounds))
        rounds = [*rounds, *further]
    current, others = exchange(search, current)
    plain = Searched(current, others, tuple(rounds))
    return replace(made, plain=plain, reached=plain)


def _separation_may_say_it(search: StructureSearch, asked: Asked, made: Searches) -> bool:  # noqa: ARG001
    """Whether flow separation is to be asked: not where gusts came further, for it was asked beside them."""
    return not made.explained and not gusts_say_better(search, made.plain, made.gusty)


def _with_separation(search: StructureSearch, asked: Asked, made: Searches) -> Searches:
    """The search with flow separation in place of what looks like it."""
    plain = separated(search, made.plain, asked.validation)
    return replace(made, plain=plain, reached=plain)


def _something_is_left(search: StructureSearch, asked: Asked, made: Searches) -> bool:  # noqa: ARG001
    """Whether what was found leaves the model wrong."""
    return not made.explained and search.settings.disturbances and search.is_doubtful(made.plain.estimate)


def _among_disturbances(search: StructureSearch, asked: Asked, made: Searches) -> Searches:
    """The search among gusts or forces of any shape, where they say it better."""
    found, best = made.plain.estimate, made.plain
    # What was found so far may be the disturbance's work, or be real beside it.
    held_still = not search.parts(found, None) or any(isinstance(a.effect, StateEffect) for a in found.effects)
    held_still |= gusts_say_better(search, made.plain, made.gusty)
    disturbed = [beside_disturbances(search, asked.before, made.gusty)]
    if not held_still:
        disturbed.append(beside_disturbances(search, found))
    for each in disturbed:
        if search.price(each.estimate) < search.price(best.estimate):
            best = each
    return replace(made, reached=best)


STARTS = (
    SearchStart("a gust against the first thing that could enter", _air_is_unknown, _gust_or_one),
    SearchStart("in gusts that are shown", _gusts_are_shown, _in_gusts),
    SearchStart("plain", _gusts_leave_something, _plain),
    SearchStart("with flow separation", _separation_may_say_it, _with_separation),
    SearchStart("among gusts or forces of any shape", _something_is_left, _among_disturbances),
)
"""The beginnings of the search, in this order; the likeliest for its price is judged by `gates.GATES`."""


def separated(search: StructureSearch, plain: Searched, validation: Sequence[Manoeuvre]) -> Searched:
    """The search with flow separation where something is left and that says it better."""
    current = plain.estimate
    if not search.separating:
        return plain
    if is_patchwork(search, current) or search.is_doubtful(current) or _fails_elsewhere(search, current, validation):
        beside = with_separation(search, current)
        if search.price(beside) < search.price(current):
            return replace(plain, estimate=beside, others=())
    return plain


def gusts_say_better(search: StructureSearch, plain: Searched, gusty: Searched | None) -> bool:
    """Whether the search beside gusts came further: flow separation was then asked beside them alone."""
    return gusty is not None and search.price(gusty.estimate) < search.price(plain.estimate)


def _fails_elsewhere(search: StructureSearch, current: Refinement, validation: Sequence[Manoeuvre]) -> bool:
    """Whether what was found cannot follow another flight: what separates there may look like a term here."""
    return bool(search.parts(current, None)) and any(cannot_follow(current, other) for other in validation)
