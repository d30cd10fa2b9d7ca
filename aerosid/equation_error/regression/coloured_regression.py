"""Generalised least squares with autoregressive residuals, the colour shared by records, the size individual.

The likelihood of a segment of n residuals e of size s and whitened by an autoregression of order p, stationary from the
first sample on, is  ln L = -n ln s - ln|L_p| - |w|^2/(2 s^2),  w the whitened residuals, L_p the Cholesky factor of the
first p samples' covariance for s = 1. Kay, Modern Spectral Estimation, chapters 6 and 7 (Burg's method, likelihood).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgeqrf, dorgqr

from aerosid.compiled import njit, njit_inline
from aerosid.signals.array_elements import copy_row

Array = NDArray[np.float64]

COLOUR_ROUNDS = 3
"""Numerical: times that a shared colour is estimated, each with the innovations' sizes of the one before."""

SAME_SIZES = 0.1
"""Numerical: fractional change of their ratios below which that ends."""


@dataclass(frozen=True)
class Colour:
    """An autoregression.

    Attributes
    ----------
    weights : ndarray, shape (p + 1,)
        Of the whitening filter, the first 1.
    start : ndarray, shape (p, p)
        Inverse of the Cholesky factor of the first p samples' covariance for innovations of unit variance.
    """

    weights: Array
    start: Array
    _bases: list[tuple[Array, Array]] = field(default_factory=list, init=False, repr=False, compare=False)

    def whitened_basis(self, columns: Array) -> Array:
        """Orthonormal basis (N, K) of some columns after whitening; computed once for each array."""
        for known, basis in self._bases:
            if known is columns:
                return basis
        basis = _orthonormal(self.whitened(columns))
        self._bases.append((columns, basis))
        return basis

    def whitened(self, values: Array) -> Array:
        """Each column of (N, K) whitened, to innovations of the residuals' size."""
        order = self.start.shape[0]
        if order == 0:
            return values
        white = _filtered(np.ascontiguousarray(values), self.weights)
        white[:order] = self.start @ values[:order]
        return white

    @cached_property
    def log_start(self) -> float:
        """Logarithm of the determinant of the first samples' Cholesky factor."""
        return -float(np.sum(np.log(np.diag(self.start)))) if self.start.size else 0.0


@njit
def _filtered(values: Array, weights: Array) -> Array:
    """Each column of (N, K) less its linear prediction from the samples before."""
    filtered = values.copy()
    for lag in range(1, weights.shape[0]):
        for n in range(lag, values.shape[0]):
            for k in range(values.shape[1]):
                filtered[n, k] += weights[lag] * values[n - lag, k]
    return filtered


def _orthonormal(columns: Array) -> Array:
    """Orthonormal basis of some independent columns (N, K), by Householder's reflections."""
    reflections, factors, _, _ = dgeqrf(columns)
    return np.ascontiguousarray(dorgqr(reflections, factors)[0])


@njit
def whitened_segments(
    values: Array, bounds: NDArray[np.int64], weights: Array, starts: Array, orders: NDArray[np.int64], sizes: Array
) -> Array:
    """Segments of columns (R, K), each whitened by its own colour and divided by its own size.

    Parameters
    ----------
    bounds : int64[S + 1]
        First row of each segment.
    weights : float64[S, p + 1]
    starts : float64[S, p, p]
        Of each segment's colour, the first `orders` + 1 and `orders` of them.
    sizes : float64[S]
    """
    white = np.empty(values.shape)
    columns = values.shape[1]
    for s in range(sizes.shape[0]):
        begin, order, share = bounds[s], orders[s], 1.0 / sizes[s]
        for n in range(begin, bounds[s + 1]):
            before = n - begin
            for k in range(columns):
                white[n, k] = 0.0 if before < order else values[n, k]
            if before < order:
                for j in range(min(order, bounds[s + 1] - begin)):
                    weight = starts[s, before, j]
                    for k in range(columns):
                        white[n, k] += weight * values[begin + j, k]
            else:
                for lag in range(1, order + 1):
                    weight = weights[s, lag]
                    for k in range(columns):
                        white[n, k] += weight * values[n - lag, k]
            for k in range(columns):
                white[n, k] *= share
    return white


def colour_of(weights: Array) -> Colour:
    """The colour of a stationary autoregression with these weights.

    Notes
    -----
    Step down of Levinson's recursion: order k - 1 follows from order k with its reflection coefficient r = a_k[k],
    a_(k-1)[j] = (a_k[j] - r a_k[k - j])/(1 - r^2), its error's variance is that of order k over 1 - r^2. Sample n < p,
    less its prediction from those before it, has the variance of order n: the rows of the inverse Cholesky factor.
    """
    return Colour(weights, _inverse_factor(weights))


@njit
def _inverse_factor(weights: Array) -> Array:
    """Inverse of the Cholesky factor of the first samples' covariance, (p, p)."""
    order = weights.shape[0] - 1
    start = np.zeros((order, order))
    lower, variance = weights.copy(), 1.0
    for k in range(order, 0, -1):
        variance /= 1.0 - lower[k] * lower[k]
        _step_down(lower, k)
        for j in range(k):
            start[k - 1, j] = lower[k - 1 - j] / np.sqrt(variance)
    return start


