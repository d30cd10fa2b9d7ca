"""Consistency of the weights: likelihood of the innovations, covariance constraint, choice of weights.

Likelihood of the innovations, covariance constraint, and weights chosen by either.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.compiled import njit
from aerosid.errors import EstimationError, UsageError
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.weights import Weights
from aerosid.model_error.invariant_embedding.estimator_step import predict_riccati
from aerosid.model_error.invariant_embedding.step_map import read_map, step_map
from aerosid.model_error.invariant_embedding.step_work import StepWork, cholesky, step_work

Array = NDArray[np.float64]

_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@dataclass(frozen=True)
class Consistency:
    """How well the weights of an estimate fit what it met.

    Attributes
    ----------
    minus_two_log_likelihood : float
        Of the innovations, but for a constant; the smaller the better.
    innovation_ratio : float
        Mean of nu' B^-1 nu over the number of measured values; 1 where innovations are as large as expected.
    residual_ratio : (p,)
        Mean square of y - h at x^ over its variance R; 1 is Mook and Junkins' covariance constraint.
    """

    minus_two_log_likelihood: float
    innovation_ratio: float
    residual_ratio: Array


@njit
def _innovation_statistics(
    time: Array, S: Array, F: Array, H: Array, W: Array, R: Array, innovations: Array, discrete: bool, work: StepWork
) -> tuple[float, float, int]:
    N, p, n = H.shape
    P, Phi, G, F_k, W_k, S_k = (
        np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n)),
    )  # fmt: skip
    zero, none = np.zeros((n, n)), np.empty((n, 0))
    B, L, row, place = np.empty((p, p)), np.empty((p, p)), np.empty(p), np.empty(p, dtype=np.int64)
    log_determinant, squares, count = 0.0, 0.0, 0
    for k in range(N - 1):
        F_k[:], W_k[:], S_k[:] = F[k], W[min(k, W.shape[0] - 1)], S[k]
        if discrete:
            predict_riccati(F_k, S_k, W_k, P, work)
        else:
            step_map(F_k, W_k, zero, time[k + 1] - time[k], work)
            read_map(work, Phi, P, G, none, none)
            predict_riccati(Phi, S_k, P, P, work)
        held = 0
        for i in range(p):
            if not math.isnan(innovations[k + 1, i]):
                place[held] = i
                held += 1
        for a in range(held):
            for b in range(held):
                i, j = place[a], place[b]
                B[a, b] = R[min(k + 1, R.shape[0] - 1), i, j]
                for c in range(n):
                    for e in range(n):
                        B[a, b] += 2.0 * H[k + 1, i, c] * P[c, e] * H[k + 1, j, e]
        cholesky(B, L, held)
        for a in range(held):
            row[a] = innovations[k + 1, place[a]]
            for b in range(a):
                row[a] -= L[a, b] * row[b]
            row[a] /= L[a, a]
            squares += row[a] * row[a]
            log_determinant += 2.0 * math.log(L[a, a])
        count += held
    return log_determinant, squares, count


def judge_consistency(history: ModelErrorHistory, y: ArrayLike, R: ArrayLike, outputs: ArrayLike) -> Consistency:
    """How well the weights of `history` fit what it met.

    Parameters
    ----------
    history : ModelErrorHistory
    y : (N, p)
        The measurements, unfiltered: a low-pass makes the innovations look better than they are.
    R : (p, p) or (N, p, p)
        Covariance of one sample's noise.
    outputs : (N, p)
        h at x^.

    Returns
    -------
    Consistency
    """
    measured, computed = np.asarray(y, dtype=np.float64), np.asarray(outputs, dtype=np.float64)
    N, p, n = history.H.shape
    covariance = np.array(R, dtype=np.float64, order="C").reshape(-1, p, p)
    W = 0.5 * history.weights.Q2_inverse.reshape(-1, n, n)
    log_determinant, squares, count = _innovation_statistics(
        history.time, history.S, history.F, history.H, W, covariance, history.innovations, history.discrete,
        step_work(n, 0, 0),
    )  # fmt: skip
    variance = np.broadcast_to(np.diagonal(covariance, axis1=1, axis2=2), (N, p))
    present = np.isfinite(measured)
    sums = np.where(present, (np.where(present, measured, 0.0) - computed) ** 2 / variance, 0.0).sum(axis=0)
    return Consistency(
        float(log_determinant + squares),
        float(squares / count) if count else math.nan,
        np.asarray(sums / np.maximum(present.sum(axis=0), 1)),
    )


@dataclass(frozen=True)
class ChosenWeights:
    """Weights chosen by a search over one factor on Q2^-1.

    Attributes
    ----------
    weights : Weights
    factor : float
        On the Q2^-1 given.
    consistency : Consistency
        With these weights.
    """

    weights: Weights
    factor: float
    consistency: Consistency


def most_likely_weights(
    evaluate: Callable[[Weights], Consistency], weights: Weights, decades: tuple[float, float] = (-6.0, 6.0)
) -> ChosenWeights:
    """The factor on Q2^-1 under which the innovations are most likely.

    Parameters
    ----------
    evaluate : callable
        Runs the estimator with the weights given to it and judges the outcome. A breakdown of the estimator
        (EstimationError) counts as unlikely.
    weights : Weights
        Q2^-1 gives the proportions between the states' model errors.
    decades : (float, float)
        Range of log10 of the factor.

    Returns
    -------
    ChosenWeights

    Raises
    ------
    UsageError
        Where the estimator breaks down with every factor.
    """

    def cost(exponent: float) -> float:
        try:
            value = evaluate(weights.with_model_error_scaled(10.0**exponent)).minus_two_log_likelihood
        except EstimationError:
            return math.inf
        return value if math.isfinite(value) else math.inf

    grid = np.arange(decades[0], decades[1] + 0.5, 1.0)
    costs = [cost(float(exponent)) for exponent in grid]
    if not math.isfinite(min(costs)):
        raise UsageError("The estimator breaks down with every weight tried; check the model and the initial state.")
    best = int(np.argmin(costs))
    low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, grid.size - 1)])
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    cost_left, cost_right = cost(left), cost(right)
    while high - low > 0.05:  # 12 % of the density: far finer than a record can resolve
        if cost_left <= cost_right:
            high, right, cost_right = right, left, cost_left
            left = high - _GOLDEN * (high - low)
            cost_left = cost(left)
        else:
            low, left, cost_left = left, right, cost_right
            right = low + _GOLDEN * (high - low)
            cost_right = cost(right)
    return _chosen(evaluate, weights, 0.5 * (low + high))


def covariance_constrained_weights(
    evaluate: Callable[[Weights], Consistency], weights: Weights, decades: tuple[float, float] = (-6.0, 6.0)
) -> ChosenWeights:
    """The factor on Q2^-1 under which the residuals are as large as the noise: Mook and Junkins' covariance constraint.

    Parameters
    ----------
    evaluate, weights, decades
        As for `most_likely_weights`. The end of the range is returned where the constraint is met nowhere in it.

    Returns
    -------
    ChosenWeights

    Notes
    -----
    The mean over the outputs of the residual ratio falls as the factor rises; its crossing of 1 is bisected.

    References
    ----------
    Mook, D.J. and Junkins, J.L.: Minimum model error estimation for poorly modeled dynamic systems, AIAA-87-0173.
    """

    def excess(exponent: float) -> float:
        try:
            value = float(np.mean(evaluate(weights.with_model_error_scaled(10.0**exponent)).residual_ratio)) - 1.0
        except EstimationError:
            return math.inf
        return value if math.isfinite(value) else math.inf

    low, high = decades
    if excess(high) > 0.0:
        return _chosen(evaluate, weights, high)
    if excess(low) < 0.0:
        return _chosen(evaluate, weights, low)
    while high - low > 0.02:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return _chosen(evaluate, weights, 0.5 * (low + high))


def _chosen(evaluate: Callable[[Weights], Consistency], weights: Weights, exponent: float) -> ChosenWeights:
    factor = 10.0**exponent
    scaled = weights.with_model_error_scaled(factor)
    return ChosenWeights(scaled, factor, evaluate(scaled))
