"""The discrete estimator, (9)-(12), for any model given as functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import EstimationError
from aerosid.model_error.estimators.functions import (
    BY_DIFFERENCES,
    Function,
    ModelFunctions,
    Partials,
    StepFunction,
    call_driver,
    model_functions,
)
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.records import DrivenRecord, Records, as_records
from aerosid.model_error.estimators.weights import Weights
from aerosid.model_error.invariant_embedding.estimator_step import measurement_update, predict_riccati
from aerosid.model_error.invariant_embedding.residuals import weigh_sample
from aerosid.model_error.invariant_embedding.step_work import StepWork, step_work

Array = NDArray[np.float64]


class _Histories(NamedTuple):
    """What the driver writes, sample by sample, in the letters of `ModelErrorHistory`."""

    x: Array
    d: Array
    S: Array
    innovations: Array
    F: Array
    H: Array


def _drive(
    step: StepFunction,
    h: Function,
    f_x: Function,
    h_x: Function,
    record: DrivenRecord,
    histories: _Histories,
    work: StepWork,
) -> int:
    """Fill the histories; return the first sample that could not be reached, or -1. Runs as Python or compiled."""
    time, y, u, Q1, W = record
    x, d, S, innovations, F, H = histories
    N, p = y.shape
    n = x.shape[1]
    HQ, C = np.empty((n, p)), np.empty((n, n))
    weight, r = np.empty(p), np.empty(p)
    g, correction = np.empty(n), np.empty(n)
    predicted, P = x[0].copy(), S[0].copy()
    for k in range(N):
        if k > 0:
            j = k - 1
            predicted = step(x[j], u[j], u[k], time[j], 1.0)
            F[j] = f_x(x[j], u[j], time[j])
            predict_riccati(F[j], S[j], W[min(j, W.shape[0] - 1)], P, work)
        innovations[k] = y[k] - h(predicted, u[k], time[k])
        H[k] = h_x(predicted, u[k], time[k])
        weigh_sample(H[k], Q1[min(k, Q1.shape[0] - 1)], innovations[k], weight, r, HQ, C, g)
        if not measurement_update(P, C, g, S[k], correction, work):
            return k
        x[k] = predicted + correction
        if not np.all(np.isfinite(x[k])):
            return k
        if k > 0:
            d[k - 1] = correction
    return -1


def estimate_discrete(
    f: Callable[..., Any],
    h: Callable[..., Any],
    y: ArrayLike,
    x0: ArrayLike,
    weights: Weights,
    *,
    u: ArrayLike | None = None,
    partials: Partials = BY_DIFFERENCES,
) -> ModelErrorHistory:
    """States, model error d^ and Riccati matrix of the discrete recursion (9)-(12).

    Parameters
    ----------
    f : callable
        f(x, u, j) -> (n,), the chosen model's state at j + 1; j comes as a float.
    h : callable
        h(x, u, j) -> (p,), its outputs at j.
    y : (N, p)
        Measurements at j = 0 .. N - 1; NaN where missing.
    x0 : (n,)
        State at j = 0 before its measurement, with covariance 2 S0.
    weights : Weights
        `discrete_weights` gives them from covariances; those of sample j hold for the measurement at j and for the
        model error of the step j -> j + 1.
    u : (N, m), optional
        Inputs; those of sample j drive the step j -> j + 1. (N, 0) where absent.
    partials : Partials
        Derivatives of f and h where they are known; central differences where not.

    Returns
    -------
    ModelErrorHistory
        model_error[j], (12), is the model's error over the step j -> j + 1: regress it on that step's states.

    Raises
    ------
    UsageError
        On shapes that do not fit.
    EstimationError
        Where the state or S stops being finite.

    References
    ----------
    Parameswaran & Raol 1994, eqs. (9)-(12). Changed: the residual of (12) is that of the predicted state, as in (9).
    """
    measured = np.asarray(y, dtype=np.float64)
    records = as_records(np.arange(float(len(measured))), measured, x0, u, weights)
    functions = model_functions(
        f, h, n=records.n, p=records.p, partials=partials
    )  # fmt: skip
    return run_discrete(functions, records)


def run_discrete(functions: ModelFunctions, records: Records) -> ModelErrorHistory:
    """As `estimate_discrete`, for functions and records that are prepared."""
    N, n, p = records.N, records.n, records.p
    x, d, S = np.zeros((N, n)), np.zeros((N - 1, n)), np.zeros((N, n, n))
    innovations, F, H = np.zeros((N, p)), np.zeros((N - 1, n, n)), np.zeros((N, p, n))
    x[0], S[0] = records.x0, records.weights.S0
    failed = call_driver(_drive, functions, records.driven, _Histories(x, d, S, innovations, F, H), step_work(n))
    if failed >= 0:
        raise EstimationError(
            f"The estimate stops being finite at sample {failed}; check the weights, the initial state and the model "
            "there."
        )
    return ModelErrorHistory(
        time=records.time, states=x, model_error=d, S=S, innovations=innovations, F=F, H=H,
        H_step=np.zeros((0, p, n)), present=np.isfinite(records.y).astype(np.float64), weights=records.weights,
        discrete=True,
    )  # fmt: skip