@njit_inline
def _step_down(weights: Array, order: int) -> None:
    """The first `order` weights become those of the autoregression of one order less, by its reflection coefficient."""
    reflection = weights[order]
    rest = 1.0 - reflection * reflection
    for j in range((order + 1) // 2):
        ahead, behind = weights[j], weights[order - j]
        weights[j] = (ahead - reflection * behind) / rest
        if order - j != order:
            weights[order - j] = (behind - reflection * ahead) / rest
    if order % 2 == 0:
        middle = weights[order // 2]
        weights[order // 2] = (middle - reflection * middle) / rest


@njit
def _burg(values: Array, bounds: NDArray[np.int64], sizes: Array, order: int, limit: float) -> tuple[Array, bool]:
    """Weights of the autoregression shared by parts of `values` (R,), and whether its poles lie within `limit`."""
    ahead, behind = np.zeros(values.shape[0]), np.zeros(values.shape[0])
    weights = np.zeros(order + 1)
    weights[0] = 1.0
    before = weights.copy()
    reached = 0
    for s in range(sizes.shape[0]):
        for n in range(bounds[s], bounds[s + 1]):
            ahead[n] = values[n] / max(sizes[s], 1e-300)
            behind[n] = ahead[n]
    for k in range(1, order + 1):
        top = bottom = 0.0
        for s in range(sizes.shape[0]):
            if bounds[s + 1] - bounds[s] > 4 * order:
                for n in range(bounds[s] + k, bounds[s + 1]):
                    top += ahead[n] * behind[n - 1]
                    bottom += ahead[n] * ahead[n] + behind[n - 1] * behind[n - 1]
        if bottom <= 0.0:
            break
        reflection = -2.0 * top / bottom
        for s in range(sizes.shape[0]):
            for n in range(bounds[s + 1] - 1, bounds[s] + k - 1, -1):
                f, b = ahead[n], behind[n - 1]
                ahead[n], behind[n] = f + reflection * b, b + reflection * f
        copy_row(before, weights)
        for j in range(1, k + 1):
            weights[j] = before[j] + reflection * before[k - j]
        reached = k
    weights = weights[: reached + 1].copy()
    drawn = weights.copy()
    for j in range(1, reached + 1):
        drawn[j] = weights[j] / limit**j
    return weights, _lies_within(drawn)


@njit
def _shortened(weights: Array, limit: float) -> Array:
    """The weights with poles of longer memory moved inward to the circle of radius `limit`."""
    order = weights.shape[0] - 1
    companion = np.zeros((order, order), dtype=np.complex128)  # eigenvalues of real matrices would have to be real
    for k in range(order):
        companion[0, k] = -weights[k + 1]
        if k > 0:
            companion[k, k - 1] = 1.0
    poles = np.linalg.eigvals(companion)
    product = np.zeros(poles.size + 1, dtype=np.complex128)
    product[0] = 1.0
    for n in range(poles.size):
        pole, radius = poles[n], abs(poles[n])
        if radius > limit:
            pole *= limit / max(radius, 1e-12)
        for k in range(n + 1, 0, -1):
            product[k] -= pole * product[k - 1]
    return product.real.copy()


@njit_inline
def _lies_within(lower: Array) -> bool:
    """Whether all poles lie within the unit circle: all reflection coefficients do (Schur and Cohn's criterion).

    The weights are overwritten.
    """
    for k in range(lower.shape[0] - 1, 0, -1):
        if not abs(lower[k]) < 1.0:
            return False
        _step_down(lower, k)
    return True


@njit
def _innovations(
    values: Array, bounds: NDArray[np.int64], weights: Array, start: Array, floors: Array
) -> tuple[Array, Array, float]:
    """Parts of `values` (R,) whitened, their sizes (S,) and ln L without that of the first samples' colour."""
    order = weights.shape[0] - 1
    white, sizes, likelihood = values.copy(), np.zeros(floors.shape[0]), 0.0
    for s in range(floors.shape[0]):
        begin, end = bounds[s], bounds[s + 1]
        power = 0.0
        for n in range(begin, end):
            if n - begin < order:
                white[n] = 0.0
                for k in range(min(order, end - begin)):
                    white[n] += start[n - begin, k] * values[begin + k]
            else:
                for lag in range(1, order + 1):
                    white[n] += weights[lag] * values[n - lag]
            power += white[n] * white[n]
        sizes[s] = max(np.sqrt(power / (end - begin)), floors[s])
        likelihood -= (end - begin) * np.log(sizes[s]) + 0.5 * power / (sizes[s] * sizes[s])
    return white, sizes, likelihood


@njit
def likeliest_colour(
    values: Array, bounds: NDArray[np.int64], divisors: Array, floors: Array, order: int, limit: float
) -> tuple[Array, Array, Array, Array, float]:
    """The likeliest colour shared by parts of `values` (R,): weights, start, innovations, their sizes (S,), and ln L.

    Burg's method weights records by their divisors: with the sizes of their innovations it approximates maximum
    likelihood, and those are known once a colour is. Divided by its own size, a record with a step change has less
    weight than one without, and the shared colour becomes that of the quiet one.

    `divisors`: standard deviations to begin with; `floors`: least sizes; `limit`: largest radius of a pole.
    """
    weights, start, white, sizes = np.ones(1), np.zeros((0, 0)), values, divisors
    best = -np.inf
    for turn in range(COLOUR_ROUNDS):
        tried, is_within = _burg(values, bounds, divisors, order, limit)
        if not is_within:
            tried = _shortened(tried, limit)
        start_tried = _inverse_factor(tried)
        white_tried, sizes_tried, likelihood = _innovations(values, bounds, tried, start_tried, floors)
        likelihood += floors.size * np.sum(np.log(np.diag(start_tried)))
        if turn == 0 or likelihood > best:
            weights, start, white, sizes, best = tried, start_tried, white_tried, sizes_tried, likelihood
        ratios = sizes_tried / sizes_tried[0] / (divisors / divisors[0])
        if floors.size == 1 or np.all(np.abs(ratios - 1.0) <= SAME_SIZES):
            break
        divisors = sizes_tried
    return weights, start, white, sizes, best
