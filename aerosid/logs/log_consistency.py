"""Pairwise checks of channels for unit and sign, without an aircraft model."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from aerosid.logs.flight_log import FlightLog
from aerosid.logs.settings import COURSES
from aerosid.signals.running_trapezoids import integral_from_start

FloatArray = NDArray[np.float64]


def pitch_factor(log: FlightLog) -> float | None:
    """The factor between theta' and q cos(phi) - r sin(phi); None where the data cannot show it.

    Near 1 where units and signs are right. theta is compared with the integral of the rate, both detrended: the noise
    of theta would dominate its derivative.
    """
    if "theta" not in log or "q" not in log:
        return None
    zero = np.zeros(log.samples)
    phi, r = (log.channels.get(name, zero) for name in ("phi", "r"))
    rate = log["q"] * np.cos(phi) - r * np.sin(phi)
    there = np.isfinite(rate) & np.isfinite(log["theta"])
    if np.count_nonzero(there) < COURSES.fewest:
        return None
    time, rate, theta = log.time[there], rate[there], log["theta"][there]
    integral, theta = integral_and_recorded(time, rate, theta)
    power = float(integral @ integral) * float(theta @ theta)
    if power == 0.0 or abs(float(integral @ theta)) < COURSES.agreeing * math.sqrt(power):
        return None
    return float(integral @ theta) / float(integral @ integral)


def integral_and_recorded(time: FloatArray, rate: FloatArray, recorded: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The integral of a rate, and the recorded quantity that should follow it, each without its linear trend; (N,).

    Parameters
    ----------
    time : ndarray, shape (N,)
        Increasing, s.
    rate : ndarray, shape (N,)
        Finite, unit/s.
    recorded : ndarray, shape (N,)
        Finite; in any unit.
    """
    integral = integral_from_start(time, rate)
    trend = np.column_stack([np.ones_like(time), time - time.mean()])
    both = np.column_stack([integral, recorded])
    first, second = (both - trend @ np.linalg.lstsq(trend, both, rcond=None)[0]).T
    return first, second


def answer_to_elevator(log: FlightLog) -> float | None:
    """Correlation of the changes of pitch acceleration with those of the elevator; None where the data cannot show it.

    Over windows of 0.2 s, long compared with the noise and short compared with the response in alpha, an elevator of
    the right sign gives a negative correlation.
    """
    if "delta_e" not in log or "q" not in log:
        return None
    there = np.isfinite(log["delta_e"]) & np.isfinite(log["q"])
    window = max(1, round(COURSES.window / log.interval))
    if np.count_nonzero(there) < COURSES.fewest + 2 * window:
        return None
    elevator, q = log["delta_e"][there], log["q"][there]
    total = np.concatenate([[0.0], np.cumsum(0.5 * (elevator[1:] + elevator[:-1]))])
    mean = np.diff((total[window:] - total[:-window]) / window)
    acceleration = np.diff(q[window:] - q[:-window])
    if np.std(mean) == 0.0 or np.std(acceleration) == 0.0:
        return None
    return float(np.corrcoef(mean, acceleration)[0, 1])
