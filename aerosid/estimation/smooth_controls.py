"""Recorded controls that are smooth between samples, as an anti-aliasing filter leaves them.

A simulation takes controls as linear between samples, which attenuates them (`signals.smooth_between_samples`). Where
the motion is known to the noise of good instruments the derivatives make up for it, and a lag is told as a shorter one
with a delay. The samples are therefore changed by what is lost, and a control that is late is late as a smooth one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.control import control_delay, control_lag
from aerosid.errors import EstimationError
from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.linear_or_held_controls import INTERPOLATION, stepped_controls
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.nomenclature import is_surface
from aerosid.notation import listed
from aerosid.signals.smooth_between_samples import samples_for_lines

Array = NDArray[np.float64]

LATE_KINDS = {"control_delay": control_delay, "control_lag": control_lag}
"""Effects by which a control is late, by kind."""


@dataclass(frozen=True)
class SmoothSettings:
    """Where the question is asked; the gain that answers it is that of held controls (`InterpolationSettings`).

    Attributes
    ----------
    bend : float
        Distance between curve and line in the middle of an interval over the control's standard deviation, 1, root mean
        square of either, from which it is asked. Chosen: an eighth of the smallest by which a lag was told wrongly
        (`benchmarks/field_detection.py --late lag`, seed 646000).
    """

    bend: float = 0.004


SMOOTH = SmoothSettings()
"""Of every flight."""


def with_smooth_controls(
    manoeuvres: Sequence[Manoeuvre], found: Refinement, controls: Sequence[str]
) -> tuple[Manoeuvre, ...] | None:
    """The fitted manoeuvres with controls smooth between samples; None where that is not clearly likelier than linear.

    Parameters
    ----------
    found : Refinement
        The completed structure: one that lacks something may favour either.
    controls : sequence of str
        As of `bent_controls`.
    """
    if not controls:
        return None
    smooth = tuple(smoothed(each, controls) for each in manoeuvres)
    try:
        linear, other = (refine_on(found, flown, WRONG_STRUCTURE).cost for flown in (manoeuvres, smooth))
    except EstimationError:
        return None
    needed = 0.0 if _is_split(found, controls) else INTERPOLATION.gain
    return smooth if other < linear - needed else None


def _is_split(found: Refinement, controls: Sequence[str]) -> bool:
    """Whether a control both lags and is delayed, which is what linear interpolation makes of a lag."""
    late = [each.effect.where for each in found.effects if each.effect.kind in LATE_KINDS]
    return any(late.count(name) > 1 for name in controls)


def bent_controls(manoeuvres: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """Surfaces that bend between samples on some manoeuvre, and move in steps or are held on none."""
    stepped = {name for each in manoeuvres for name in (*stepped_controls(each), *_held(each))}
    return tuple(
        name
        for name in manoeuvres[0].extra_columns
        if is_surface(name)
        and name not in stepped
        and any(_bend(_samples(each, name)) > SMOOTH.bend for each in manoeuvres)
    )


def smoothed(manoeuvre: Manoeuvre, controls: Sequence[str]) -> Manoeuvre:
    """The manoeuvre with samples of controls between which lines contain what the smooth control does."""
    inputs = manoeuvre.flight.inputs.copy()
    for name in controls:
        inputs[:, manoeuvre.columns.index(name)] = samples_for_lines(_samples(manoeuvre, name))
    return replace(manoeuvre, flight=manoeuvre.flight._replace(inputs=inputs), smooth=tuple(controls))


def smoothly_late(effects: Sequence[ActiveEffect], controls: Sequence[str]) -> tuple[ActiveEffect, ...]:
    """Declared effects, held at their values, those by which controls are late acting as on smooth ones."""
    return tuple(
        frozen(
            ActiveEffect(LATE_KINDS[active.effect.kind](active.effect.where, is_smooth=True), active.held, active.log)
        )
        if active.effect.kind in LATE_KINDS and active.effect.where in controls
        else active
        for active in effects
    )


def _samples(manoeuvre: Manoeuvre, control: str) -> Array:
    return manoeuvre.flight.inputs[:, manoeuvre.columns.index(control)]


def _held(manoeuvre: Manoeuvre) -> tuple[str, ...]:
    return tuple(manoeuvre.columns[place] for place in manoeuvre.flight.held)


def _bend(values: Array) -> float:
    """Distance between curve and line mid-interval, an eighth of the second difference, over the deviation, 1."""
    size = float(np.std(values))
    return float(np.std(np.diff(values, 2))) / (8.0 * size) if size > 0.0 else 0.0


def notes_on_smooth_controls(manoeuvre: Manoeuvre) -> tuple[str, ...]:
    """A remark on the controls of a manoeuvre that are smooth between samples; all flights of a loop have the same."""
    if not manoeuvre.smooth:
        return ()
    note = (
        f"{listed(manoeuvre.smooth)}: smooth between samples, as behind the filter of a recorder, which is likelier "
        "than linear. The samples that the simulation takes are corrected for it."
    )
    return (note,)
