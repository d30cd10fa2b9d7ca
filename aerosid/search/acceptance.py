"""Acceptance tests of the selected structure: t-ratios, unmodelled forces, cross-validation, sensor consistency."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from aerosid.effects import KINDS, ActiveEffect, OutputEffect
from aerosid.estimation.deviations import Deviations
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.search.backward_elimination import eliminate_insignificant, eliminate_on_final_estimate
from aerosid.search.cross_validation import eliminate_by_cross_validation
from aerosid.search.disturbance_search import SearchResult, with_unmodelled_forces
from aerosid.search.findings import Part
from aerosid.search.multi_start import MultiStartResult, is_better_in_gusts, with_separation_if_better
from aerosid.search.separation_search import search_separation_first
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class AcceptedStructure:
    """The accepted structure with its estimate.

    Attributes
    ----------
    search_result : SearchResult
        The search that selected it, with its disturbances.
    completed : Refinement
        The open-loop estimate.
    uncertainty : Deviations
        Its standard deviations.
    refuted : tuple of Part
        The parts eliminated by cross-validation.
    """

    search_result: SearchResult
    completed: Refinement
    uncertainty: Deviations
    refuted: tuple[Part, ...] = ()

    @property
    def forces(self) -> ActiveEffect | None:
        """The unmodelled forces in the search's final estimate."""
        return unmodelled_forces_of(self.search_result.estimate)


class AcceptanceInput(NamedTuple):
    """Input of the acceptance tests: the re-estimated declared structure, the search results, validation flights."""

    before: Refinement
    results: MultiStartResult
    validation: tuple[Manoeuvre, ...]


class AcceptanceTest(NamedTuple):
    """A requirement on every finding, and the elimination of the parts that do not meet it."""

    requirement: str
    apply: Callable[[StructureSearch, AcceptanceInput, AcceptedStructure], AcceptedStructure]


def accept(
    search: StructureSearch, before: Refinement, results: MultiStartResult, validation: Sequence[Manoeuvre]
) -> AcceptedStructure:
    """The structure that passes all acceptance tests; `validation`: flights that were not fitted."""
    tested, search_result = AcceptanceInput(before, results, tuple(validation)), results.best
    completed, uncertainty = eliminate_on_final_estimate(
        search, search.refined(_without_unmodelled_forces(search_result.estimate, before))
    )
    accepted = AcceptedStructure(search_result, completed, uncertainty)
    for test in ACCEPTANCE_TESTS:
        accepted = test.apply(search, tested, accepted)
    return accepted


def unmodelled_forces_of(current: Refinement) -> ActiveEffect | None:
    """The unmodelled forces that an estimate holds; None where it holds none."""
    return next((active for active in current.effects if active.effect.kind == "unmodelled_forces"), None)


def _without_unmodelled_forces(current: Refinement, before: Refinement) -> Refinement:
    """The estimate without unmodelled forces, which only served to select the structure."""
    if unmodelled_forces_of(current) is None:
        return current
    effects = tuple(active for active in current.effects if active.effect.kind != "unmodelled_forces")
    return replace(current, effects=effects, variance=np.maximum(current.variance, before.variance))


def _exceeding_unmodelled_forces(
    search: StructureSearch, tested: AcceptanceInput, retained: AcceptedStructure
) -> AcceptedStructure:
    """The structure found without disturbances, where its gain far exceeds that of the parts retained with forces."""
    plain, limits = tested.results.plain, search.settings
    least = limits.gusts.no_imitation * search.samples
    if (
        retained.forces is None
        or search.penalised_cost(retained.completed) - search.penalised_cost(plain.estimate) <= least
    ):
        return retained
    found = [plain]
    if is_better_in_gusts(search, plain, tested.results.in_gusts):
        found.append(with_separation_if_better(search, plain, tested.validation))
    if search.separation_coefficients and len(search.parts(plain.estimate, None)) >= limits.separation.patches:
        estimate, alternatives = search_separation_first(search, tested.before)
        found.append(replace(plain, estimate=estimate, alternatives=alternatives))
    best = min(found, key=lambda each: search.penalised_cost(each.estimate))
    return AcceptedStructure(best, *eliminate_on_final_estimate(search, refine_on(best.estimate, search.manoeuvres)))


