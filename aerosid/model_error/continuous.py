"""The continuous estimator, (21)-(26), on sampled data and for any model given as functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import EstimationError
from aerosid.model_error.functions import Function, ModelFunctions, StepFunction, call_driver, model_functions
from aerosid.model_error.history import ModelErrorHistory
from aerosid.model_error.invariant_embedding import StepWork, estimator_step, step_work
from aerosid.model_error.records import Records, as_records
from aerosid.model_error.residuals import multiply, weigh_sample, weigh_step
from aerosid.model_error.weights import Weights

Array = NDArray[np.float64]


def _drive(
    step: StepFunction,
    h: Function,
    f_x: Function,
    h_x: Function,
    time: Array,
    y: Array,
    u: Array,
    Q1: Array,
    W: Array,
    x: Array,
    d: Array,
    S: Array,
    innovations: Array,
    F: Array,
    H: Array,
    H_step: Array,
    work: StepWork,
) -> int:
    """Fill the histories; return the first sample that could not be reached, or -1. Runs as Python or compiled.

    The linearisation of a step is taken in the middle of its open-loop path, which makes the whole of second order.
    """
    N, p = y.shape
    n = x.shape[1]
    HQ, C = np.empty((n, p)), np.empty((n, n))
    weight, r = np.empty(p), np.empty(p)
    g0, g1, e = np.empty(n), np.empty(n), np.empty(n)
    innovations[0] = y[0] - h(x[0], u[0], time[0])
    before = innovations[0].copy()
    H[0] = h_x(x[0], u[0], time[0])
    for k in range(N):
        q = min(k, Q1.shape[0] - 1)
        weigh_sample(H[k], Q1[q], before, weight, r, HQ, C, g0)
        multiply(S[k], g0, d[k])
        if k == N - 1:
            break
        dt = time[k + 1] - time[k]
        path_end = step(x[k], u[k], u[k + 1], time[k], dt)
        innovations[k + 1] = y[k + 1] - h(path_end, u[k + 1], time[k + 1])
        middle, u_middle, t_middle = 0.5 * (x[k] + path_end), 0.5 * (u[k] + u[k + 1]), time[k] + 0.5 * dt
        F[k] = f_x(middle, u_middle, t_middle)
        H_step[k] = h_x(middle, u_middle, t_middle)
        weigh_step(H_step[k], Q1[q], before, innovations[k + 1], weight, r, HQ, C, g0, g1)
        if not estimator_step(S[k], F[k], W[min(k, W.shape[0] - 1)], C, g0, g1, dt, S[k + 1], e, work):
            return k + 1
        x[k + 1] = path_end + e
        if not np.all(np.isfinite(x[k + 1])):
            return k + 1
        before = y[k + 1] - h(x[k + 1], u[k + 1], time[k + 1])
        H[k + 1] = h_x(x[k + 1], u[k + 1], time[k + 1])
    return -1


def estimate_continuous(
    f: Callable[..., Any],
    h: Callable[..., Any],
    time: ArrayLike,
    y: ArrayLike,
    x0: ArrayLike,
    weights: Weights,
    *,
    u: ArrayLike | None = None,
    f_x: Callable[..., Any] | None = None,
    h_x: Callable[..., Any] | None = None,
    state_scale: ArrayLike | None = None,
    substeps: int = 1,
) -> ModelErrorHistory:
    """States, model error d^ and Riccati matrix of the continuous recursion (21)-(23) over sampled data.

    Between samples the model runs open loop (fourth-order Runge-Kutta); S, and the correction of the state by the
    residual along that path (linear between its two ends), are exact for the step's linearisation.

    Parameters
    ----------
    f : callable
        f(x, u, t) -> (n,), the chosen model's rates, state units / s.
    h : callable
        h(x, u, t) -> (p,), its outputs.
    time : (N,)
        s, strictly increasing.
    y : (N, p)
        Measurements; NaN where missing.
    x0 : (n,)
        State at the first sample.
    weights : Weights
        `continuous_weights` gives them from covariances.
    u : (N, m), optional
        Inputs, linear between the samples; (N, 0) where absent.
    f_x, h_x : callable, optional
        Partial derivatives (n, n) and (p, n); central differences where absent.
    state_scale : (n,), optional
        Magnitude below which a state counts as zero when its difference step is chosen; 1 by default.
    substeps : int
        Runge-Kutta steps between two samples.

    Returns
    -------
    ModelErrorHistory

    Raises
    ------
    UsageError
        On shapes that do not fit.
    EstimationError
        Where the state or S stops being finite.

    Notes
    -----
    Numba-compiled f, h (and f_x, h_x) run inside a compiled loop; their signature is then
    (float64[::1], float64[::1], float64), returning float64[::1] or float64[:, ::1].

    References
    ----------
    Parameswaran & Raol 1994, eqs. (21)-(26). Changed: the transition matrix of (25), (26) is formed from both ends
    by doubling, and the mean goes through the same map.
    """
    records = as_records(time, y, x0, u, weights)
    functions = model_functions(
        f, h, n=records.n, p=records.p, f_x=f_x, h_x=h_x, substeps=substeps,
        state_scale=None if state_scale is None else np.asarray(state_scale, dtype=np.float64),
    )  # fmt: skip
    return run_continuous(functions, records)


def run_continuous(functions: ModelFunctions, records: Records) -> ModelErrorHistory:
    """As `estimate_continuous`, for functions and records that are prepared."""
    N, n, p = records.N, records.n, records.p
    x, d, S = np.zeros((N, n)), np.zeros((N, n)), np.zeros((N, n, n))
    innovations, F = np.zeros((N, p)), np.zeros((N - 1, n, n))
    H, H_step = np.zeros((N, p, n)), np.zeros((N - 1, p, n))
    x[0], S[0] = records.x0, records.weights.S0
    failed = call_driver(
        _drive, functions, records.time, records.y, records.u, records.Q1, records.W,
        x, d, S, innovations, F, H, H_step, step_work(n),
    )  # fmt: skip
    if failed >= 0:
        raise EstimationError(
            f"The estimate stops being finite at sample {failed} (t = {records.time[failed]:g} s); check the weights, "
            "the initial state and the model's rates there."
        )
    return ModelErrorHistory(
        time=records.time, states=x, model_error=d, S=S, innovations=innovations, F=F, H=H, H_step=H_step,
        present=np.isfinite(records.y).astype(np.float64), weights=records.weights, discrete=False,
    )  # fmt: skip
