"""Fit statistics of a simulated channel: Theil's inequality coefficient, explained variance, whiteness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from aerosid.signals.noise import autocovariance
from aerosid.signals.settings import WHITENESS


@dataclass(frozen=True)
class Theil:
    """Theil's inequality coefficient and the shares of the mean square error that add up to one.

    `coefficient` 0 is a perfect fit, 1 the worst; below 0.25 to 0.3 is usually called good. `bias` the share of a
    difference of means, `variance` that of a difference of spreads, `covariance` what no shift or scale removes.
    """

    coefficient: float
    bias: float
    variance: float
    covariance: float


def theil(measured: NDArray[np.float64], simulated: NDArray[np.float64]) -> Theil | None:
    """Theil's inequality coefficient of two series (N,); None where they hold no common sample or no error.

    Notes
    -----
    U = sqrt(mean (z - y)^2) / (sqrt(mean z^2) + sqrt(mean y^2)). Jategaonkar, Flight Vehicle System Identification,
    2nd ed., AIAA 2015, section 11.2.3.
    """
    present = np.isfinite(measured) & np.isfinite(simulated)
    z, y = measured[present], simulated[present]
    square = float(np.mean((z - y) ** 2)) if z.size else 0.0
    if square == 0.0:
        return None
    size = float(np.sqrt(np.mean(z**2)) + np.sqrt(np.mean(y**2)))
    spread_z, spread_y = float(np.std(z)), float(np.std(y))
    together = float(np.mean((z - z.mean()) * (y - y.mean())))
    return Theil(
        coefficient=float(np.sqrt(square)) / size,
        bias=float((z.mean() - y.mean()) ** 2) / square,
        variance=(spread_z - spread_y) ** 2 / square,
        covariance=2.0 * (spread_z * spread_y - together) / square,
    )


def explained_variance(measured: NDArray[np.float64], simulated: NDArray[np.float64]) -> float | None:
    """R^2 of a simulated channel: 1 - mean square error / variance of the measurement; None where it does not vary."""
    present = np.isfinite(measured) & np.isfinite(simulated)
    variance = float(np.var(measured[present])) if present.any() else 0.0
    return 1.0 - float(np.mean((measured - simulated)[present] ** 2)) / variance if variance > 0.0 else None


@dataclass(frozen=True)
class Whiteness:
    """Autocorrelation of a residual, and Ljung and Box's test of it.

    `autocorrelation` at lags from 0; `statistic` and `p_value` of Ljung and Box's test: the chance that white noise
    repeats itself as much.
    """

    autocorrelation: NDArray[np.float64]
    statistic: float
    p_value: float


def whiteness(residual: NDArray[np.float64]) -> Whiteness | None:
    """Ljung and Box's test on a residual (N,), NaN where missing; None where it holds too little.

    Notes
    -----
    Q = n (n + 2) sum rho_k^2 / (n - k), chi-square with as many degrees of freedom as lags where the residual is
    white. Ljung & Box, Biometrika 65 (2), 1978.
    """
    count = int(np.isfinite(residual).sum())
    lags = min(WHITENESS.lags, count // 5)
    if lags < 1:
        return None
    gamma = autocovariance(residual, lags)
    if gamma[0] <= 0.0:
        return None
    rho = gamma / gamma[0]
    statistic = count * (count + 2.0) * float(np.sum(rho[1:] ** 2 / (count - np.arange(1, lags + 1))))
    return Whiteness(rho, statistic, float(chdtrc(lags, statistic)))


def is_coloured(residual: NDArray[np.float64]) -> bool:
    """Whether a residual (N,) repeats itself, slowly or swinging, by Ljung and Box's test."""
    found = whiteness(residual)
    return found is not None and found.p_value < WHITENESS.doubt


def noise_memories(time: NDArray[np.float64], residuals: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of each sample of a sensor's own noise is left in the next one, (C,).

    Parameters
    ----------
    time : ndarray, shape (N,)
        s.
    residuals : ndarray, shape (N, C)
        Of the channels of one log, NaN where missing.

    Returns
    -------
    NaN for a channel whose residual may be more than noise of its own: where a first-order memory, below
    the longest of the settings, does not leave it white, or where it goes along with another channel's. A wrong model
    moves every channel, and slowly.
    """
    interval = float(np.median(np.diff(time)))
    count = residuals.shape[1]
    memories = np.full(count, np.nan)
    left = np.full(residuals.shape, np.nan)
    for i in range(count):
        gamma = autocovariance(residuals[:, i], 1)
        if np.isfinite(residuals[:, i]).sum() < 50 or gamma[0] <= 0.0:
            continue
        memory = float(gamma[1] / gamma[0])
        left[1:, i] = residuals[1:, i] - memory * residuals[:-1, i]
        found = whiteness(left[:, i])
        short = memory < float(np.exp(-interval / WHITENESS.longest_memory))
        if found is not None and found.p_value > WHITENESS.doubt and short:
            memories[i] = memory
    return np.where(_goes_along(left), np.nan, memories)


def _goes_along(series: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each of several white series (N, C) is correlated with any other, at once or a few samples apart."""
    count = series.shape[1]
    known = np.isfinite(series)
    values = np.where(known, series, 0.0)
    size = np.sqrt(np.sum(values**2, axis=0) / np.maximum(known.sum(axis=0), 1))
    unit = values / np.where(size > 0.0, size, 1.0)
    pairs = max(count * (count - 1) // 2, 1) * (2 * WHITENESS.neighbours + 1)
    limit = float(-ndtri(0.5 * WHITENESS.doubt / pairs))
    along = np.zeros(count, dtype=np.bool_)
    for shift in range(WHITENESS.neighbours + 1):
        later, earlier = slice(shift, None), slice(None, unit.shape[0] - shift)
        common = known[later].astype(np.float64).T @ known[earlier].astype(np.float64)
        score = np.abs(unit[later].T @ unit[earlier]) / np.sqrt(np.maximum(common, 1.0))
        np.fill_diagonal(score, 0.0)
        beyond = score > limit
        along |= beyond.any(axis=0) | beyond.any(axis=1)
    return along
