"""Recursive least squares by Givens rotations, and collinearity of regressors.

The recursion carries the triangular factor of the information matrix and not its inverse: the covariance form loses
half of the digits where regressors nearly coincide, this one gives at the last sample what ordinary least squares by
orthogonal transformation gives. One kernel serves the batch and the streaming form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.signals.array_elements import copy_row

FloatArray = NDArray[np.float64]

# A triangular factor's diagonal below this share of its column's norm tells rounding from information no longer.
_UNDETERMINED = 1e-13
"""Numerical: diagonal of the triangular factor over its column, 1, up to which rounding alone makes it."""


@dataclass(frozen=True)
class RecursiveFit:
    """What recursive least squares knew after every sample, and at the end.

    Attributes
    ----------
    coefficients : (m,) array
        At the last sample; NaN where the record does not determine all of them.
    covariance : (m, m) array
        (X' W X + P0^-1)^-1 with the forgetting applied: the covariance of the coefficients where the weights are the
        inverse variances of the target. Where they are relative only, it is to be multiplied by `residual_variance`.
    residual_variance : float
        Weighted sum of squared residuals over the degrees of freedom; NaN where there are none.
    history : (N, m) array
        Coefficients after each sample; NaN until the samples so far determine all of them.
    variance_history : (N, m) array
        Diagonal of the covariance after each sample.
    residual_variance_history : (N,) array
        `residual_variance` after each sample.

    Of a fit that was asked for its end alone, N is 1.
    """

    coefficients: FloatArray
    covariance: FloatArray
    residual_variance: float
    history: FloatArray
    variance_history: FloatArray
    residual_variance_history: FloatArray

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors at the last sample for white residuals of unknown variance, (m,)."""
        return np.sqrt(np.diag(self.covariance) * self.residual_variance)

    @property
    def standard_error_history(self) -> FloatArray:
        """Standard errors after each sample for white residuals of unknown variance, (N, m)."""
        return np.sqrt(self.variance_history * self.residual_variance_history[:, None])


class RecursiveLeastSquares:
    """Least squares that takes one sample at a time, for use in flight; the same numbers as the batch form.

    Parameters
    ----------
    count : int
        Number of coefficients, m.
    forgetting : float
        Weight of the past after each sample, in (0, 1]; 1 keeps all.
    prior, covariance0
        As in `recursive_least_squares`.
    """

    def __init__(
        self,
        count: int,
        *,
        forgetting: float = 1.0,
        prior: FloatArray | None = None,
        covariance0: FloatArray | None = None,
    ) -> None:
        _check_forgetting(forgetting)
        self._forgetting = forgetting
        self._triangle, self._target = _prior_information(count, prior, covariance0)
        self._sums = np.array([0.0, 0.0 if covariance0 is None else float(count)])
        self._coefficients = np.full(count, np.nan)
        self._inverse = np.full((count, count), np.nan)
        _solve(self._triangle, self._target, self._inverse, self._coefficients)

    def update(self, regressor: FloatArray, target: float, weight: float = 1.0) -> None:
        """Take in one sample: regressor (m,), target and its weight; skipped where any of them is not finite."""
        row = np.array(regressor, dtype=np.float64)
        if row.shape != self._coefficients.shape:
            raise ValueError(f"the regressor has shape {row.shape}, expected {self._coefficients.shape}")
        _take_in(self._triangle, self._target, self._sums, row, float(target), float(weight), self._forgetting)
        _solve(self._triangle, self._target, self._inverse, self._coefficients)

    @property
    def coefficients(self) -> FloatArray:
        """The coefficients after the last sample, (m,); NaN until the samples determine all of them."""
        return self._coefficients.copy()

    @property
    def covariance(self) -> FloatArray:
        """As `RecursiveFit.covariance`, after the last sample, (m, m)."""
        return np.asarray(self._inverse @ self._inverse.T)

    @property
    def residual_variance(self) -> float:
        """As `RecursiveFit.residual_variance`, after the last sample."""
        return _variance(self._sums, self._coefficients.size)


def recursive_least_squares(
    regressors: FloatArray,
    target: FloatArray,
    *,
    forgetting: float = 1.0,
    prior: FloatArray | None = None,
    covariance0: FloatArray | None = None,
    weights: FloatArray | None = None,
    end_alone: bool = False,
) -> RecursiveFit:
    """The coefficients that explain the target by the regressors, after every sample.

    Parameters
    ----------
    regressors : (N, m) array
        One column a coefficient. Rows that hold a value that is not finite are skipped.
    target : (N,) array
        NaN where missing: the sample is skipped, the past keeps its weight.
    forgetting : float
        Weight of the past after each sample, in (0, 1]; 1 keeps all. 1/(1 - forgetting) samples are remembered.
    prior : (m,) array, optional
        A-priori coefficients; needs `covariance0`.
    covariance0 : (m, m) or (m,) array, optional
        A-priori covariance, or its diagonal; where absent nothing is known beforehand and the last sample gives
        ordinary least squares.
    weights : (N,) array, optional
        Non-negative weights of the samples, 1 by default; with a prior they must be inverse variances, for the prior
        counts in full.
    end_alone : bool
        Whether only what is known after the last sample is wanted: the same numbers for a fraction of the work.

    Raises
    ------
    ValueError
        Where shapes disagree, the forgetting is outside (0, 1], a weight is negative, a prior comes without its
        covariance or that covariance is not positive definite.

    Notes
    -----
    After sample j the coefficients a minimise
    (a - a0)' P0^-1 (a - a0) lambda^j + sum_i lambda^(j - i) w_i (y_i - x_i' a)^2.
    The rotation of a row into the triangular factor costs O(m^2), the covariance diagonal O(m^3/6), a sample.

    References
    ----------
    Bierman (1977), Factorization Methods for Discrete Sequential Estimation, ch. IV: square-root information filter,
    here with Givens rotations, which need no work space and take one row at a time.
    """
    matrix = np.ascontiguousarray(regressors, dtype=np.float64)
    values = np.ascontiguousarray(target, dtype=np.float64)
    if matrix.ndim != 2 or values.shape != matrix.shape[:1]:
        raise ValueError(f"regressors of shape {matrix.shape} and a target of shape {values.shape} do not match")
    _check_forgetting(forgetting)
    scale = np.ones(values.size) if weights is None else np.ascontiguousarray(weights, dtype=np.float64)
    if scale.shape != values.shape or np.any(scale < 0.0):
        raise ValueError(f"weights must be {values.size} numbers that are not negative")
    count = matrix.shape[1]
    triangle, rotated = _prior_information(count, prior, covariance0)
    sums = np.array([0.0, 0.0 if covariance0 is None else float(count)])
    told = min(1, values.size) if end_alone else values.size
    history = np.empty((told, count))
    variances = np.empty((told, count))
    residual_variances = np.empty(told)
    inverse = np.full((count, count), np.nan)
    coefficients = np.full(count, np.nan)
    _solve(triangle, rotated, inverse, coefficients)
    _recurse(
        matrix, values, scale, forgetting, triangle, rotated, sums,
        inverse, coefficients, history, variances, residual_variances,
    )  # fmt: skip
    return RecursiveFit(
        coefficients=coefficients,
        covariance=inverse @ inverse.T,
        residual_variance=_variance(sums, count),
        history=history,
        variance_history=variances,
        residual_variance_history=residual_variances,
    )


def condition_number(regressors: FloatArray) -> float:
    """The ratio of the largest to the smallest singular value of the regressors scaled to unit length each."""
    return float(np.linalg.cond(_unit_columns(regressors)))


def variance_inflation(regressors: FloatArray) -> FloatArray:
    """By how much collinearity raises each coefficient's variance, (m,), dimensionless, 1 where there is none.

    Notes
    -----
    1/(1 - R_j^2) with R_j^2 the share of regressor j that the others explain, about zero and not about the mean: a
    constant is a regressor like any other. Infinite for a regressor that the others explain within rounding.
    """
    unit = _unit_columns(regressors)
    triangle = np.linalg.qr(unit, mode="r")
    count = unit.shape[1]
    inverse = np.full((count, count), np.nan)
    coefficients = np.empty(count)
    _solve(np.ascontiguousarray(triangle), np.zeros(count), inverse, coefficients)
    factors = np.sum(inverse**2, axis=1)
    return np.where(np.isfinite(factors), factors, np.inf)


def correlation(covariance: FloatArray) -> FloatArray:
    """The correlation matrix of a covariance matrix, (m, m); 0 off the diagonal where a variance is zero."""
    deviations = np.sqrt(np.diag(covariance))
    scale = np.where(deviations > 0.0, deviations, 1.0)
    matrix = np.asarray(covariance / np.outer(scale, scale))
    np.fill_diagonal(matrix, 1.0)
    return matrix


def _unit_columns(regressors: FloatArray) -> FloatArray:
    """The complete rows of the regressors, each column scaled to unit length."""
    matrix = np.asarray(regressors, dtype=np.float64)
    matrix = matrix[np.all(np.isfinite(matrix), axis=1)]
    lengths = np.linalg.norm(matrix, axis=0)
    return np.asarray(matrix / np.where(lengths > 0.0, lengths, 1.0))


def _check_forgetting(forgetting: float) -> None:
    if not 0.0 < forgetting <= 1.0:
        raise ValueError(f"forgetting is {forgetting}, expected a number above 0 and at most 1")


def _prior_information(
    count: int, prior: FloatArray | None, covariance0: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Upper triangle R with R'R = P0^-1, and R a0; zeros where nothing is known."""
    if covariance0 is None:
        if prior is not None:
            raise ValueError("a prior needs its covariance0: without one it is not known how far it counts")
        return np.zeros((count, count)), np.zeros(count)
    covariance = np.asarray(covariance0, dtype=np.float64)
    covariance = np.diag(covariance) if covariance.ndim == 1 else covariance
    start = np.zeros(count) if prior is None else np.asarray(prior, dtype=np.float64)
    if covariance.shape != (count, count) or start.shape != (count,):
        raise ValueError(f"prior and covariance0 have shapes {start.shape} and {covariance.shape}, expected {count}")
    # Scaled to unit variances first: a-priori variances of coefficients differ by many powers of ten.
    deviations = np.sqrt(np.diag(covariance))
    try:
        factor = np.linalg.cholesky(covariance / np.outer(deviations, deviations))
    except np.linalg.LinAlgError:
        raise ValueError("covariance0 is not positive definite") from None
    information_root = np.linalg.solve(factor, np.diag(1.0 / deviations))
    triangle = np.ascontiguousarray(np.linalg.qr(information_root, mode="r"))
    return triangle, triangle @ start


def _variance(sums: FloatArray, count: int) -> float:
    """Residual sum of squares over the degrees of freedom."""
    freedom = sums[1] - count
    return float(sums[0] / freedom) if freedom > 1e-9 else math.nan


@njit
def _take_in(
    triangle: FloatArray,
    rotated: FloatArray,
    sums: FloatArray,
    row: FloatArray,
    value: float,
    weight: float,
    forgetting: float,
) -> bool:
    """Rotate one weighted row into the triangle, in place; False where the sample is skipped. `row` is consumed.

    `sums` holds the sum of squared residuals and the number of samples (prior rows included), both forgetting.
    """
    count = row.size
    usable = math.isfinite(value) and math.isfinite(weight) and weight > 0.0
    for i in range(count):
        usable = usable and math.isfinite(row[i])
    if not usable:
        return False
    if forgetting < 1.0:
        root = math.sqrt(forgetting)
        for i in range(count):
            rotated[i] *= root
            for j in range(i, count):
                triangle[i, j] *= root
        sums[0] *= forgetting
        sums[1] *= forgetting
    root = math.sqrt(weight)
    value *= root
    for i in range(count):
        row[i] *= root
    for i in range(count):
        if row[i] == 0.0:
            continue
        length = math.hypot(triangle[i, i], row[i])
        cosine = triangle[i, i] / length
        sine = row[i] / length
        triangle[i, i] = length
        for j in range(i + 1, count):
            above = triangle[i, j]
            triangle[i, j] = cosine * above + sine * row[j]
            row[j] = cosine * row[j] - sine * above
        above = rotated[i]
        rotated[i] = cosine * above + sine * value
        value = cosine * value - sine * above
    # What no rotation could absorb is this sample's share of the residual sum of squares.
    sums[0] += value * value
    sums[1] += 1.0
    return True


@njit
def _solve(triangle: FloatArray, rotated: FloatArray, inverse: FloatArray, coefficients: FloatArray) -> bool:
    """Inverse of the triangle and the coefficients, in place; NaN and False where a column carries no information."""
    count = rotated.size
    determined = True
    for j in range(count):
        column = 0.0
        for i in range(j + 1):
            column = math.hypot(column, triangle[i, j])
        determined = determined and abs(triangle[j, j]) > _UNDETERMINED * column
    if not determined:
        coefficients[:] = np.nan
        inverse[:, :] = np.nan
        return False
    for i in range(count - 1, -1, -1):
        value = rotated[i]
        for j in range(i + 1, count):
            value -= triangle[i, j] * coefficients[j]
        coefficients[i] = value / triangle[i, i]
    for j in range(count):
        for i in range(count):
            inverse[i, j] = 0.0
        inverse[j, j] = 1.0 / triangle[j, j]
        for i in range(j - 1, -1, -1):
            value = 0.0
            for k in range(i + 1, j + 1):
                value -= triangle[i, k] * inverse[k, j]
            inverse[i, j] = value / triangle[i, i]
    return True


@njit
def _recurse(
    regressors: FloatArray,
    target: FloatArray,
    weights: FloatArray,
    forgetting: float,
    triangle: FloatArray,
    rotated: FloatArray,
    sums: FloatArray,
    inverse: FloatArray,
    coefficients: FloatArray,
    history: FloatArray,
    variances: FloatArray,
    residual_variances: FloatArray,
) -> None:
    """All samples in turn, filling the histories of the last ones in place."""
    samples, count = regressors.shape
    row, changed = np.empty(count), False
    told = samples - history.shape[0]  # the first sample that is told of
    for n in range(samples):
        copy_row(row, regressors[n])
        changed |= _take_in(triangle, rotated, sums, row, target[n], weights[n], forgetting)
        if n < told:
            continue
        if changed:
            _solve(triangle, rotated, inverse, coefficients)
            changed = False
        freedom = sums[1] - count
        residual_variances[n - told] = sums[0] / freedom if freedom > 1e-9 else np.nan
        for i in range(count):
            history[n - told, i] = coefficients[i]
            variance = 0.0
            for j in range(i, count):
                variance += inverse[i, j] * inverse[i, j]
            variances[n - told, i] = variance
