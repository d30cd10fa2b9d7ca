"""Restricted least squares: a regression's values with some of them fixed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def restricted_least_squares(
    values: NDArray[np.float64], covariance: NDArray[np.float64], fixed: Sequence[int], at: Sequence[float]
) -> NDArray[np.float64]:
    """A linear regression's values (K,) with some of them fixed at others.

    Parameters
    ----------
    values : ndarray, shape (K,)
        Estimated freely.
    covariance : ndarray, shape (K, K)
        Theirs.
    fixed : sequence of int
        Places of those that are fixed.
    at : sequence of float
        Where.

    Notes
    -----
    x_r + P_rf P_ff^-1 (at - x_f) of the rest r and the fixed f: Seber & Lee, Linear Regression Analysis, section 3.8.
    """
    places = list(fixed)
    away = np.asarray(at) - values[places]
    moved = values + covariance[:, places] @ np.linalg.lstsq(covariance[np.ix_(places, places)], away, rcond=None)[0]
    moved[places] = at
    return np.asarray(moved)
