"""Autoregressive noise models from autocovariances: order by Akaike's criterion, Levinson's recursion, all lags."""

from __future__ import annotations

import math
from operator import mul

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.signals.noise import autocovariance
from aerosid.signals.settings import COLOUR

FloatArray = NDArray[np.float64]


def known_lags(measured: FloatArray, mask: NDArray[np.bool_]) -> FloatArray:
    """A measured autocovariance (K,), lags from 0, NaN at the lags at which no two samples of the mask are there."""
    if np.all(measured):  # `autocovariance` gives 0 there
        return measured
    pairs = autocovariance(np.where(mask, 1.0, np.nan), measured.size - 1)
    return np.where(pairs > 0.0, measured, np.nan)


def akaike_order(measured: FloatArray, count: int) -> int:
    """The autoregressive order that the corrected Akaike criterion chooses, 0 for white residuals."""
    highest = min(COLOUR.highest_order, count // 20, measured.size - 1)
    if measured[0] <= 0.0:
        return 0
    criteria = []
    known = np.cumsum(np.isfinite(measured[: highest + 1])).tolist()
    for parameters, innovation in zip(known, levinson(measured, highest)[1], strict=True):
        penalty = 2.0 * parameters * count / max(count - parameters - 1, 1)
        criteria.append(count * np.log(max(innovation, np.finfo(float).tiny)) + penalty)
    return int(np.argmin(criteria))


def levinson(gamma: FloatArray, order: int) -> tuple[FloatArray, list[float], FloatArray]:
    """Coefficients a of e_n = x_n - sum a_k x_(n-k), the variance of e, and the autocovariances of that process.

    The variance is given of every order from 0 on. A lag whose autocovariance is NaN tells nothing: it is as the
    shorter ones predict it.

    Reflections are held within their limit, so that the process is stationary whatever the given autocovariances are;
    the returned ones, lags 0 .. order, are its own and differ from the given where a reflection was held.
    """
    given: list[float] = gamma[: order + 1].tolist()  # of so few numbers plain ones are quicker than arrays
    innovation = max(given[0], 0.0)
    coefficients: list[float] = []
    consistent, innovations = [innovation], [innovation]
    for k in range(1, order + 1):
        if innovation <= 0.0:
            break
        predicted = sum(map(mul, coefficients, consistent[k - 1 : 0 : -1]))
        expected = sum(map(mul, coefficients, given[k - 1 : 0 : -1]))
        if not math.isfinite(given[k]):
            given[k] = expected
        reflection = (given[k] - expected) / innovation
        reflection = min(max(reflection, -COLOUR.most_reflection), COLOUR.most_reflection)
        consistent.append(predicted + reflection * innovation)
        coefficients = [
            *(one - reflection * other for one, other in zip(coefficients, coefficients[::-1], strict=True)),
            reflection,
        ]
        innovation *= 1.0 - reflection**2
        innovations.append(innovation)
    missing = order + 1 - len(innovations)
    return (
        np.array(coefficients + [0.0] * missing),
        innovations + [innovation] * missing,
        np.array(consistent + [0.0] * missing),
    )


def extended(model: FloatArray, leading: FloatArray, count: int) -> FloatArray:
    """Autocovariance, lags 0 .. count - 1, of the autoregressive process whose leading ones are given."""
    order = model.size
    gamma = np.zeros(max(count, order + 1))
    gamma[: order + 1] = leading
    if order > 0:
        _recurse_lags(model, gamma, order + 1)
    return gamma[:count]


@njit
def _recurse_lags(model: FloatArray, gamma: FloatArray, first: int) -> None:
    """gamma_k = sum_j a_j gamma_(k-j) from lag `first` on, in place."""
    for k in range(first, gamma.size):
        gamma[k] = 0.0
        for j in range(model.size):
            gamma[k] += model[j] * gamma[k - 1 - j]
