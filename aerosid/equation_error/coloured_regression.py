"""Generalised least squares with autoregressive residuals, their colour shared by recordings, their size each its own.

The likelihood of a segment of n residuals e of size s and whitened by an autoregression of order p, stationary from the
first sample on, is  ln L = -n ln s - ln|L_p| - |w|^2/(2 s^2),  w the whitened residuals, L_p the Cholesky factor of the
first p samples' covariance for s = 1. Kay, Modern Spectral Estimation, chapters 6 and 7 (Burg's method, likelihood).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import toeplitz

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Colour:
    """An autoregression.

    Attributes
    ----------
    weights : ndarray, shape (p + 1,)
        Of the whitening filter, the first 1.
    start : ndarray, shape (p, p)
        Inverse of the Cholesky factor of the first p samples' covariance where the innovations have unit variance.
    """

    weights: Array
    start: Array

    def whitened(self, values: Array) -> Array:
        """Each column of (N, K) whitened, to innovations of the residuals' size."""
        order = self.start.shape[0]
        if order == 0:
            return values
        white = values.copy()
        for lag in range(1, order + 1):
            white[lag:] += self.weights[lag] * values[:-lag]
        white[:order] = self.start @ values[:order]
        return np.asarray(white)

    @property
    def log_start(self) -> float:
        """Logarithm of the determinant of the first samples' Cholesky factor."""
        return -float(np.sum(np.log(np.diag(self.start)))) if self.start.size else 0.0


def colour_of(weights: Array) -> Colour:
    """The colour of a stationary autoregression with these weights."""
    order = weights.size - 1
    if order == 0:
        return Colour(weights, np.zeros((0, 0)))
    factor = np.linalg.cholesky(toeplitz(_autocovariance(weights)))
    return Colour(weights, np.tril(np.linalg.inv(factor)))


def _autocovariance(weights: Array) -> Array:
    """Autocovariance at lags 0 to p - 1 of an autoregression with unit innovations (Yule and Walker's equations)."""
    order = weights.size - 1
    matrix = np.zeros((order + 1, order + 1))
    for k in range(order + 1):
        for j in range(order + 1):
            matrix[k, abs(k - j)] += weights[j]
    right = np.zeros(order + 1)
    right[0] = 1.0
    return np.asarray(np.linalg.solve(matrix, right)[:order])


def fit_colour(residuals: Sequence[Array], sizes: Sequence[float], order: int, longest: float) -> Colour:
    """The autoregression shared by several residuals, by Burg's method on all of them together.

    Parameters
    ----------
    residuals : sequence of ndarray, shape (N,)
        One a recording.
    sizes : sequence of float
        By which each is divided.
    order : int
        Samples; less where the records are short.
    longest : float
        Longest memory, samples, that a pole may have.
    """
    forward = [values / max(size, 1e-300) for values, size in zip(residuals, sizes, strict=True)]
    forward = [values for values in forward if values.size > 4 * order]
    weights = np.ones(1)
    backward = [values.copy() for values in forward]
    for _ in range(order if forward else 0):
        ahead = [f[1:] for f in forward]
        behind = [b[:-1] for b in backward]
        top = sum(float(f @ b) for f, b in zip(ahead, behind, strict=True))
        bottom = sum(float(f @ f + b @ b) for f, b in zip(ahead, behind, strict=True))
        if bottom <= 0.0:
            break
        reflection = -2.0 * top / bottom
        forward = [f + reflection * b for f, b in zip(ahead, behind, strict=True)]
        backward = [b + reflection * f for f, b in zip(ahead, behind, strict=True)]
        extended = np.append(weights, 0.0)
        weights = extended + reflection * extended[::-1]
    return colour_of(_shortened(weights, longest))


def _shortened(weights: Array, longest: float) -> Array:
    """The weights with poles of longer memory drawn in to that memory."""
    if weights.size < 2:
        return weights
    poles = np.roots(weights)
    radius = np.abs(poles)
    limit = min(float(np.exp(-1.0 / longest)), 0.999)
    if (radius <= limit).all():
        return weights
    poles = np.where(radius > limit, poles * (limit / np.maximum(radius, 1e-12)), poles)
    return np.asarray(np.real(np.poly(poles)))
