"""Structure search with flow separation entered first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.flow_separation import flow_separation, longest_separation
from aerosid.estimation.competing_fits import fit_competing_structures
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.maximum_likelihood import Refinement, Start
from aerosid.flight_model.term_grammar import LIFT
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.findings import Finding, Part, identity
from aerosid.search.forward_selection import forward_selection
from aerosid.search.replacement import replace_parts
from aerosid.search.structure_search import StructureSearch


def search_with_separation(search: StructureSearch, found: Refinement) -> Refinement:
    """The search with flow separation in place of the parts that may imitate it.

    Its six parameters can imitate many effects, so that it is tried late. Terms nonlinear in alpha and step changes
    imitate it where it is not modelled. Where the model with it remains inadequate, other hypotheses may enter.
    """
    imitating = [part for part in search.parts(found, None) if part.time is not None or is_nonlinear_in_alpha(part)]
    base = search.re_estimated_without(found, imitating) if imitating else found
    base_estimates = [base]
    if step_change := most_certain_step_change(search, found):
        # One step change may be real in addition to it.
        base_estimates.append(
            search.re_estimated_without(found, [part for part in imitating if part not in step_change])
        )
    best = _likeliest_with_separation(search, base_estimates)
    gain = search.penalised_cost(base) - search.penalised_cost(best)
    gain_of_imitation = search.penalised_cost(base) - search.penalised_cost(found)
    limits = search.settings.separation
    if gain > max(limits.likeness * gain_of_imitation, 0.0) and search.is_inadequate(best):
        best, _ = forward_selection(search, eliminate_insignificant(search, best), limits.beside)
    return best


def search_separation_first(search: StructureSearch, before: Refinement) -> tuple[Refinement, tuple[Finding, ...]]:
    """The search with flow separation entered first, and the alternatives to its parts.

    Where a stall is the main effect, hypotheses that enter before it imitate it and then keep it from entering.
    """
    first = eliminate_insignificant(search, _likeliest_with_separation(search, [before]))
    current, _ = forward_selection(search, first, search.settings.separation.after)
    return replace_parts(search, current)


def _likeliest_with_separation(search: StructureSearch, base_estimates: Sequence[Refinement]) -> Refinement:
    """The estimate of least penalised cost with flow separation added to one of several others."""
    highest = max(float(np.nanmax(manoeuvre.measured("alpha"))) for manoeuvre in search.manoeuvres)
    drag, lift, moment_name = search.separation_coefficients
    airspeeds = [manoeuvre.mean_airspeed for manoeuvre in search.manoeuvres]
    longest = longest_separation(base_estimates[0].model.constants.mean_chord, airspeeds)
    effect = flow_separation(highest, lift, (drag, moment_name), longest)
    other_values = tuple(parameter.trials[0] for parameter in effect.parameters[1:])
    starts = [
        Start(
            search.with_step_columns(each).model,
            each.free,
            (*each.effects, ActiveEffect(effect, (first, *other_values))),
            each.states,
            each.variance,
        )
        for each in base_estimates
        for first in effect.parameters[0].trials
    ]
    penalties = [search.penalty(each) for each in starts]
    found = min(fit_competing_structures(starts, search.manoeuvres, TRIAL, penalties), key=search.penalised_cost)
    return found if np.isfinite(found.cost) else base_estimates[0]


def most_certain_step_change(search: StructureSearch, found: Refinement) -> list[Part]:
    """The parts of the most significant of several step changes; empty where there are not several."""
    uncertainty = search.quick_deviations(found)
    ratios = {identity(part): part.ratio for part in search.parts(found, uncertainty)}
    step_changes = [group for group in search.groups(found) if group[0].time is not None]
    if len(step_changes) < 2:
        return []
    return max(step_changes, key=lambda group: max(ratios[identity(part)] for part in group))


def may_imitate_separation(search: StructureSearch, current: Refinement) -> bool:
    """Whether there are so many terms that flow separation may explain them all, one of lift nonlinear in alpha.

    Whatever else it changes, it takes lift away.
    """
    terms = [part for part in search.parts(current, None) if part.entry is not None]
    of_lift = [part for part in terms if part.entry is not None and part.entry[0] in LIFT]
    return len(terms) >= search.settings.separation.patches and any(map(is_nonlinear_in_alpha, of_lift))


def is_nonlinear_in_alpha(part: Part) -> bool:
    """Whether a part is a term nonlinear in the angle of attack."""
    if part.entry is None:
        return False
    return any(factor.variable == "alpha" and str(factor) != "alpha" for factor in part.entry[1].factors)
