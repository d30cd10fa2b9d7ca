"""The continuous estimator, (21)-(26), on sampled data and for any model given as functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.compiled import njit
from aerosid.errors import EstimationError
from aerosid.model_error.estimators.functions import (
    BY_DIFFERENCES,
    Function,
    ModelFunctions,
    Partials,
    StepFunction,
    call_driver,
    jitable,
    model_functions,
)
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.records import DrivenRecord, Records, as_records
from aerosid.model_error.estimators.weights import Weights
from aerosid.model_error.invariant_embedding.estimator_step import estimator_step
from aerosid.model_error.invariant_embedding.residuals import multiply, weigh_sample, weigh_step
from aerosid.model_error.invariant_embedding.step_work import StepWork, step_work

Array = NDArray[np.float64]


class Interval(NamedTuple):
    """One step of the recursion, from a sample to the next."""

    t0: float  # times of both, s
    t1: float
    u0: Array  # (m,) inputs at them
    u1: Array
    y1: Array  # (p,) measurements at t1, NaN where missing
    Q1: Array  # (p, p) weight of the residual
    W: Array  # (n, n) (1/2) Q2^-1


class Estimate(NamedTuple):
    """What is known at a sample."""

    x: Array  # (n,) state x^
    residual: Array  # (p,) y - h there, NaN where missing
    S: Array  # (n, n) Riccati matrix


class Slopes(NamedTuple):
    """Linearisation of a step: in the middle of its open-loop path, and at its end."""

    F: Array  # (n, n) f_x in the middle
    H_step: Array  # (p, n) h_x in the middle
    H: Array  # (p, n) h_x at the end


class _Histories(NamedTuple):
    """What the driver writes, sample by sample, in the letters of `ModelErrorHistory`."""

    x: Array
    d: Array
    S: Array
    innovations: Array
    F: Array
    H: Array
    H_step: Array


class Scratch(NamedTuple):
    """Work arrays of one recursion; make them by `make_scratch`."""

    HQ: Array
    C: Array
    weight: Array
    r: Array
    g0: Array
    g1: Array
    e: Array
    step: StepWork


def make_scratch(n: int, p: int) -> Scratch:
    """Work arrays for n states and p outputs."""
    return Scratch(
        np.empty((n, p)),
        np.empty((n, n)),
        np.empty(p),
        np.empty(p),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        step_work(n),
    )


@njit
def model_error_at(S: Array, H: Array, Q1: Array, residual: Array, d: Array, scratch: Scratch) -> None:
    """Model error 2 S H' Q1 (y - h), (23), into `d`; outputs whose residual is NaN take no part."""
    weigh_sample(H, Q1, residual, scratch.weight, scratch.r, scratch.HQ, scratch.C, scratch.g0)
    multiply(S, scratch.g0, d)


@jitable
def advance(
    step: StepFunction,
    h: Function,
    f_x: Function,
    h_x: Function,
    interval: Interval,
    before: Estimate,
    after: Estimate,
    innovation: Array,
    slopes: Slopes,
    scratch: Scratch,
) -> bool:
    """One sample of the recursion; False where it stops being finite. Runs as Python or compiled.

    The linearisation is taken in the middle of the step's open-loop path, which makes the whole of second order.

    Parameters
    ----------
    step, h, f_x, h_x : functions
        Of `ModelFunctions`.
    interval : Interval
        The step and what drives it.
    before : Estimate
        At its beginning.
    after : Estimate
        Out: at its end.
    innovation : (p,)
        Out: y - h at its end on the open-loop path.
    slopes : Slopes
        Out.
    scratch : Scratch
    """
    t1, u1 = interval.t1, interval.u1
    dt = t1 - interval.t0
    path_end = step(before.x, interval.u0, u1, interval.t0, dt)
    innovation[:] = interval.y1 - h(path_end, u1, t1)
    middle, u_middle, t_middle = 0.5 * (before.x + path_end), 0.5 * (interval.u0 + u1), interval.t0 + 0.5 * dt
    slopes.F[:] = f_x(middle, u_middle, t_middle)
    slopes.H_step[:] = h_x(middle, u_middle, t_middle)
    HQ, C, g0, g1, e = scratch.HQ, scratch.C, scratch.g0, scratch.g1, scratch.e
    weigh_step(slopes.H_step, interval.Q1, before.residual, innovation, scratch.weight, scratch.r, HQ, C, g0, g1)
    if not estimator_step(before.S, slopes.F, interval.W, C, g0, g1, dt, after.S, e, scratch.step):
        return False
    after.x[:] = path_end + e
    if not np.all(np.isfinite(after.x)):
        return False
    after.residual[:] = interval.y1 - h(after.x, u1, t1)
    slopes.H[:] = h_x(after.x, u1, t1)
    return True


