"""Structure search with flow separation entered first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.flow_separation import flow_separation
from aerosid.estimation.competing_fits import fit_competing_structures
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, Start
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.findings import Finding, Part
from aerosid.search.forward_selection import forward_selection
from aerosid.search.replacement import replace_parts
from aerosid.search.structure_search import StructureSearch


def search_with_separation(search: StructureSearch, found: Refinement) -> Refinement:
    """The search with flow separation in place of what was found of its likeness.

    Its six numbers can mimic much, so that it is asked late. Curves of alpha and sudden changes are how it looks
    where it is unknown. Where it leaves the model wrong, others may enter beside it.
    """
    imitating = [part for part in search.parts(found, None) if part.time is not None or is_nonlinear_in_alpha(part)]
    base = search.re_estimated_without(found, imitating) if imitating else found
    bases = [base]
    if step_change := most_certain_step_change(search, found):
        # One event may be real beside it.
        bases.append(search.re_estimated_without(found, [part for part in imitating if part not in step_change]))
    best = _likeliest_with_separation(search, bases)
    gain, gain_of_imitation = (
        search.penalised_cost(base) - search.penalised_cost(best),
        search.penalised_cost(base) - search.penalised_cost(found),
    )
    limits = search.settings.separation
    if gain > max(limits.likeness * gain_of_imitation, 0.0) and search.is_inadequate(best):
        best, _ = forward_selection(search, eliminate_insignificant(search, best), limits.beside)
    return best


def search_separation_first(search: StructureSearch, before: Refinement) -> tuple[Refinement, tuple[Finding, ...]]:
    """The search with flow separation before all else, and what could stand in place of its parts.

    Where a stall is most of what is missing, what enters before it is drawn to it and then stands in its way.
    """
    first = eliminate_insignificant(search, _likeliest_with_separation(search, [before]))
    current, _ = forward_selection(search, first, search.settings.separation.after)
    return replace_parts(search, current)


def _likeliest_with_separation(search: StructureSearch, bases: Sequence[Refinement]) -> Refinement:
    """The likeliest estimate with flow separation beside one of several others."""
    highest = max(float(np.nanmax(manoeuvre.measured("alpha"))) for manoeuvre in search.manoeuvres)
    drag, lift, moment_name = search.separation_coefficients
    effect = flow_separation(highest, lift, (drag, moment_name))
    rest = tuple(parameter.trials[0] for parameter in effect.parameters[1:])
    starts = [
        Start(
            search.with_step_columns(each).model,
            each.free,
            (*each.effects, ActiveEffect(effect, (first, *rest))),
            each.states,
            each.variance,
        )
        for each in bases
        for first in effect.parameters[0].trials
    ]
    penalties = [search.penalty(each) for each in starts]
    return min(fit_competing_structures(starts, search.manoeuvres, TRIAL, penalties), key=search.penalised_cost)


def most_certain_step_change(search: StructureSearch, found: Refinement) -> list[Part]:
    """Of several sudden changes the parts of the most certain; none where there are not several."""
    uncertainty = search.quick_deviations(found)
    certainty = {(part.label, part.time): part.ratio for part in search.parts(found, uncertainty)}
    step_changes = [group for group in search.groups(found) if group[0].time is not None]
    if len(step_changes) < 2:
        return []
    return max(step_changes, key=lambda group: max(certainty[part.label, part.time] for part in group))


def may_imitate_separation(search: StructureSearch, current: Refinement) -> bool:
    """Whether terms are so many, bent in alpha some of them, that one cause with a memory may say them all."""
    terms = [part for part in search.parts(current, None) if part.entry is not None]
    return len(terms) >= search.settings.separation.patches and any(map(is_nonlinear_in_alpha, terms))


def is_nonlinear_in_alpha(part: Part) -> bool:
    """Whether a part is a term in which the angle of attack is bent."""
    if part.entry is None:
        return False
    return any(factor.variable == "alpha" and str(factor) != "alpha" for factor in part.entry[1].factors)
