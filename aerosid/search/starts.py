"""Starts of the structure search: plain, in gusts, among unmodelled forces, with separation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from aerosid.effects import StateEffect
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.search.disturbance_search import Searched, beside_disturbances, in_moving_air, is_gust, through_air
from aerosid.search.forward_selection import forward, settled
from aerosid.search.refutation import cannot_follow
from aerosid.search.replacement import exchange
from aerosid.search.separation_search import is_patchwork, with_separation
from aerosid.search.structure_search import StructureSearch

BESIDE_GUSTS = 2
"""How many may enter beside gusts that kinematics show, before flow separation is asked and all else without them."""


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
    """

    plain: Searched
    reached: Searched
    gusty: Searched | None = None


def searches(
    search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre], *, moving_air: bool
) -> Searches:
    """Every search that what is left calls for; `moving_air`: kinematics show gusts, and they are asked first."""
    disturbances = search.settings.disturbances
    gusty = None
    if moving_air and search.stepping and disturbances and search.is_doubtful(before):
        gusty = _beside_gusts(search, before, validation)
        if _is_explained_by_gusts(search, gusty.estimate):
            return Searches(gusty, gusty, gusty)
    plain = _plainly(search, before, validation, gusty)
    reached = _against_disturbances(search, before, plain, gusty) if disturbances else plain
    return Searches(plain, reached, gusty)


def _beside_gusts(search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre]) -> Searched:
    """The search beside a gust, with flow separation where something is left."""
    gusty = through_air(search, in_moving_air(search, before), BESIDE_GUSTS)
    if not search.separating:
        return gusty
    if search.is_doubtful(gusty.estimate) or _fails_elsewhere(search, gusty.estimate, validation):
        separated = settled(search, with_separation(search, gusty.estimate))
        if search.price(separated) < search.price(gusty.estimate):
            gusty = replace(gusty, estimate=separated, others=())
    return gusty


def _is_explained_by_gusts(search: StructureSearch, gusty: Refinement) -> bool:
    """Whether a gust, with what was found beside it, leaves nothing wrong, and is more than forces of any shape."""
    return not search.is_doubtful(gusty) and is_gust(search, gusty)


def _plainly(
    search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre], gusty: Searched | None
) -> Searched:
    """The search without disturbances, and flow separation where something is left that gusts do not say better."""
    current, rounds = forward(search, before)
    current, others = exchange(search, current)
    plain = Searched(current, others, tuple(rounds))
    if gusts_say_better(search, plain, gusty):
        return plain
    return separated(search, plain, validation)


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


def _against_disturbances(
    search: StructureSearch, before: Refinement, plain: Searched, gusty: Searched | None
) -> Searched:
    """The search against gusts or forces of any shape where something is left and they say it better."""
    found = plain.estimate
    if not search.is_doubtful(found):
        return plain
    best = plain
    # What was found so far may be the disturbance's work, or be real beside it.
    held_still = found is before or any(isinstance(active.effect, StateEffect) for active in found.effects)
    held_still |= gusts_say_better(search, plain, gusty)
    for base in (before,) if held_still else (before, found):
        disturbed = beside_disturbances(search, base, gusty if base is before else None)
        if search.price(disturbed.estimate) < search.price(best.estimate):
            best = disturbed
    return best
