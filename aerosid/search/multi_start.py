"""Multi-start structure selection: plain, in gusts, with flow separation, among unmodelled forces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from aerosid.effects import StateEffect
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.search.cross_validation import is_inadequate_on
from aerosid.search.disturbance_search import (
    SearchResult,
    is_gust_preferred,
    search_with_disturbance,
    search_with_disturbances,
    with_likeliest_gust,
)
from aerosid.search.forward_selection import forward_selection, with_disturbance_statistics
from aerosid.search.replacement import replace_parts
from aerosid.search.separation_search import may_imitate_separation, search_with_separation
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class MultiStartResult:
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

    plain: SearchResult
    best: SearchResult
    in_gusts: SearchResult | None = None
    explained: bool = False
    first_round: tuple[Refinement, list[tuple[Score, ...]]] | None = None
    air: Refinement | None = None


class SearchProblem(NamedTuple):
    """What the searches begin with: the declared structure as estimated, flights that are not fitted, moving air."""

    before: Refinement
    validation: tuple[Manoeuvre, ...]
    moving_air: bool


class SearchStart(NamedTuple):
    """A beginning for the same forward selection, backward elimination and replacement, and when it is called for."""

    name: str
    applies: Callable[[StructureSearch, SearchProblem, MultiStartResult], bool]
    run: Callable[[StructureSearch, SearchProblem, MultiStartResult], MultiStartResult]


def multi_start_search(
    search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre], *, moving_air: bool
) -> MultiStartResult:
    """Every search that what is left calls for; `moving_air`: kinematics show gusts, and they are asked first."""
    problem, results = (
        SearchProblem(before, tuple(validation), moving_air),
        MultiStartResult(SearchResult(before), SearchResult(before)),
    )
    for start in STARTS:
        if start.applies(search, problem, results):
            results = start.run(search, problem, results)
    return results


def _is_air_unjudged(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether no kinematics judged the air, and something is left that gusts may say."""
    unknown = not search.settings.air_judged and bool(search.step_coefficients) and search.settings.disturbances
    return unknown and search.is_inadequate(problem.before)


def _gust_or_first_hypothesis(
    search: StructureSearch, problem: SearchProblem, results: MultiStartResult
) -> MultiStartResult:
    """The first round of the plain search, and a gust alone where that says more."""
    first_round = forward_selection(search, problem.before, 1)
    air = with_likeliest_gust(search, problem.before) if search.is_inadequate(first_round[0]) else None
    if air is not None and search.penalised_cost(air) > search.penalised_cost(first_round[0]):
        air = None
    return replace(results, first_round=first_round, air=air)


def _are_gusts_indicated(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:
    """Whether the instruments show gusts, or the flights do, and something is left that they may say."""
    shown = problem.moving_air and bool(search.step_coefficients) and search.settings.disturbances
    return results.air is not None or (shown and search.is_inadequate(problem.before))


def _in_gusts(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search beside a gust, with flow separation where something is left."""
    air = with_likeliest_gust(search, problem.before) if results.air is None else results.air
    in_gusts = search_with_disturbance(search, air, search.settings.gusts.beside_gusts)
    left = search.separation_coefficients and (
        search.is_inadequate(in_gusts.estimate) or _fails_on_validation(search, in_gusts.estimate, problem.validation)
    )
    if left:
        beside = with_disturbance_statistics(search, search_with_separation(search, in_gusts.estimate))
        if search.penalised_cost(beside) < search.penalised_cost(in_gusts.estimate):
            in_gusts = replace(in_gusts, estimate=beside, alternatives=())
    if not search.is_inadequate(in_gusts.estimate) and is_gust_preferred(search, in_gusts.estimate):
        return MultiStartResult(in_gusts, in_gusts, in_gusts, explained=True)
    return replace(results, in_gusts=in_gusts)


def _are_gusts_insufficient(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether gusts are not all that is missing."""
    return not results.explained


def _plain(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search from the declared structure, with nothing beside it."""
    current, rounds = forward_selection(search, problem.before) if results.first_round is None else results.first_round
    if results.first_round is not None and current is not problem.before:
        current, further = forward_selection(search, current, search.settings.rounds - len(rounds))
        rounds = [*rounds, *further]
    current, alternatives = replace_parts(search, current)
    plain = SearchResult(current, alternatives, tuple(rounds))
    return replace(results, plain=plain, best=plain)


def _is_separation_a_candidate(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether flow separation is to be asked: not where gusts came further, for it was asked beside them."""
    return not results.explained and not is_better_in_gusts(search, results.plain, results.in_gusts)


def _with_separation(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search with flow separation in place of what looks like it."""
    plain = with_separation_if_better(search, results.plain, problem.validation)
    return replace(results, plain=plain, best=plain)


def _is_plain_search_inadequate(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether what was found leaves the model wrong."""
    return not results.explained and search.settings.disturbances and search.is_inadequate(results.plain.estimate)


def _among_disturbances(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search among gusts or forces of any shape, where they say it better."""
    found, best = results.plain.estimate, results.plain
    # What was found so far may be the disturbance's work, or be real beside it.
    held_still = not search.parts(found, None) or any(isinstance(a.effect, StateEffect) for a in found.effects)
    held_still |= is_better_in_gusts(search, results.plain, results.in_gusts)
    disturbed = [search_with_disturbances(search, problem.before, results.in_gusts)]
    if not held_still:
        disturbed.append(search_with_disturbances(search, found))
    for each in disturbed:
        if search.penalised_cost(each.estimate) < search.penalised_cost(best.estimate):
            best = each
    return replace(results, best=best)


STARTS = (
    SearchStart("a gust against the first thing that could enter", _is_air_unjudged, _gust_or_first_hypothesis),
    SearchStart("in gusts that are shown", _are_gusts_indicated, _in_gusts),
    SearchStart("plain", _are_gusts_insufficient, _plain),
    SearchStart("with flow separation", _is_separation_a_candidate, _with_separation),
    SearchStart("among gusts or forces of any shape", _is_plain_search_inadequate, _among_disturbances),
)
"""The beginnings of the search, in this order; the likeliest for its price is judged by `gates.GATES`."""


def with_separation_if_better(
    search: StructureSearch, plain: SearchResult, validation: Sequence[Manoeuvre]
) -> SearchResult:
    """The search with flow separation where something is left and that says it better."""
    current = plain.estimate
    if not search.separation_coefficients:
        return plain
    if (
        may_imitate_separation(search, current)
        or search.is_inadequate(current)
        or _fails_on_validation(search, current, validation)
    ):
        beside = search_with_separation(search, current)
        if search.penalised_cost(beside) < search.penalised_cost(current):
            return replace(plain, estimate=beside, alternatives=())
    return plain


def is_better_in_gusts(search: StructureSearch, plain: SearchResult, in_gusts: SearchResult | None) -> bool:
    """Whether the search beside gusts came further: flow separation was then asked beside them alone."""
    return in_gusts is not None and search.penalised_cost(in_gusts.estimate) < search.penalised_cost(plain.estimate)


def _fails_on_validation(search: StructureSearch, current: Refinement, validation: Sequence[Manoeuvre]) -> bool:
    """Whether what was found cannot follow another flight: what separates there may look like a term here."""
    return bool(search.parts(current, None)) and any(is_inadequate_on(current, other) for other in validation)
