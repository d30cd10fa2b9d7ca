"""Lags of a control that only filter the noise of its record."""

from __future__ import annotations

from dataclasses import replace

from aerosid.effects import KINDS, ActiveEffect, InputEffect
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.manoeuvre import with_calm_inputs
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.search.structure_search import NONLINEAR_KINDS, StructureSearch

NOISE_AVERAGING_KINDS = frozenset(name for name in NONLINEAR_KINDS if KINDS[name].place == "input")
"""Kinds unlike their score that take noise out of a control's record."""


def without_noise_averaging(active: ActiveEffect) -> ActiveEffect:
    """The effect on a control without what it does to the noise of its record."""
    if active.effect.kind not in NOISE_AVERAGING_KINDS or not isinstance(active.effect, InputEffect):
        return active
    return replace(active, effect=replace(active.effect, noise=lambda _numbers, _interval: (1.0, 0.0)))


def explains_beyond_noise_averaging(search: StructureSearch, trial: Refinement, current: Refinement) -> bool:
    """Whether what a trial says of a control does more than to take noise out of its record.

    A lag, a delay between two samples or a limit of rate averages a noisy record, and the motion is then better
    simulated though the surface does nothing of the kind. With that noise averaged out it brings nothing.
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
