"""Running integral of a sampled signal to fourth order, and derivative by the interpolating cubic spline."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgtsv

from aerosid.compiled import njit, njit_inline

Array = NDArray[np.float64]

FEWEST = 4
"""Numerical: samples from which on a cubic passes through four neighbours."""


def running_integral(values: Array, interval: float) -> Array:
    """The integral from the first sample to each sample, (N, ...), unit s.

    Parameters
    ----------
    values : ndarray, shape (N, ...)
        Samples at a constant `interval`, s.

    Notes
    -----
    Each interval has the integral of the cubic through its own two samples and one on either side: weights
    (-1, 13, 13, -1)/24, at the ends (9, 19, -5, 1)/24. Abramowitz & Stegun, Handbook of Mathematical Functions, 25.4.
    """
    count = values.shape[0]
    columns = np.ascontiguousarray(values, dtype=np.float64).reshape(count, -1)
    return np.asarray(_summed(columns, float(interval)).reshape(values.shape))


@njit
def _summed(values: Array, interval: float) -> Array:
    """As `running_integral`, of columns (N, C)."""
    total = np.empty(values.shape)
    for c in range(values.shape[1]):
        summed_up(values[:, c], interval, total[:, c])
    return total


@njit_inline
def summed_up(values: Array, interval: float, total: Array) -> None:
    """As `running_integral`, of one signal (N,), written to `total`."""
    count = values.shape[0]
    total[0] = 0.0
    for n in range(1, count):
        if count < FEWEST:
            piece = 0.5 * interval * (values[n] + values[n - 1])
        elif n == 1:
            piece = (9.0 * values[0] + 19.0 * values[1] - 5.0 * values[2] + values[3]) / 24.0 * interval
        elif n == count - 1:
            ends = 9.0 * values[n] + 19.0 * values[n - 1] - 5.0 * values[n - 2] + values[n - 3]
            piece = ends / 24.0 * interval
        else:
            inner = 13.0 * (values[n - 1] + values[n]) - values[n - 2] - values[n + 1]
            piece = inner / 24.0 * interval
        total[n] = total[n - 1] + piece


def derivative(values: Array, interval: float) -> Array:
    """The derivative at each sample, (N,), of the cubic spline through all of them, unit/s.

    Notes
    -----
    Second derivatives that agree at the knots, s[n-1] + 4 s[n] + s[n+1] = 3 (y[n+1] - y[n-1])/h, and third ones that
    agree at the second and the last but one: s[0] + 2 s[1] = (5 d[0] + d[1])/2 with d[n] = (y[n+1] - y[n])/h, and the
    mirror image (de Boor, A Practical Guide to Splines, chapter IV, "not a knot").
    """
    if values.size < FEWEST:
        return np.asarray(np.gradient(values, interval))
    slopes = np.diff(values) / interval
    lower, diagonal, upper = np.ones(values.size - 1), np.full(values.size, 4.0), np.ones(values.size - 1)
    diagonal[0] = diagonal[-1] = 1.0
    upper[0] = lower[-1] = 2.0
    right = np.empty(values.size)
    right[1:-1] = 3.0 * (slopes[1:] + slopes[:-1])
    right[0] = 0.5 * (5.0 * slopes[0] + slopes[1])
    right[-1] = 0.5 * (5.0 * slopes[-1] + slopes[-2])
    return np.asarray(dgtsv(lower, diagonal, upper, right)[3])


_POLE = np.sqrt(3.0) - 2.0
"""Of the spline's recursion."""

_LINEAR = -3.0 * _POLE ** np.abs(np.arange(-10, 11)) / (2.0 * np.sqrt(3.0))
_LINEAR[10] += 1.5
"""Weights of s in f; the next is below 2e-6."""


def linear_as_differentiated(values: Array) -> Array:
    """Result of `derivative` for an integral whose integrand is linear between samples, (N, ...).

    Parameters
    ----------
    values : ndarray, shape (N, ...)
        Samples of the integrand at a constant interval.

    Notes
    -----
    The spline's slopes s at the samples of p obey  s[k-1] + 4 s[k] + s[k+1] = 3 (p[k+1] - p[k-1])/h  (de Boor, A
    Practical Guide to Splines, chapter IV). With p' = f smooth, Simpson's rule makes the right-hand side f[k-1] + 4
    f[k] + f[k+1], and the slope is f itself. Where f is linear between samples, as a recorded control is held to be,
    the trapezoidal rule is exact and makes it 3/2 (f[k-1] + 2 f[k] + f[k+1]): the slopes are s = (3/2) f - 3 g with
    g[k-1] + 4 g[k] + g[k+1] = f[k], smaller by 2 % at a twelfth of the sampling frequency and by 25 % at a quarter of
    it. Ends are continued by their values.
    """
    columns = np.ascontiguousarray(values, dtype=np.float64).reshape(values.shape[0], -1)
    shown = np.column_stack([derivative_of_linear(np.ascontiguousarray(column)) for column in columns.T])
    return shown.reshape(values.shape)


@njit
def derivative_of_linear(values: Array) -> Array:
    """As `linear_as_differentiated`, of one series (N,)."""
    samples, reach = values.shape[0], _LINEAR.shape[0] // 2
    held = np.empty(samples + 2 * reach)
    shown = np.empty(samples)
    for n in range(held.shape[0]):
        held[n] = values[min(max(n - reach, 0), samples - 1)]
    for n in range(samples):
        shown[n] = _LINEAR[reach] * values[n]
    for k in range(1, reach + 1):
        weight = _LINEAR[reach + k]
        for n in range(samples):
            shown[n] += weight * (held[n + reach - k] + held[n + reach + k])
    return shown
