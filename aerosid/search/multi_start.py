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
    search_with_gust_or_forces,
    with_likeliest_gust,
)
from aerosid.search.findings import Finding
from aerosid.search.forward_selection import forward_selection, with_disturbance_statistics
from aerosid.search.replacement import replace_parts
from aerosid.search.separation_search import may_imitate_separation, search_with_separation
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class MultiStartResult:
    """Results of the searches from several starts.

    Attributes
    ----------
    plain : SearchResult
        Without disturbances; the search in gusts where that explains everything.
    best : SearchResult
        The one of least penalised cost.
    in_gusts : SearchResult or None
        In the presence of gusts that the instruments show by kinematics alone.
    explained : bool
        Whether those gusts and the parts found with them leave an adequate model and gain more than unmodelled forces.
    first_round : tuple or None
        The first round of the plain search, where it was made: its estimate and its scores.
    air : Refinement or None
        The estimate with a gust alone, where its penalised cost is below that of the first round.
    """

    plain: SearchResult
    best: SearchResult
    in_gusts: SearchResult | None = None
    explained: bool = False
    first_round: tuple[Refinement, list[tuple[Score, ...]]] | None = None
    air: Refinement | None = None


class SearchProblem(NamedTuple):
    """Input of the searches: the re-estimated declared structure, validation flights, whether kinematics show gusts.

    `ends_inadequate`: whether a plain search that leaves the model inadequate ends there, without replacement of its
    parts; `entered` is called with the estimate after each of its entries.
    """

    before: Refinement
    validation: tuple[Manoeuvre, ...]
    moving_air: bool
    ends_inadequate: bool = False
    entered: Callable[[Refinement], None] = lambda _estimate: None


class SearchStart(NamedTuple):
    """A start of the same forward selection, backward elimination and replacement, with its condition."""

    name: str
    applies: Callable[[StructureSearch, SearchProblem, MultiStartResult], bool]
    run: Callable[[StructureSearch, SearchProblem, MultiStartResult], MultiStartResult]


def multi_start_search(
    search: StructureSearch, before: Refinement, validation: Sequence[Manoeuvre], *, moving_air: bool
) -> MultiStartResult:
    """Searches from every start whose condition is met; `moving_air`: kinematics show gusts, which are tried first."""
    return _searched(search, SearchProblem(before, tuple(validation), moving_air), STARTS)


def search_without_disturbances(
    search: StructureSearch,
    before: Refinement,
    validation: Sequence[Manoeuvre],
    *,
    moving_air: bool,
    doubted: Callable[[], None] = lambda: None,
) -> MultiStartResult | None:
    """As `multi_start_search`, where that ends before flow separation and unmodelled forces are tried; else None.

    `doubted` is called where several hypotheses have entered and the model is inadequate still: None is likely then.
    """
    adequate = []

    def entered(estimate: Refinement) -> None:
        adequate.append(not search.is_inadequate(estimate))
        if len(adequate) == search.settings.doubted and not any(adequate):
            doubted()

    problem = SearchProblem(before, tuple(validation), moving_air, ends_inadequate=True, entered=entered)
    results = _searched(search, problem, STARTS[: STARTS.index(PLAIN) + 1])
    if results.explained:
        return results
    found = results.plain.estimate
    inadequate = search.is_inadequate(found) or _fails_on_validation(search, found, validation)
    if inadequate or (search.separation_coefficients and may_imitate_separation(search, found)):
        return None
    return results


def _searched(search: StructureSearch, problem: SearchProblem, starts: Sequence[SearchStart]) -> MultiStartResult:
    """The searches from those starts whose condition is met, in turn."""
    results = MultiStartResult(SearchResult(problem.before), SearchResult(problem.before))
    for start in starts:
        if start.applies(search, problem, results):
            results = start.run(search, problem, results)
    return results


