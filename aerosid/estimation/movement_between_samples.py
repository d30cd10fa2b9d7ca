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
    time, columns = manoeuvre.flight.time, list(manoeuvre.columns)
    surfaces = [name for name in manoeuvre.extra_columns if is_surface(name)]
    levels = manoeuvre.flight.inputs[:, [columns.index(name) for name in surfaces]]
    speed = manoeuvre.measured("V") if "V" in manoeuvre.outputs else np.full(time.size, manoeuvre.mean_airspeed)
    moving, rates = (
        [manoeuvre.measured(name) for name in names if name in manoeuvre.outputs]
        for names in (("alpha", "beta", *RATES), RATES)
    )
    if not rates:
        return None

    squared = (speed / manoeuvre.mean_airspeed) ** 2
    scale = 0.5 * np.diff(time) * (squared[1:] + squared[:-1])
    answers = np.column_stack([np.diff(rate) / scale for rate in rates])
    regressors = _regressors(moving, levels)
    there = np.isfinite(regressors).all(axis=1) & np.isfinite(answers).all(axis=1)
    regressors, answers = regressors[there], answers[there]
    if len(answers) < 2 * regressors.shape[1]:
        return None

    inverse = np.linalg.pinv(regressors)
    found = inverse @ answers
    deviations = np.std(answers - regressors @ found, axis=0)
    errors = deviations * np.sqrt(np.sum(inverse**2, axis=1))[:, None]
    movements, count = [], len(surfaces)
    for place in (surfaces.index(name) for name in controls):
        level, now, before = (len(moving) + place + k * count for k in range(3))
        for moment, error in zip(found.T, errors.T, strict=True):
            if abs(moment[level]) > least_ratio * error[level]:
                sizes = error[[now, before]] / abs(moment[level])
                movements.append(
                    Movement(moment[now] / moment[level], sizes[0], moment[before] / moment[level], sizes[1])
                )
    return pooled(movements) if movements else None


def _regressors(moving: Sequence[Array], levels: Array) -> Array:
    """Columns (N - 1, P): the motion, the control levels (N, E), their steps now and before, and the polynomial."""
    linear = [*(0.5 * (values[1:] + values[:-1]) for values in moving), *levels[:-1].T]
    steps = np.diff(levels, axis=0)
    earlier = np.vstack([np.zeros_like(steps[:1]), steps[:-1]])
    scaled = [values / (np.nanmax(np.abs(values)) or 1.0) for values in linear]
    products = [one * two for one, two in combinations_with_replacement(scaled, 2)]
    return np.column_stack([*linear, steps, earlier, np.ones(len(steps)), *products])


def pooled(movements: Sequence[Movement]) -> Movement:
    """The mean of at least one movement, weighted by the inverse of their variances."""
    parts = np.array([[each.now, each.before] for each in movements])
    weights = np.array([[each.now_error, each.before_error] for each in movements]) ** -2.0
    now, before = (weights * parts).sum(axis=0) / weights.sum(axis=0)
    now_error, before_error = weights.sum(axis=0) ** -0.5
    return Movement(float(now), float(now_error), float(before), float(before_error))
