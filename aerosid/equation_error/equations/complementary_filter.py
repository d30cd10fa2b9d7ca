"""Complementary filter: high frequencies of the inertial path, low frequencies of the air sensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.signals.gaussian_filter import gaussian_filtered
from aerosid.signals.local_regression import locally_smoothed

Array = NDArray[np.float64]


def without_gusts(measured: Array, path: Array, samples: float) -> Array:
    """Paths with the wind's low-frequency drift, (K, N): smoothed difference of the measurement over scales of gusts.

    Constant beyond the ends, where a line would extrapolate the last gust out of the record.
    """
    left, drifting = _about_lines(measured, path)
    return np.asarray(drifting + gaussian_filtered(left, samples))


@njit
def _about_lines(measured: Array, path: Array) -> tuple[Array, Array]:
    """Detrended difference of measurement and paths, and the paths with that trend, (K, N) each."""
    left, drifting = np.empty(path.shape), np.empty(path.shape)
    count = path.shape[1]
    middle, square = 0.5 * (count - 1), count * (count * count - 1.0) / 12.0
    for k in range(path.shape[0]):
        total = along = 0.0
        for n in range(count):
            difference = measured[k, n] - path[k, n]
            total += difference
            along += (n - middle) * difference
        mean, slope = total / count, along / square
        for n in range(count):
            line = mean + (n - middle) * slope
            left[k, n] = measured[k, n] - path[k, n] - line
            drifting[k, n] = path[k, n] + line
    return left, drifting


def blended(measured: Array, path: Array, samples: float) -> Array:
    """Paths (..., N) plus the smoothed difference of the measurement; `samples`: deviation of the Gaussian."""
    if samples < 0.5:
        return measured
    return np.asarray(path + locally_smoothed(measured - path, samples))
