"""The exact fixed-interval solution: filter forward, costate backward, relinearised until it converges.

The filter uses the terminal condition lambda = 0 at its own, running end of the record. Inside the record the two-point
boundary value problem (6)-(8), (18)-(20) needs the costate of the whole record as well. Each sweep solves the problem
linearised about the last trajectory exactly (Gauss-Newton on J); for a linear model the first sweep is the solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import EstimationError
from aerosid.model_error.estimators.continuous import run_continuous
from aerosid.model_error.estimators.discrete import run_discrete
from aerosid.model_error.estimators.functions import BY_DIFFERENCES, ModelFunctions, Partials, model_functions
from aerosid.model_error.estimators.records import Records, as_records
from aerosid.model_error.estimators.sweeps import (
    ContinuousRecord,
    DiscreteRecord,
    Smoothed,
    sweep_continuous,
    sweep_discrete,
)
from aerosid.model_error.estimators.weights import Weights
from aerosid.model_error.invariant_embedding.step_work import step_work

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FixedInterval:
    """The minimiser of J over the whole record; everything inside is read-only.

    Attributes
    ----------
    time : (N,)
        s, or the step number of a discrete model.
    states : (N, n)
        x.
    costate : (N, n)
        lambda; of a discrete model (N - 1, n), lambda(j) of (6)-(8).
    model_error : (N, n)
        d = (1/2) Q2^-1 lambda at each sample, state units / s; of a discrete model (N - 1, n), of each step.
    covariance : (N, n, n)
        Of x given the whole record.
    model_error_covariance : (N - 1, n, n)
        Of the model error given the whole record: of each step's d (discrete), of d's mean over each step
        (continuous: at an instant a white d has no finite variance).
    model_error_mean : (N - 1, n)
        What that covariance belongs to.
    sweeps : int
        Forward-backward sweeps made.
    converged : bool
        Whether the last sweep moved no state by more than the tolerance, in units of its spread.
    """

    time: Array
    states: Array
    costate: Array
    model_error: Array
    covariance: Array
    model_error_covariance: Array
    model_error_mean: Array
    sweeps: int
    converged: bool

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)


def fixed_interval_discrete(
    f: Callable[..., Any],
    h: Callable[..., Any],
    y: ArrayLike,
    x0: ArrayLike,
    weights: Weights,
    *,
    u: ArrayLike | None = None,
    partials: Partials = BY_DIFFERENCES,
    max_sweeps: int = 30,
    tolerance: float = 1e-10,
) -> FixedInterval:
    """States and model error that minimise J over the whole record, with their covariances, for a discrete model.

    Parameters
    ----------
    f, h, y, x0, weights, u, partials
        As for `estimate_discrete`.
    max_sweeps : int
        Linearisations at most.
    tolerance : float
        Convergence: no state moves by more than this, in units of that state's spread over the record.

    Returns
    -------
    FixedInterval

    Raises
    ------
    UsageError
        On shapes that do not fit.
    EstimationError
        Where a sweep stops being finite.

    References
    ----------
    Parameswaran & Raol 1994, eqs. (5)-(8).
    """
    measured = np.asarray(y, dtype=np.float64)
    records = as_records(np.arange(float(len(measured))), measured, x0, u, weights)
    functions = model_functions(
        f, h, n=records.n, p=records.p, partials=partials
    )  # fmt: skip
    trajectory = np.array(run_discrete(functions, records).states)
    return _iterate(functions, records, trajectory, _discrete_once, max_sweeps, tolerance)


def fixed_interval_continuous(
    f: Callable[..., Any],
    h: Callable[..., Any],
    time: ArrayLike,
    y: ArrayLike,
    x0: ArrayLike,
    weights: Weights,
    *,
    u: ArrayLike | None = None,
    partials: Partials = BY_DIFFERENCES,
    max_sweeps: int = 30,
    tolerance: float = 1e-10,
) -> FixedInterval:
    """States and model error that minimise J over the whole record, with their covariances, for rates f.

    Parameters
    ----------
    f, h, time, y, x0, weights, u, partials
        As for `estimate_continuous`.
    max_sweeps, tolerance
        As for `fixed_interval_discrete`.

    Returns
    -------
    FixedInterval

    Raises
    ------
    UsageError
        On shapes that do not fit.
    EstimationError
        Where a sweep stops being finite.

    Notes
    -----
    J holds the measurements as linear in time between the samples. Within a step f and h are linear about the chord
    of the trajectory: exact for a linear model with inputs linear in time, of second order in dt otherwise.

    References
    ----------
    Parameswaran & Raol 1994, eqs. (17)-(20).
    """
    records = as_records(time, y, x0, u, weights)
    functions = model_functions(
        f, h, n=records.n, p=records.p, partials=partials, substeps=1
    )  # fmt: skip
    trajectory = np.array(run_continuous(functions, records).states)
    return _iterate(functions, records, trajectory, _continuous_once, max_sweeps, tolerance)


def _iterate(
    functions: ModelFunctions,
    records: Records,
    trajectory: Array,
    once: Callable[[ModelFunctions, Records, Array], _Sweep],
    max_sweeps: int,
    tolerance: float,
) -> FixedInterval:
    spread = np.ptp(trajectory, axis=0)
    spread = np.where(spread > 0.0, spread, 1.0)
    sweeps, converged = 0, False
    while sweeps < max(max_sweeps, 1) and not converged:
        sweep = once(functions, records, trajectory)
        sweeps += 1
        trajectory = trajectory + sweep.delta
        if not np.all(np.isfinite(trajectory)):
            raise EstimationError(
                f"Sweep {sweeps} of the fixed-interval solution stops being finite; check weights and initial state."
            )
        converged = bool(np.max(np.abs(sweep.delta) / spread) <= tolerance)
    W = records.W if records.W.shape[0] == 1 else records.W[: sweep.costate.shape[0]]
    model_error = np.einsum("kij,kj->ki", np.broadcast_to(W, (len(sweep.costate), *W.shape[1:])), sweep.costate)
    return FixedInterval(
        time=records.time, states=trajectory, costate=sweep.costate, model_error=model_error,
        covariance=sweep.covariance, model_error_covariance=sweep.d_covariance,
        model_error_mean=model_error.copy() if sweep.d_mean is None else sweep.d_mean, sweeps=sweeps,
        converged=converged,
    )  # fmt: skip


@dataclass(frozen=True)
class _Sweep:
    delta: Array
    costate: Array
    covariance: Array
    d_covariance: Array
    d_mean: Array | None


def _empty_sweep(records: Records, costates: int) -> Smoothed:
    N, n = records.N, records.n
    S = np.zeros((N, n, n))
    S[0] = records.weights.S0
    return Smoothed(
        S, np.zeros((N, n)), np.zeros((costates, n)), np.zeros((N, n, n)), np.zeros((N - 1, n, n)), np.zeros((N - 1, n))
    )


def _discrete_once(functions: ModelFunctions, records: Records, x: Array) -> _Sweep:
    t, u, N = records.time, records.u, records.N
    offset = np.array([functions.step(x[k], u[k], u[k + 1], t[k], 1.0) - x[k + 1] for k in range(N - 1)])
    F = np.array([functions.f_x(x[k], u[k], t[k]) for k in range(N - 1)])
    H = np.array([functions.h_x(x[k], u[k], t[k]) for k in range(N)])
    residual = records.y - np.array([functions.h(x[k], u[k], t[k]) for k in range(N)])
    smoothed = _empty_sweep(records, N - 1)
    record = DiscreteRecord(F, H, offset, residual, records.Q1, records.W, records.x0 - x[0])
    _require(sweep_discrete(record, smoothed, step_work(records.n)))
    return _Sweep(smoothed.delta, smoothed.costate, smoothed.covariance, smoothed.d_covariance, None)


def _continuous_once(functions: ModelFunctions, records: Records, x: Array) -> _Sweep:
    t, u, N, n = records.time, records.u, records.N, records.n
    middle, u_middle, t_middle = 0.5 * (x[1:] + x[:-1]), 0.5 * (u[1:] + u[:-1]), 0.5 * (t[1:] + t[:-1])
    F = np.array([functions.f_x(middle[k], u_middle[k], t_middle[k]) for k in range(N - 1)])
    H = np.array([functions.h_x(middle[k], u_middle[k], t_middle[k]) for k in range(N - 1)])
    rates = np.array([functions.f(x[k], u[k], t[k]) for k in range(N)])
    chord = np.diff(x, axis=0) / np.diff(t)[:, None]
    residual = records.y - np.array([functions.h(x[k], u[k], t[k]) for k in range(N)])
    smoothed = _empty_sweep(records, N)
    record = ContinuousRecord(
        t, F, H, rates[:-1] - chord, rates[1:] - chord, residual[:-1].copy(), residual[1:].copy(), records.Q1,
        records.W, records.x0 - x[0],
    )  # fmt: skip
    _require(sweep_continuous(record, smoothed, step_work(n), step_work(2 * n)))
    return _Sweep(smoothed.delta, smoothed.costate, smoothed.covariance, smoothed.d_covariance, smoothed.d_mean)


def _require(sound: bool) -> None:
    if not sound:
        raise EstimationError("The fixed-interval sweep stops being finite; check weights and model.")
