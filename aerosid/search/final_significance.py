"""Wald test of every finding by its final estimate: three standard errors from the null value at least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from aerosid.estimation.deviations import deviations
from aerosid.estimation.filter_error import filter_error, widened
from aerosid.notation import number
from aerosid.search.attribution import Attribution
from aerosid.search.confirmation import Confirmed
from aerosid.search.finding_evidence import finding_from_part, findings_with_p_values
from aerosid.search.findings import Part, labels, named
from aerosid.search.structure_search import StructureSearch


def eliminate_by_wald_test(found: Attribution, search: StructureSearch) -> Attribution:
    """The findings that the Wald test of the final estimate retains, everything re-estimated without the others.

    Parameters
    ----------
    found : Attribution
        The result of a search by any method.
    search : StructureSearch
        The flights that were fitted, the hypotheses that were tested and the settings.

    Returns
    -------
    Attribution
        Where all are significant, `found` itself. Otherwise without the others, which are `eliminated`; the least
        significant first, since the remaining ones become more significant without it.

    Notes
    -----
    Wald's test of the reported value by its reported standard error: whatever the result of a search or of another
    flight, a term is not named if its final estimate does not differ significantly from the null value, nor if another
    flight contradicts its sign. The size of a random disturbance has no sign and its standard error grows with it: it
    is tested by its likelihood ratio at entry alone.
    """
    current = found
    while (weakest := _least_significant(current, search)) is not None:
        current = _re_estimated_without(current, weakest, search)
    if current is found:
        return found
    remaining = {named(label) for label in labels(current.findings)}
    return replace(current, alternatives=tuple(each for each in current.alternatives if each.instead_of in remaining))


def note_on_eliminated(found: Attribution, critical_ratio: float) -> list[str]:
    """One sentence per eliminated finding, for the notes."""
    return [
        f"Eliminated: {named((each.kind, each.where, each.term))}. Its final estimate, {number(each.value)} with a "
        f"standard error of {number(each.std_error, 2)}, is not {critical_ratio:g} standard errors from null, "
        "or has not the sign of its confirmation; everything is re-estimated without it."
        for each in found.eliminated
    ]


def _least_significant(found: Attribution, search: StructureSearch) -> Part | None:
    """The least significant part that fails the test; None where all pass."""
    critical_ratio = search.settings.final_deviations
    parts = [part for part in search.parts(found.completed, found.completed_deviations) if not part.is_disturbance]
    failing = [
        part for part in parts if wald_ratio(part) < critical_ratio or not has_confirmed_sign(part, found.confirmed)
    ]
    return min(failing, key=wald_ratio, default=None)


def wald_ratio(part: Part) -> float:
    """Wald ratio of a part: standard errors from its null value; of several parameters the most significant."""
    if part.active is None or not part.parameters:
        return abs(part.value - part.null) / part.std_error if part.std_error > 0.0 else 0.0
    nulls = [parameter.null for parameter in part.active.effect.parameters]
    numbers = zip(part.parameters, nulls, strict=True)
    return max((abs(v - null) / error for (_, v, error, _), null in numbers if error > 0.0), default=0.0)


def has_confirmed_sign(part: Part, confirmed: Sequence[Confirmed]) -> bool:
    """Whether a term's value has the sign of its confirmation by another flight."""
    confirmed_values = [each.value for each in confirmed if each.entry == part.entry]
    return all(np.sign(value) == np.sign(part.value) for value in confirmed_values)


def _re_estimated_without(found: Attribution, part: Part, search: StructureSearch) -> Attribution:
    """The attribution re-estimated without one part, by the estimators that its values are from."""
    reduced = search.reduced_structure(found.completed, [part])
    is_declared = (reduced.free, reduced.effects) == (found.before.free, found.before.effects)
    completed = found.before if is_declared else found.re_estimated(reduced, search.manoeuvres)
    uncertainty = (found.deviations_of or partial(deviations, manoeuvres=search.manoeuvres))(completed)
    with_forces = found.filter_error
    if with_forces is not None:
        with_forces = filter_error(completed, with_forces.forces, with_forces.variance, search.manoeuvres)
    uncertainty = widened(uncertainty, with_forces)
    eliminated = finding_from_part(search, part, completed.cost - found.completed.cost)
    return replace(
        found,
        completed=completed,
        completed_deviations=uncertainty,
        filter_error=with_forces,
        findings=findings_with_p_values(search, completed, uncertainty),
        confirmed=tuple(each for each in found.confirmed if each.entry != part.entry),
        eliminated=(*found.eliminated, eliminated),
    )
