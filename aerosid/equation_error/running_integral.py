"""Running integral of a sampled signal to fourth order, and derivative by the interpolating cubic spline."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

FEWEST = 4
"""Numerical: samples from which on a cubic goes through four neighbours."""


def running_integral(values: Array, interval: float) -> Array:
    """The integral from the first sample to each sample, (N, ...), unit s.

    Parameters
    ----------
    values : ndarray, shape (N, ...)
        Samples at a constant `interval`, s.

    Notes
    -----
    Each interval takes the integral of the cubic through its own two samples and one on either side: weights
    (-1, 13, 13, -1)/24, at the ends (9, 19, -5, 1)/24. Abramowitz & Stegun, Handbook of Mathematical Functions, 25.4.
    """
    total = np.zeros_like(values)
    if values.shape[0] < FEWEST:
        total[1:] = np.cumsum(0.5 * interval * (values[1:] + values[:-1]), axis=0)
        return total
    pieces = np.empty_like(values[1:])
    pieces[1:-1] = (13.0 * (values[1:-2] + values[2:-1]) - values[:-3] - values[3:]) / 24.0
    pieces[0] = (9.0 * values[0] + 19.0 * values[1] - 5.0 * values[2] + values[3]) / 24.0
    pieces[-1] = (9.0 * values[-1] + 19.0 * values[-2] - 5.0 * values[-3] + values[-4]) / 24.0
    np.cumsum(interval * pieces, axis=0, out=total[1:])
    return total


def derivative(values: Array, interval: float) -> Array:
    """The derivative at each sample, (N,), of the cubic spline through all of them, unit/s."""
    if values.size < FEWEST:
        return np.asarray(np.gradient(values, interval))
    return np.asarray(CubicSpline(interval * np.arange(values.size), values)(interval * np.arange(values.size), 1))