def _is_air_unjudged(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether the air was not judged by kinematics and the model is inadequate, so that gusts may explain it."""
    unknown = not search.settings.air_judged and bool(search.step_coefficients) and search.settings.disturbances
    return unknown and search.is_inadequate(problem.before)


def _gust_or_first_hypothesis(
    search: StructureSearch, problem: SearchProblem, results: MultiStartResult
) -> MultiStartResult:
    """The first round of the plain search, and a gust alone where that has the lower penalised cost."""
    first_round = forward_selection(search, problem.before, 1)
    air = with_likeliest_gust(search, problem.before) if search.is_inadequate(first_round[0]) else None
    if air is not None and search.penalised_cost(air) > search.penalised_cost(first_round[0]):
        air = None
    return replace(results, first_round=first_round, air=air)


def _are_gusts_indicated(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:
    """Whether kinematics or the likelihood show gusts and the declared model is inadequate."""
    shown = problem.moving_air and bool(search.step_coefficients) and search.settings.disturbances
    return results.air is not None or (shown and search.is_inadequate(problem.before))


def _in_gusts(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search in the presence of a gust, with flow separation where the model remains inadequate."""
    air = with_likeliest_gust(search, problem.before) if results.air is None else results.air
    in_gusts = search_with_disturbance(search, air, search.settings.gusts.beside_gusts)
    separation_needed = search.separation_coefficients and (
        search.is_inadequate(in_gusts.estimate) or _fails_on_validation(search, in_gusts.estimate, problem.validation)
    )
    if separation_needed:
        with_separation = with_disturbance_statistics(search, search_with_separation(search, in_gusts.estimate))
        if search.penalised_cost(with_separation) < search.penalised_cost(in_gusts.estimate):
            in_gusts = replace(in_gusts, estimate=with_separation, alternatives=())
    if not search.is_inadequate(in_gusts.estimate) and is_gust_preferred(search, in_gusts.estimate):
        return MultiStartResult(in_gusts, in_gusts, in_gusts, explained=True)
    return replace(results, in_gusts=in_gusts)


def _are_gusts_insufficient(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether gusts do not explain everything."""
    return not results.explained


def _plain(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search from the declared structure, without disturbances."""
    entered = problem.entered
    if results.first_round is None:
        current, rounds = forward_selection(search, problem.before, entered=entered)
    else:
        current, rounds = results.first_round
        if current is not problem.before:
            current, further = forward_selection(search, current, search.settings.rounds - len(rounds), entered)
            rounds = [*rounds, *further]
    alternatives: tuple[Finding, ...] = ()
    # A part is replaced by one that gains about as much, which leaves the residual as unlike noise as it is.
    if not (problem.ends_inadequate and search.is_inadequate(current)):
        current, alternatives = replace_parts(search, current)
    plain = SearchResult(current, alternatives, tuple(rounds))
    return replace(results, plain=plain, best=plain)


def _is_separation_untried(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether to try flow separation: not where the search in gusts is better, which has tried it already."""
    return not results.explained and not is_better_in_gusts(search, results.plain, results.in_gusts)


def _with_separation(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search with flow separation in place of the parts that imitate it."""
    plain = with_separation_if_better(search, results.plain, problem.validation)
    return replace(results, plain=plain, best=plain)


def _is_plain_search_inadequate(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> bool:  # noqa: ARG001
    """Whether the model remains inadequate after the plain search."""
    return not results.explained and search.settings.disturbances and search.is_inadequate(results.plain.estimate)


def _among_disturbances(search: StructureSearch, problem: SearchProblem, results: MultiStartResult) -> MultiStartResult:
    """The search in the presence of gusts or unmodelled forces, where its penalised cost is lower."""
    found, best = results.plain.estimate, results.plain
    # The parts found so far may imitate the disturbance, or be real in addition to it.
    no_second_start = not search.parts(found, None) or any(isinstance(a.effect, StateEffect) for a in found.effects)
    no_second_start |= is_better_in_gusts(search, results.plain, results.in_gusts)
    disturbed = [search_with_gust_or_forces(search, problem.before, results.in_gusts)]
    if not no_second_start:
        disturbed.append(search_with_gust_or_forces(search, found))
    for each in disturbed:
        if search.penalised_cost(each.estimate) < search.penalised_cost(best.estimate):
            best = each
    return replace(results, best=best)


PLAIN = SearchStart("plain", _are_gusts_insufficient, _plain)
"""The start without disturbances."""

STARTS = (
    SearchStart("a gust against the first hypothesis that could enter", _is_air_unjudged, _gust_or_first_hypothesis),
    SearchStart("in the presence of gusts", _are_gusts_indicated, _in_gusts),
    PLAIN,
    SearchStart("with flow separation", _is_separation_untried, _with_separation),
    SearchStart("in the presence of gusts or unmodelled forces", _is_plain_search_inadequate, _among_disturbances),
)
"""The starts, in this order; `acceptance.ACCEPTANCE_TESTS` test the result of least penalised cost."""


def with_separation_if_better(
    search: StructureSearch, plain: SearchResult, validation: Sequence[Manoeuvre]
) -> SearchResult:
    """The search with flow separation where the model is inadequate and flow separation lowers the penalised cost."""
    current = plain.estimate
    if not search.separation_coefficients:
        return plain
    if (
        may_imitate_separation(search, current)
        or search.is_inadequate(current)
        or _fails_on_validation(search, current, validation)
    ):
        with_separation = search_with_separation(search, current)
        if search.penalised_cost(with_separation) < search.penalised_cost(current):
            return replace(plain, estimate=with_separation, alternatives=())
    return plain


def is_better_in_gusts(search: StructureSearch, plain: SearchResult, in_gusts: SearchResult | None) -> bool:
    """Whether the search in gusts has the lower penalised cost: flow separation was then tried with gusts only."""
    return in_gusts is not None and search.penalised_cost(in_gusts.estimate) < search.penalised_cost(plain.estimate)


def _fails_on_validation(search: StructureSearch, current: Refinement, validation: Sequence[Manoeuvre]) -> bool:
    """Whether the found structure cannot fit a validation flight: a stall there may resemble a term here."""
    return bool(search.parts(current, None)) and any(is_inadequate_on(current, other) for other in validation)
