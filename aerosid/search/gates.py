"""Model validation of the selected structure: critical t-ratios, unmodelled forces, cross-validation, lone sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from aerosid.effects import KINDS, ActiveEffect, OutputEffect
from aerosid.estimation.deviations import Deviations
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.search.backward_elimination import certain, pruned
from aerosid.search.disturbance_search import Searched, in_forces
from aerosid.search.findings import Part
from aerosid.search.refutation import without_refuted
from aerosid.search.separation_search import separation_at_first
from aerosid.search.starts import Searches, gusts_say_better, separated
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class Standing:
    """What stands.

    Attributes
    ----------
    searched : Searched
        The search that it is of, disturbances and all.
    completed : Refinement
        The estimate in open loop.
    uncertainty : Deviations
        Its standard deviations.
    refuted : tuple of Part
        What other flights refuted.
    """

    searched: Searched
    completed: Refinement
    uncertainty: Deviations
    refuted: tuple[Part, ...] = ()

    @property
    def forces(self) -> ActiveEffect | None:
        """Forces of any shape that the search ended among."""
        return forces_of(self.searched.estimate)


class Selected(NamedTuple):
    """What the gates judge: the declared structure re-estimated, the searches made, flights that were not fitted."""

    before: Refinement
    made: Searches
    validation: tuple[Manoeuvre, ...]


class Gate(NamedTuple):
    """What a finding must be to be named, and how the structure is left without what is not."""

    asks: str
    passed: Callable[[StructureSearch, Selected, Standing], Standing]


def standing(search: StructureSearch, before: Refinement, made: Searches, validation: Sequence[Manoeuvre]) -> Standing:
    """What stands of the searches that were made; `validation`: flights that were not fitted."""
    selected, searched = Selected(before, made, tuple(validation)), made.reached
    completed, uncertainty = certain(search, search.refined(_unforced(searched.estimate, before)))
    accepted = Standing(searched, completed, uncertainty)
    for gate in GATES:
        accepted = gate.passed(search, selected, accepted)
    return accepted


def forces_of(current: Refinement) -> ActiveEffect | None:
    """The forces of any shape among which an estimate stands."""
    return next((active for active in current.effects if active.effect.kind == "unmodelled_forces"), None)


def _unforced(current: Refinement, before: Refinement) -> Refinement:
    """Without forces of any shape, which judged what is real: the numbers come from the estimator of those before."""
    if forces_of(current) is None:
        return current
    effects = tuple(active for active in current.effects if active.effect.kind != "unmodelled_forces")
    return replace(current, effects=effects, variance=np.maximum(current.variance, before.variance))


def _beyond_imitation(search: StructureSearch, selected: Selected, held: Standing) -> Standing:
    """With what was found without disturbances, if it says so much more than forces of any shape left standing."""
    plain, limits = selected.made.plain, search.settings
    least = limits.gusts.no_imitation * search.samples
    if held.forces is None or search.price(held.completed) - search.price(plain.estimate) <= least:
        return held
    found = [plain]
    if gusts_say_better(search, plain, selected.made.gusty):
        found.append(separated(search, plain, selected.validation))
    if search.separating and len(search.parts(plain.estimate, None)) >= limits.separation.patches:
        estimate, others = separation_at_first(search, selected.before)
        found.append(replace(plain, estimate=estimate, others=others))
    kept = min(found, key=lambda each: search.price(each.estimate))
    return Standing(kept, *certain(search, refine_on(kept.estimate, search.manoeuvres)))


def _not_refuted(search: StructureSearch, selected: Selected, held: Standing) -> Standing:
    """Without what makes the prediction of the validation flights worse."""
    left, refuted = without_refuted(held.completed, search, selected.validation)
    if not refuted:
        return held
    completed, uncertainty = certain(search, refine_on(left, search.manoeuvres))
    gain = search.price(selected.before) - search.price(completed)
    least = search.settings.gusts.no_imitation * search.samples
    if search.settings.disturbances and search.is_doubtful(completed) and gain < least:
        # What is left of a sum that was refuted was not found as such.
        rest = pruned(search, in_forces(search, completed))
        completed, uncertainty = certain(search, refine_on(_unforced(rest, selected.before), search.manoeuvres))
    return replace(held, completed=completed, uncertainty=uncertainty, refuted=refuted)


def _not_one_odd_sensor(search: StructureSearch, selected: Selected, held: Standing) -> Standing:  # noqa: ARG001
    """Without faults of the one sensor whose channel alone is left wrong: it errs as they do not."""
    reduced = _without_odd_sensors(search, held.completed)
    if reduced is held.completed:
        return held
    # A gust that was found beside such a fault may have been its work.
    completed, uncertainty = certain(search, refine_on(_calmed(search, reduced), search.manoeuvres))
    return replace(held, completed=completed, uncertainty=uncertainty)


GATES = (
    Gate("says more than forces of any shape imitate", _beyond_imitation),
    Gate("predicts no validation flight worse", _not_refuted),
    Gate("is not one sensor's fault that leaves its channel alone wrong", _not_one_odd_sensor),
)
"""What each structure must pass in turn.

Before the first, and after each that takes something out, backward elimination by corrected t-ratios keeps what is
certain among so many candidates (`backward_elimination.certain`).
"""


def _without_odd_sensors(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without faults of the one sensor whose channel alone is left wrong."""
    wrong = search.unexplained_channels(completed)
    if len(wrong) != 1:
        return completed
    place = search.manoeuvres[0].row(wrong[0])
    noise = max(float(manoeuvre.noise[place]) for manoeuvre in search.manoeuvres)
    left = float(np.sqrt(completed.variance[place]))
    odd = [
        part
        for part in search.parts(completed, None)
        if part.active is not None and isinstance(part.active.effect, OutputEffect) and part.label[1] == wrong[0]
    ]
    limits = search.settings.odd_sensor
    if left < limits.odd * noise or not odd:
        return completed
    reduced = search.without(completed, odd)
    return reduced if np.sqrt(reduced.variance[place]) < limits.mostly * left else completed


def _calmed(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without the gust that it may hold, where that does not say enough to stay."""
    gusts = [part for part in search.parts(completed, None) if part.is_disturbance and part.label[0] in KINDS]
    calm = search.without(completed, gusts) if gusts else completed
    return calm if search.price(calm) < search.price(completed) + search.critical**2 else completed
