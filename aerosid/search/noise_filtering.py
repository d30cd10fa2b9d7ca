"""Test whether an effect of a control only averages the noise of its record."""

from __future__ import annotations

from dataclasses import replace

from aerosid.effects import KINDS, ActiveEffect, InputEffect
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.manoeuvre import with_calm_inputs
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.search.structure_search import NONLINEAR_KINDS, StructureSearch

NOISE_AVERAGING_KINDS = frozenset(name for name in NONLINEAR_KINDS if KINDS[name].place == "input")
"""Nonlinear kinds that average the noise of a control's record."""


def without_noise_averaging(active: ActiveEffect) -> ActiveEffect:
    """The effect on a control without its averaging of the record's noise."""
    if active.effect.kind not in NOISE_AVERAGING_KINDS or not isinstance(active.effect, InputEffect):
        return active
    return replace(active, effect=replace(active.effect, noise=lambda _numbers, _interval: (1.0, 0.0)))


def explains_beyond_noise_averaging(search: StructureSearch, trial: Refinement, current: Refinement) -> bool:
    """Whether a trial's effects of the controls gain more than by averaging the noise of their records.

    A lag, a fractional time delay or a rate limit averages a noisy record, which improves the simulated motion even if
    the surface has no such effect. Such a false effect gains nothing where the noise is averaged out beforehand.
    """
    acting = [active for active in trial.effects if not active.held and active.effect.kind in NOISE_AVERAGING_KINDS]
    held = {active.name for active in current.effects}
    if all(active.name in held for active in acting):
        return True
    calm = [with_calm_inputs(manoeuvre) for manoeuvre in search.manoeuvres]
    with_it, without = (
        refine_on(each, calm, TRIAL, [without_noise_averaging(active) for active in each.effects])
        for each in (trial, current)
    )
    averaging = max(current.cost - without.cost, 0.0)
    return without.cost - with_it.cost > search.critical**2 + search.settings.trials.calm_left * averaging
