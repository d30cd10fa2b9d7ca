"""Correlation time of a first-order autoregression, and what it leaves of a series' samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WHITE, SLOW = 1e-3, 0.999
"""Numerical: least and largest correlation of neighbours from which a correlation time is computed."""


def correlation_time(values: Array, interval: float) -> float:
    """Time, s, in which the autocorrelation of values (N,) about zero falls by e, by that of neighbours."""
    neighbours = float(values[1:] @ values[:-1]) / max(float(values @ values), 1e-300)
    return -interval / float(np.log(np.clip(neighbours, WHITE, SLOW)))


def independent_squares(values: Array, interval: float) -> float:
    """Number of independent values whose mean square would scatter as that of values (N,) does.

    The square of an autocorrelation exp(-t/T) has an integral of T over both signs of t: one in T.
    """
    return values.size * interval / max(correlation_time(values, interval), interval)


def variance_of_mean(values: Array) -> float:
    """Variance of the mean of values (N,); a negative correlation of neighbours counts as none."""
    values = values - values.mean()
    neighbours = float(values[1:] @ values[:-1]) / max(float(values @ values), 1e-300)
    neighbours = float(np.clip(neighbours, 0.0, SLOW))
    inflated = (1.0 + neighbours) / (1.0 - neighbours)
    return float(np.var(values)) * min(inflated / values.size, 1.0)
