"""Structure search with flow separation entered first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.flow_separation import flow_separation
from aerosid.estimation.contest import contest
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, Start
from aerosid.search.backward_elimination import pruned
from aerosid.search.findings import Finding, Part
from aerosid.search.forward_selection import forward
from aerosid.search.replacement import exchange
from aerosid.search.structure_search import StructureSearch


def with_separation(search: StructureSearch, found: Refinement) -> Refinement:
    """The search with flow separation in place of what was found of its likeness.

    Its six numbers can mimic much, so that it is asked late. Curves of alpha and sudden changes are how it looks
    where it is unknown. Where it leaves the model wrong, others may enter beside it.
    """
    alike = [part for part in search.parts(found, None) if part.time is not None or is_curve(part)]
    base = search.without(found, alike) if alike else found
    bases = [base]
    if jump := greatest_jump(search, found):
        # One event may be real beside it.
        bases.append(search.without(found, [part for part in alike if part not in jump]))
    best = _separated(search, bases)
    won, asked = search.price(base) - search.price(best), search.price(base) - search.price(found)
    limits = search.settings.separation
    if won > max(limits.likeness * asked, 0.0) and search.is_doubtful(best):
        best, _ = forward(search, pruned(search, best), limits.beside)
    return best


def separation_at_first(search: StructureSearch, before: Refinement) -> tuple[Refinement, tuple[Finding, ...]]:
    """The search with flow separation before all else, and what could stand in place of its parts.

    Where a stall is most of what is missing, what enters before it is drawn to it and then stands in its way.
    """
    first = pruned(search, _separated(search, [before]))
    current, _ = forward(search, first, search.settings.separation.after)
    return exchange(search, current)


def _separated(search: StructureSearch, bases: Sequence[Refinement]) -> Refinement:
    """The likeliest estimate with flow separation beside one of several others."""
    highest = max(float(np.nanmax(manoeuvre.measured("alpha"))) for manoeuvre in search.manoeuvres)
    drag, lift, moment_name = search.separating
    effect = flow_separation(highest, lift, (drag, moment_name))
    rest = tuple(parameter.trials[0] for parameter in effect.parameters[1:])
    starts = [
        Start(
            search.with_room(each).model,
            each.free,
            (*each.effects, ActiveEffect(effect, (first, *rest))),
            each.states,
            each.variance,
        )
        for each in bases
        for first in effect.parameters[0].trials
    ]
    handicaps = [search.fare(each) for each in starts]
    found = min(contest(starts, search.manoeuvres, TRIAL, handicaps), key=search.price)
    return found if np.isfinite(found.cost) else bases[0]


def greatest_jump(search: StructureSearch, found: Refinement) -> list[Part]:
    """Of several sudden changes the parts of the most certain; none where there are not several."""
    uncertainty = search.rough_deviations(found)
    certainty = {(part.label, part.time): part.ratio for part in search.parts(found, uncertainty)}
    jumps = [group for group in search.groups(found) if group[0].time is not None]
    if len(jumps) < 2:
        return []
    return max(jumps, key=lambda group: max(certainty[part.label, part.time] for part in group))


def is_patchwork(search: StructureSearch, current: Refinement) -> bool:
    """Whether terms are so many, bent in alpha some of them, that one cause with a memory may say them all."""
    terms = [part for part in search.parts(current, None) if part.entry is not None]
    return len(terms) >= search.settings.separation.patches and any(map(is_curve, terms))


def is_curve(part: Part) -> bool:
    """Whether a part is a term in which the angle of attack is bent."""
    if part.entry is None:
        return False
    return any(factor.variable == "alpha" and str(factor) != "alpha" for factor in part.entry[1].factors)