def _drive(
    step: StepFunction,
    h: Function,
    f_x: Function,
    h_x: Function,
    record: DrivenRecord,
    histories: _Histories,
    scratch: Scratch,
) -> int:
    """Fill the histories; return the first sample that could not be reached, or -1. Runs as Python or compiled."""
    time, y, u, Q1, W = record
    x, d, S, innovations, F, H, H_step = histories
    N = time.shape[0]
    innovations[0] = y[0] - h(x[0], u[0], time[0])
    H[0] = h_x(x[0], u[0], time[0])
    residual, residual_after = innovations[0].copy(), innovations[0].copy()
    model_error_at(S[0], H[0], Q1[0], residual, d[0], scratch)
    for k in range(N - 1):
        weight, error_weight = Q1[min(k, Q1.shape[0] - 1)], W[min(k, W.shape[0] - 1)]
        interval = Interval(time[k], time[k + 1], u[k], u[k + 1], y[k + 1], weight, error_weight)
        before, after = Estimate(x[k], residual, S[k]), Estimate(x[k + 1], residual_after, S[k + 1])
        slopes = Slopes(F[k], H_step[k], H[k + 1])
        if not advance(step, h, f_x, h_x, interval, before, after, innovations[k + 1], slopes, scratch):
            return k + 1
        residual[:] = residual_after
        model_error_at(S[k + 1], H[k + 1], Q1[min(k + 1, Q1.shape[0] - 1)], residual, d[k + 1], scratch)
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
    partials: Partials = BY_DIFFERENCES,
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
    partials : Partials
        Derivatives of f and h where they are known; central differences where not.
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
    Numba-compiled f, h (and those of `partials`) run inside a compiled loop; their signature is then
    (float64[::1], float64[::1], float64), returning float64[::1] or float64[:, ::1].

    Where h is curved, its change over a step is taken for a residual, and a gain that is high against the sampling
    (correction within one step) makes model error of it. Then give outputs in which h is linear, such as u, w computed
    from V, alpha, with the covariance that goes with them. At such a gain d^ of (23), taken at the end of the step,
    also misses a model error that shows in no output but through another state's integral: between two samples the
    record says nothing of it.

    References
    ----------
    Parameswaran & Raol 1994, eqs. (21)-(26). Changed: the transition matrix of (25), (26) is formed from both ends
    by doubling, and the mean goes through the same map.
    """
    records = as_records(time, y, x0, u, weights)
    functions = model_functions(
        f, h, n=records.n, p=records.p, partials=partials, substeps=substeps
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
        _drive, functions, records.driven, _Histories(x, d, S, innovations, F, H, H_step), make_scratch(n, p)
    )
    if failed >= 0:
        raise EstimationError(
            f"The estimate stops being finite at sample {failed} (t = {records.time[failed]:g} s); check the weights, "
            "the initial state and the model's rates there."
        )
    return ModelErrorHistory(
        time=records.time, states=x, model_error=d, S=S, innovations=innovations, F=F, H=H, H_step=H_step,
        present=np.isfinite(records.y).astype(np.float64), weights=records.weights, discrete=False,
    )  # fmt: skip
