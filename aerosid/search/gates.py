"""Gates on the selected structure: unmodelled forces, validation flights, single-sensor explanations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.effects import KINDS, ActiveEffect, OutputEffect
from aerosid.estimation.deviations import Deviations
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.search.backward_elimination import certain, pruned
from aerosid.search.disturbance_search import Searched, in_forces
from aerosid.search.findings import Part
from aerosid.search.refutation import without_refuted
from aerosid.search.separation_search import PATCHES, separation_at_first
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
    spread : Deviations
        Its standard deviations.
    refuted : tuple of Part
        What other flights refuted.
    """

    searched: Searched
    completed: Refinement
    spread: Deviations
    refuted: tuple[Part, ...]

    @property
    def forces(self) -> ActiveEffect | None:
        """Forces of any shape that the search ended among."""
        return forces_of(self.searched.estimate)


def standing(search: StructureSearch, before: Refinement, made: Searches, validation: Sequence[Manoeuvre]) -> Standing:
    """What stands of the searches that were made; `validation`: flights that were not fitted."""
    manoeuvres, searched = search.manoeuvres, made.reached
    completed, spread = certain(search, refine_on(_unforced(searched.estimate, before), manoeuvres))
    if forces_of(searched.estimate) and (kept := _no_imitation(search, before, completed, made, validation)):
        searched = kept
        completed, spread = certain(search, refine_on(kept.estimate, manoeuvres))
    held, refuted = without_refuted(completed, search, validation)
    if refuted:
        completed, spread = certain(search, refine_on(held, manoeuvres))
        gain = search.price(before) - search.price(completed)
        if search.settings.disturbances and search.is_doubtful(completed) and gain < NO_IMITATION * search.samples:
            # What is left of a sum that was refuted was not found as such.
            rest = pruned(search, in_forces(search, completed))
            completed, spread = certain(search, refine_on(_unforced(rest, before), manoeuvres))
    if (reduced := _without_odd_sensors(search, completed)) is not completed:
        # A gust that was found beside such a fault may have been its work.
        completed, spread = certain(search, refine_on(_calmed(search, reduced), manoeuvres))
    return Standing(searched, completed, spread, refuted)


NO_IMITATION = 1.8
"""Rise of -2 ln L a sample, residuals 2.5 times as large, that no wrong name makes good.

Forces of any shape can follow a stall, a trim change and thrust too, and leave none of them standing. What brings the
whole residual in open loop down so far is kept, although something is left.
"""


def _no_imitation(
    search: StructureSearch,
    before: Refinement,
    completed: Refinement,
    made: Searches,
    validation: Sequence[Manoeuvre],
) -> Searched | None:
    """What was found without disturbances, if it says so much more than what forces of any shape left standing."""
    plain = made.plain
    if search.price(completed) - search.price(plain.estimate) <= NO_IMITATION * search.samples:
        return None
    found = [plain]
    if gusts_say_better(search, plain, made.gusty):
        found.append(separated(search, plain, validation))
    if search.separating and len(search.parts(plain.estimate, None)) >= PATCHES:
        estimate, others = separation_at_first(search, before)
        found.append(replace(plain, estimate=estimate, others=others))
    return min(found, key=lambda each: search.price(each.estimate))


def forces_of(current: Refinement) -> ActiveEffect | None:
    """The forces of any shape among which an estimate stands."""
    return next((active for active in current.effects if active.effect.kind == "unmodelled_forces"), None)


def _unforced(current: Refinement, before: Refinement) -> Refinement:
    """Without forces of any shape, which judged what is real: the numbers come from the estimator of those before."""
    effects = tuple(active for active in current.effects if active.effect.kind != "unmodelled_forces")
    return replace(current, effects=effects, variance=np.maximum(current.variance, before.variance))


ODD = 2.0
"""Times its noise that the one channel with anything left must be for the fault named of its sensor to be no such."""

MOSTLY = 3.0
"""Times what is left that the channel must be off without the fault for it to be named all the same: it says most."""


def _without_odd_sensors(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without faults of the one sensor whose channel alone is left wrong: it errs as they do not."""
    wrong = unexplained_channels(completed, search.manoeuvres)
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
    if left < ODD * noise or not odd:
        return completed
    reduced = search.without(completed, odd)
    return reduced if np.sqrt(reduced.variance[place]) < MOSTLY * left else completed


def _calmed(search: StructureSearch, completed: Refinement) -> Refinement:
    """The estimate without the gust that it may hold, where that does not say enough to stay."""
    gusts = [part for part in search.parts(completed, None) if part.is_disturbance and part.label[0] in KINDS]
    calm = search.without(completed, gusts) if gusts else completed
    return calm if search.price(calm) < search.price(completed) + search.critical**2 else completed