def _cross_validated(
    search: StructureSearch, tested: AcceptanceInput, retained: AcceptedStructure
) -> AcceptedStructure:
    """The structure without the parts that make the prediction of the validation flights worse."""
    remaining, refuted = eliminate_by_cross_validation(retained.completed, search, tested.validation)
    if not refuted:
        return retained
    completed, uncertainty = eliminate_on_final_estimate(search, refine_on(remaining, search.manoeuvres))
    gain = search.penalised_cost(tested.before) - search.penalised_cost(completed)
    least = search.settings.gusts.no_imitation * search.samples
    if search.settings.disturbances and search.is_inadequate(completed) and gain < least:
        # The search did not find the remaining parts by themselves: they were selected together with the refuted ones.
        rest = eliminate_insignificant(search, with_unmodelled_forces(search, completed))
        completed, uncertainty = eliminate_on_final_estimate(
            search, refine_on(_without_unmodelled_forces(rest, tested.before), search.manoeuvres)
        )
    return replace(retained, completed=completed, uncertainty=uncertainty, refuted=refuted)


def _without_inconsistent_sensor(
    search: StructureSearch,
    tested: AcceptanceInput,  # noqa: ARG001
    retained: AcceptedStructure,
) -> AcceptedStructure:
    """The structure without errors of a sensor whose channel alone keeps a residual: its error is of another kind."""
    reduced = _without_errors_of_inconsistent_sensor(search, retained.completed)
    if reduced is retained.completed:
        return retained
    # A gust that was found together with such an error may have compensated it.
    completed, uncertainty = eliminate_on_final_estimate(
        search, refine_on(_without_weak_gust(search, reduced), search.manoeuvres)
    )
    return replace(retained, completed=completed, uncertainty=uncertainty)


ACCEPTANCE_TESTS = (
    AcceptanceTest("gains more than unmodelled forces can imitate", _exceeding_unmodelled_forces),
    AcceptanceTest("predicts no validation flight worse", _cross_validated),
    AcceptanceTest("is no error of a single inconsistent sensor", _without_inconsistent_sensor),
)
"""The acceptance tests, in this order.

Before the first, and after each that removes a part, backward elimination by corrected t-ratios retains the parts that
are significant among so many candidates (`backward_elimination.eliminate_on_final_estimate`).
"""


def _without_errors_of_inconsistent_sensor(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without the errors of the one sensor whose channel alone keeps a residual."""
    errors = [
        part
        for part in search.parts(completed, None)
        if part.active is not None and isinstance(part.active.effect, OutputEffect)
    ]
    unexplained = search.unexplained_channels(completed) if errors else ()
    if len(unexplained) != 1:
        return completed
    place = search.manoeuvres[0].row(unexplained[0])
    noise = max(float(manoeuvre.noise[place]) for manoeuvre in search.manoeuvres)
    rms = float(np.sqrt(completed.variance[place]))
    errors = [part for part in errors if part.label[1] == unexplained[0]]
    limits = search.settings.odd_sensor
    if rms < limits.odd * noise or not errors:
        return completed
    reduced = search.re_estimated_without(completed, errors)
    return reduced if np.sqrt(reduced.variance[place]) < limits.mostly * rms else completed


def _without_weak_gust(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without the gust that it may hold, where the gust is not significant."""
    gusts = [part for part in search.parts(completed, None) if part.is_disturbance and part.label[0] in KINDS]
    calm = search.re_estimated_without(completed, gusts) if gusts else completed
    return calm if search.penalised_cost(calm) < search.penalised_cost(completed) + search.critical**2 else completed
