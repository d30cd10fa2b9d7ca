"""When within a sampling interval a stepped control moves, from the change of the angular rates over that interval.

The moment that a control exerts while it moves is a spike of one interval in the angular acceleration; whatever the
declared model lacks, a term, a trim or a wind, changes it smoothly. No simulation and no structure is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.nomenclature import is_surface

RATES = ("p", "q", "r")
"""Angular rates that answer a control's moment at once."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Movement:
    """Parts of a control's step, 1, that act within an interval, each with its standard error.

    Attributes
    ----------
    now, now_error : float
        Mean part of the step between two samples that acts in that interval: 0 of a control that is held until the
        next sample, 1/2 of one that moves linearly.
    before, before_error : float
        Part of the step of the interval before that acts in this one beside the control's level: 0 of a control that
        moves between its samples, negative of one that is later than its record.
    """

    now: float
    now_error: float
    before: float
    before_error: float


def movement_between_samples(manoeuvre: Manoeuvre, controls: Sequence[str], least_ratio: float) -> Movement | None:
    """The movement of controls that share one interpolation; None where no measured rate answers them.

    A rate answers a control whose moment has a t-ratio of more than `least_ratio`.

    Notes
    -----
    Of every rate the change over an interval, divided by the interval and by the squared airspeed, is regressed by
    ordinary least squares on the control's level at the first of the two samples, on its change within this interval
    and the one before, and on the second-order polynomial of flow angles, rates and control levels in the middle of
    the interval, whose coefficients are of no interest. The ratio of the change's coefficient to the level's is the
    part sought; pairs of rate and control are weighted by the inverse of its variance.
    """
    pairs = []
    for rate in RATES:
        if rate in manoeuvre.outputs:
            pairs += _parts_in_rate(manoeuvre, rate, controls, least_ratio)
    if not pairs:
        return None
    return pooled([Movement(*now.tolist(), *before.tolist()) for now, before in pairs])


def pooled(movements: Sequence[Movement]) -> Movement:
    """The mean of at least one movement, weighted by the inverse of their variances."""
    parts = np.array([[each.now, each.before] for each in movements])
    weights = np.array([[each.now_error, each.before_error] for each in movements]) ** -2.0
    (now, before), (now_error, before_error) = (
        (weights * parts).sum(axis=0) / weights.sum(axis=0),
        weights.sum(0) ** -0.5,
    )
    return Movement(float(now), float(now_error), float(before), float(before_error))


def _parts_in_rate(
    manoeuvre: Manoeuvre, rate: str, controls: Sequence[str], least_ratio: float
) -> list[tuple[Array, Array]]:
    """Of each control that moves one rate: the part now and the part of the step before, each with standard error."""
    time, columns = manoeuvre.flight.time, list(manoeuvre.columns)
    surfaces = [name for name in manoeuvre.extra_columns if is_surface(name)]
    levels = manoeuvre.flight.inputs[:, [columns.index(name) for name in surfaces]]
    speed = manoeuvre.measured("V") if "V" in manoeuvre.outputs else np.full(time.size, manoeuvre.mean_airspeed)
    moving = [manoeuvre.measured(name) for name in ("alpha", "beta", *RATES) if name in manoeuvre.outputs]

    squared = (speed / manoeuvre.mean_airspeed) ** 2
    answer = 2.0 * np.diff(manoeuvre.measured(rate)) / np.diff(time) / (squared[1:] + squared[:-1])
    linear = [*(0.5 * (values[1:] + values[:-1]) for values in moving), *levels[:-1].T]
    steps = np.diff(levels, axis=0)
    earlier = np.vstack([np.zeros_like(steps[:1]), steps[:-1]])
    scaled = [values / (np.nanmax(np.abs(values)) or 1.0) for values in linear]
    products = [one * two for one, two in combinations_with_replacement(scaled, 2)]
    regressors = np.column_stack([*linear, steps, earlier, np.ones(answer.size), *products])
    there = np.isfinite(regressors).all(axis=1) & np.isfinite(answer)
    regressors, answer = regressors[there], answer[there]
    if answer.size < 2 * regressors.shape[1]:
        return []

    inverse = np.linalg.pinv(regressors)
    found = inverse @ answer
    deviation = float(np.std(answer - regressors @ found))
    errors = deviation * np.sqrt(np.sum(inverse**2, axis=1))
    parts = []
    for name in controls:
        level = len(moving) + surfaces.index(name)
        now, before = (len(linear) + surfaces.index(name) + k * len(surfaces) for k in (0, 1))
        if abs(found[level]) > least_ratio * errors[level]:
            ratios, sizes = found[[now, before]] / found[level], errors[[now, before]] / abs(found[level])
            parts.append((np.array([ratios[0], sizes[0]]), np.array([ratios[1], sizes[1]])))
    return parts
