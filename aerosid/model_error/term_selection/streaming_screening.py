"""Recursive partial correlation in coloured noise: the screening of candidates, one sample at a time.

Weighted least squares over several equations and sums of products at lags 0 .. L are all that the regression, every
partial correlation and its deviation in coloured noise need. Nothing of the past is kept but L samples, no sample is
looked at twice, and the set of known columns may differ at every evaluation. The estimates are not whitened: in
flight the columns are formed on noisy states, and a whitening filter would leave little but that noise of them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from aerosid.errors import UsageError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ScreeningSettings:
    """Settings of the streaming screening.

    Attributes
    ----------
    lags : int
        L, samples for which noise may remember; tapered to zero there (Bartlett), so that no variance becomes negative.
    fewest : int
        Samples beyond the number of columns before any evaluation: deviations of shorter records are too small.
    weightings : int
        Rounds in which each equation's weight is taken from its residual.
    least_independence : float
        Share of a candidate's squares that the known columns must leave, in [0, 1).
    """

    lags: int = 10
    fewest: int = 15
    weightings: int = 2
    least_independence: float = 1e-4


@dataclass(frozen=True)
class Screened:
    """What the samples so far say, one row a column in the order of the samples' columns.

    Attributes
    ----------
    coefficients, deviations : (K,) arrays
        Of the known columns; NaN elsewhere and until they are determined.
    correlation, ratio, p_value : (K,) arrays
        Partial correlation of each other column with the target of the equation in which it acts most, t-ratio of its
        coefficient beside the known ones, and
        the p-value of that; 0, 0 and 1 for known columns and until there are enough samples.
    """

    coefficients: Array
    deviations: Array
    correlation: Array
    ratio: Array
    p_value: Array


class StreamingScreening:
    """Partial correlations with the targets of several equations, updated by each sample.

    Parameters
    ----------
    columns : int
        K.
    equations : int
        With a residual of its own size and colour each; coefficients are common to all.
    settings : ScreeningSettings, optional

    Raises
    ------
    UsageError
        Where a number of columns or equations is below one.
    """

    def __init__(self, columns: int, equations: int = 1, *, settings: ScreeningSettings | None = None) -> None:
        if columns < 1 or equations < 1:
            raise UsageError(f"{columns} columns of {equations} equations were asked for; give one or more of each.")
        self._settings = settings or ScreeningSettings()
        self._width, self._equations = 1 + columns, equations
        self._products = np.zeros((equations, self._settings.lags + 1, self._width, self._width))
        self._past: deque[Array] = deque(maxlen=self._settings.lags + 1)
        self.samples = 0

    def update(self, targets: ArrayLike, columns: ArrayLike) -> None:
        """Take in one sample: targets (equations,) and columns (equations, K); skipped where one is not finite."""
        rows = np.column_stack([np.atleast_1d(np.asarray(targets, dtype=np.float64)), np.atleast_2d(columns)])
        if rows.shape != (self._equations, self._width):
            raise UsageError(
                f"a sample has {rows.shape[0]} equations of {rows.shape[1] - 1} columns where {self._equations} of "
                f"{self._width - 1} were announced."
            )
        if not np.isfinite(rows).all():
            return
        self._past.appendleft(rows)
        for lag, before in enumerate(self._past):
            self._products[:, lag] += rows[:, :, None] * before[:, None, :]
        self.samples += 1

    def ask(self, known: Sequence[int], asked: int | None = None) -> Screened:
        """What the samples so far say where some columns are known to act.

        Parameters
        ----------
        known : sequence of int
            Columns of the structure.
        asked : int, optional
            Candidates that the p-values answer for; by default all other columns.

        Notes
        -----
        Deviations are those of Newey & West, Econometrica 55 (1987) 703-708, with the residual's autocovariances
        gamma_l and the columns' lagged products S_l averaged apart: A^-1 sum_l w_l gamma_l (S_l + S_l') A^-1.
        """
        count = self._width - 1
        coefficients, deviations = np.full(count, np.nan), np.full(count, np.nan)
        silent = Screened(coefficients, deviations, np.zeros(count), np.zeros(count), np.ones(count))
        places = np.array([1 + place for place in known], dtype=np.int64)
        freedom = self._equations * self.samples - places.size - 1
        if self.samples - places.size < self._settings.fewest:
            return silent
        scale = np.sqrt(np.einsum("eii->i", self._products[:, 0]))  # columns differ in units by many powers of ten
        scale[scale == 0.0] = 1.0
        lagged = self._products / np.outer(scale, scale)
        weights = np.ones(self._equations)
        for _ in range(self._settings.weightings + 1):
            normal = np.einsum("e,eij->ij", weights, lagged[:, 0])
            inverse = np.linalg.pinv(normal[np.ix_(places, places)], rcond=1e-12, hermitian=True)
            # What the known columns leave of the target and of each candidate, as combinations of all columns.
            left = np.eye(self._width)
            left[places] -= inverse @ normal[places]
            left[np.ix_(places, places)] = np.eye(places.size)
            away = left[:, 0]
            gamma = np.einsum("i,elij,j->el", away, lagged, away) / self.samples
            used, weights = weights, 1.0 / np.maximum(gamma[:, 0], np.finfo(float).tiny)
        middle = self._middle(lagged, gamma, used, freedom)
        others = np.setdiff1d(np.arange(1, self._width), places)
        asking = left[:, others]
        squares = np.einsum("ic,ij,jc->c", asking, normal, asking)
        noise = np.einsum("ic,ij,jc->c", asking, middle, asking)
        product = away @ normal @ asking
        apart = (squares > self._settings.least_independence * np.diag(normal)[others]) & (noise > 0.0)
        rho = np.where(apart, _in_own_equation(lagged[:, 0], away, asking), 0.0)
        ratio = np.divide(product, np.sqrt(np.where(apart, noise, 1.0)), out=np.zeros(others.size), where=apart)
        ratio = ratio / np.sqrt(np.maximum(1.0 - rho**2, np.finfo(float).tiny))  # it would leave less noise itself
        p_value = 2.0 * special.stdtr(self.samples, -np.abs(ratio)) * (others.size if asked is None else asked)
        silent.correlation[others - 1], silent.ratio[others - 1] = rho, ratio
        silent.p_value[others - 1] = np.where(apart, np.minimum(1.0, p_value), 1.0)
        variance = np.diag(inverse @ middle[np.ix_(places, places)] @ inverse)
        determined = (np.diag(inverse) > 0.0) & (variance > 0.0)
        units = scale[0] / scale[places]
        coefficients[places - 1] = np.where(determined, inverse @ normal[places, 0] * units, np.nan)
        deviations[places - 1] = np.where(determined, np.sqrt(np.maximum(variance, 0.0)) * units, np.nan)
        return silent

    def _middle(self, lagged: Array, gamma: Array, weights: Array, freedom: int) -> Array:
        """Sum over equations and lags of w^2 gamma_l (S_l + S_l'), tapered; on degrees of freedom."""
        taper = 1.0 - np.arange(gamma.shape[1]) / gamma.shape[1]
        taper[1:] *= 2.0
        scaled = weights[:, None] ** 2 * gamma * taper * (self._equations * self.samples / max(freedom, 1))
        total = np.einsum("el,elij->ij", scaled, lagged)
        return np.asarray(0.5 * (total + total.T))


def _in_own_equation(products: Array, away: Array, asking: Array) -> Array:
    """Correlation of what is left of target and candidates, each in the equation that holds most of its squares."""
    squares = np.einsum("ic,eij,jc->ec", asking, products, asking)
    shared = np.einsum("i,eij,jc->ec", away, products, asking)
    targets = np.einsum("i,eij,j->e", away, products, away)
    share = squares / np.maximum(targets, np.finfo(float).tiny)[:, None]
    own, places = np.argmax(share, axis=0), np.arange(asking.shape[1])
    size = np.sqrt(np.maximum(squares[own, places] * targets[own], 0.0))
    rho = np.divide(shared[own, places], size, out=np.zeros(size.size), where=size > 0.0)
    return np.asarray(np.clip(rho, -1.0, 1.0))
