"""Run the continuous estimator (21)-(26) on the aircraft's equations, with every candidate passed through it as well.

The estimator's d(t) is a filtered picture of the true model error: what its gain and its step do to the error they do
to a candidate too. So each term's contribution is sent through the same gains, sample by sample, and d(t) is compared
with that. Model error is allowed in the equations of u, w and q; theta' = q is kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import initial_state
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.flight import ALPHA_LIMIT, Flight
from aerosid.flight_model.longitudinal import Constants, Workspace, evaluate, make_workspace, pressure_area
from aerosid.flight_model.sampling_interval import Stages, integrate, make_stages
from aerosid.flight_model.terms import TermTable
from aerosid.model_error.invariant_embedding import (
    StepWork,
    cholesky,
    estimator_step,
    gain_step,
    information,
    step_work,
    transition_step,
)

STATE_COUNT = 4
"""u, w, q, theta: altitude acts on nothing and carries no model error."""

CHANNELS_FED = ("V", "alpha", "q", "theta")
"""What the estimator's states are compared with; specific forces contain d itself."""


@dataclass(frozen=True)
class AircraftError:
    """What the estimator made of one log.

    Attributes
    ----------
    states : ndarray, shape (N, 4)
        u, w, q, theta.
    d : ndarray, shape (N, 4)
        Model error (23) in the four equations, in units of the state per second; NaN where a sample had no measurement.
    responded : ndarray, shape (N, 4, T)
        The d that each term of unit value would have produced through the same estimator.
    initial : ndarray, shape (N, 4, 4)
        The d that an error of each initial state would have produced.
    rate_per_unit : ndarray, shape (N, 3)
        State rate that a unit of C_X, C_Z, C_m causes in its equation: u, w, q.
    innovations : ndarray, shape (N, 4)
        Measured u, w, q, theta minus the estimate.
    riccati : ndarray, shape (N, 4, 4)
        S of (22).
    cost : float
        -2 ln L of the one-step predictions, but for a constant: what tells good weights from bad; NaN if not asked for.
    """

    states: NDArray[np.float64]
    d: NDArray[np.float64]
    responded: NDArray[np.float64]
    initial: NDArray[np.float64]
    rate_per_unit: NDArray[np.float64]
    innovations: NDArray[np.float64]
    riccati: NDArray[np.float64]
    cost: float


def estimate_aircraft_error(
    model: AerodynamicModel,
    flight: Flight,
    measurement_variance: NDArray[np.float64],
    error_density: NDArray[np.float64],
    *,
    respond: bool = True,
    likelihood: bool = False,
) -> AircraftError:
    """The model error of `model` on a flight, and what each of its terms looks like through the same estimator.

    Parameters
    ----------
    model : AerodynamicModel
        Candidates are terms of zero value.
    flight : Flight
        Channels as fed to the recursion, filtered or not.
    measurement_variance : ndarray, shape (4,)
        Variance of each sample of V, alpha, q, theta as fed to the recursion, SI squared.
    error_density : ndarray, shape (4,)
        Diagonal of Q2^-1 in (22), spectral density of the model error, (state/s)^2 s; an entry may be zero.
    respond : bool
        Whether the terms' responses are wanted; without, `responded` and `initial` are empty.
    likelihood : bool
        Whether the cost is wanted.

    Raises
    ------
    EstimationError
        Where the recursion cannot be formed: the estimate left the model's range.

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (21)-(26), with Q1 = R^-1/dt for samples of covariance R every dt.
    V and alpha enter as u and w, with the covariance that goes with them: the observation is then linear. A curved one
    leaves a residual that a high gain mistakes for model error, and a noise-free coefficient came back wrong by its
    own size at large weights.
    """
    start = initial_state(flight)
    measured, weights = measured_states(flight, measurement_variance)
    samples, terms = flight.time.size, model.values.size
    width = terms + STATE_COUNT if respond else 0
    states = np.empty((samples, STATE_COUNT))
    d = np.full((samples, STATE_COUNT), np.nan)
    columns = np.zeros((samples, STATE_COUNT, width))
    rate_per_unit = np.empty((samples, 3))
    innovations = np.full((samples, STATE_COUNT), np.nan)
    riccati = np.empty((samples, STATE_COUNT, STATE_COUNT))
    reached, cost = _run(
        flight,
        start,
        np.array(model.values),
        model.table,
        model.constants,
        measured,
        weights,
        error_density,
        initial_riccati(start, measurement_variance),
        likelihood,
        states,
        d,
        columns,
        rate_per_unit,
        innovations,
        riccati,
    )
    if reached < samples:
        raise EstimationError(
            f"the model-error recursion left the model's range at {flight.time[reached]:.3f} s (sample {reached + 1}); "
            "check units and signs of V, alpha and q around that time."
        )
    return AircraftError(
        states,
        d,
        columns[:, :, :terms],
        columns[:, :, terms:],
        rate_per_unit,
        innovations,
        riccati,
        float(cost) if likelihood else np.nan,
    )


def measured_motion(flight: Flight) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """u, w, q, theta (N, 4) and the angle of attack (N,) as measured, the vane's own velocity taken out."""
    speed, alpha, q, theta = (flight.measured[:, i] for i in range(4))
    plane = speed * np.cos(flight.inputs[:, 7])
    rate = np.nan_to_num(q)
    alpha = alpha + (rate * flight.positions[1, 0] - flight.inputs[:, 5] * flight.positions[1, 1]) / speed
    return np.column_stack([plane * np.cos(alpha), plane * np.sin(alpha), q, theta]), alpha


def measured_states(flight: Flight, variance: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """u, w, q, theta as measured, (N, 4), and R^-1 of each sample, (N, 4, 4), from that of V, alpha, q, theta (4,).

    Both u and w are missing where V or alpha is. The vane's own velocity in pitch and roll is taken out.
    """
    measured, alpha = measured_motion(flight)
    speed = flight.measured[:, 0]
    plane = speed * np.cos(flight.inputs[:, 7])
    weights = np.zeros((speed.size, STATE_COUNT, STATE_COUNT))
    cos, sin = np.nan_to_num(np.cos(alpha)), np.nan_to_num(np.sin(alpha))
    across = 1.0 / (np.nan_to_num(plane, nan=1.0) ** 2 * variance[1])
    along = 1.0 / variance[0]
    weights[:, 0, 0] = cos**2 * along + sin**2 * across
    weights[:, 1, 1] = sin**2 * along + cos**2 * across
    weights[:, 0, 1] = weights[:, 1, 0] = sin * cos * (along - across)
    weights[:, 2, 2] = 1.0 / variance[2]
    weights[:, 3, 3] = 1.0 / variance[3]
    return measured, weights


def initial_riccati(start: NDArray[np.float64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """S(0): the initial state is known as well as one sample of each channel measures it, S = covariance / 2."""
    speed = float(np.hypot(start[0], start[1]))
    across = speed * speed * variance[1]
    return 0.5 * np.diag([variance[0] + 1e-12, across + 1e-12, variance[2] + 1e-14, variance[3] + 1e-14])


@njit
def _run(
    flight: Flight,
    start: NDArray[np.float64],
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    measured: NDArray[np.float64],
    weights: NDArray[np.float64],
    density: NDArray[np.float64],
    riccati_start: NDArray[np.float64],
    likelihood: bool,
    states: NDArray[np.float64],
    d: NDArray[np.float64],
    columns: NDArray[np.float64],
    rate_per_unit: NDArray[np.float64],
    innovations: NDArray[np.float64],
    riccati: NDArray[np.float64],
) -> tuple[int, float]:
    """The recursion over a whole record; returns the number of samples that it reached, and -2 ln L.

    Arrays are made here, of sizes written as numbers, so that the step's code is made for just four states.
    """
    n, p = 4, 4
    extra, width = flight.inputs.shape[1] - 8, columns.shape[2]
    work, ahead = make_workspace(extra, table), make_workspace(extra, table)
    square = (
        np.zeros((p, p)), np.zeros((p, p)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((p, n)),
        np.zeros((n, n)), np.zeros((p, p)), np.zeros((n, n)), np.zeros((n, p)), np.zeros((n, n)), np.zeros((n, n)),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)),
    )  # fmt: skip
    rows = (
        np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(n), np.zeros(n),
        np.zeros(n), np.zeros(5),
    )  # fmt: skip
    return _recur(
        flight, start.copy(), theta, table, constants, measured, weights, density, riccati_start, likelihood,
        states, d, columns, rate_per_unit, innovations, riccati,
        work, ahead, make_stages(extra), square, rows, step_work(n, n, n), step_work(n, 2, 2),
        np.zeros((n, width)), np.zeros((2, n, width)),
    )  # fmt: skip


@njit_inline
def _recur(
    flight: Flight,
    x: NDArray[np.float64],
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    measured: NDArray[np.float64],
    weights: NDArray[np.float64],
    density: NDArray[np.float64],
    riccati_start: NDArray[np.float64],
    likelihood: bool,
    states: NDArray[np.float64],
    d: NDArray[np.float64],
    columns: NDArray[np.float64],
    rate_per_unit: NDArray[np.float64],
    innovations: NDArray[np.float64],
    riccati: NDArray[np.float64],
    work: Workspace,
    ahead: Workspace,
    stages: Stages,
    square: tuple[NDArray[np.float64], ...],
    rows: tuple[NDArray[np.float64], ...],
    gains: StepWork,
    corrections: StepWork,
    eps: NDArray[np.float64],
    scratch: NDArray[np.float64],
) -> tuple[int, float]:
    """As `_run`, from `x` and in work arrays that are given: `square` of four by four, `rows` of four."""
    n, p = 4, 4
    samples, terms, width = flight.time.shape[0], theta.shape[0], columns.shape[2]
    respond = width > 0
    cost = 0.0
    spread, factor, S, S_next, F, H, W, Q1, C, HQ, M0, M1, Phi, Gamma0, Gamma1 = square
    row, r0, r1, weight, here, there, g0, g1, e, ahead_x = rows
    for i in range(n):
        H[i, i] = 1.0
        W[i, i] = 0.5 * density[i]
        for j in range(n):
            S[i, j] = riccati_start[i, j]
        if respond:
            eps[i, terms + i] = 1.0
    for k in range(samples):
        evaluate(x, flight.inputs[k], theta, table, constants, flight.positions, work, True, False)
        if not abs(work.values[0]) < ALPHA_LIMIT:
            return k, cost
        for i in range(n):
            states[k, i] = x[i]
            for j in range(n):
                F[i, j] = work.rates_x[i, j]
                riccati[k, i, j] = S[i, j]
        force = pressure_area(x, flight.inputs[k], constants)
        rate_per_unit[k, 0] = force / flight.inputs[k, 2]
        rate_per_unit[k, 1] = force / flight.inputs[k, 2]
        rate_per_unit[k, 2] = force * constants.mean_chord / constants.I_yy
        dt = flight.time[min(k + 1, samples - 1)] - flight.time[min(k, samples - 2)]
        seen = False
        for i in range(p):
            r0[i] = measured[k, i] - x[i]
            innovations[k, i] = r0[i]
            here[i] = 0.0 if np.isnan(r0[i]) else 1.0
            seen = seen or here[i] > 0.0
            for j in range(p):
                Q1[i, j] = weights[k, i, j] / dt
        # d of the sample, eq. (23): only what is measured here speaks.
        information(H, Q1, here, HQ, C)
        if seen:
            for i in range(n):
                g0[i] = 0.0
                for j in range(p):
                    if here[j] > 0.0:
                        g0[i] += HQ[i, j] * r0[j]
            for i in range(n):
                d[k, i] = 0.0
                for j in range(n):
                    d[k, i] += S[i, j] * g0[j]
            if respond:
                _apply(C, eps, scratch[0], 0.0)
                _apply(S, scratch[0], columns[k], 0.0)
        if k + 1 == samples:
            return samples, cost
        for i in range(5):
            ahead_x[i] = x[i]
            ahead.rates[i] = work.rates[i]
        integrate(
            ahead_x, flight.inputs[k], flight.inputs[k + 1], dt, 0, flight.substeps, flight.substeps,
            theta, table, constants, flight.positions, ahead, stages,
        )  # fmt: skip
        if not abs(np.arctan2(ahead_x[1], ahead_x[0])) < ALPHA_LIMIT:
            return k + 1, cost
        for i in range(p):
            r1[i] = measured[k + 1, i] - ahead_x[i]
            there[i] = 0.0 if np.isnan(r1[i]) else 1.0
            weight[i] = 0.5 * (here[i] + there[i])
            if here[i] == 0.0:
                r0[i] = r1[i] if there[i] > 0.0 else 0.0
            if there[i] == 0.0:
                r1[i] = r0[i]
        if likelihood or respond:
            transition_step(F, dt, Phi, Gamma0, Gamma1, gains)
        if likelihood:
            # How likely the next sample is, predicted from this one: P = 2 (Phi S Phi' + W dt), R from the weights.
            cost += _surprise(S, Phi, W, dt, weights[k + 1], r1, there, spread, factor, row)
        information(H, Q1, weight, HQ, C)
        for i in range(n):
            g0[i] = 0.0
            g1[i] = 0.0
            for j in range(p):
                g0[i] += HQ[i, j] * r0[j]
                g1[i] += HQ[i, j] * r1[j]
        for i in range(n):
            x[i] = ahead_x[i]
        x[4] = ahead_x[4]
        if respond:
            if not gain_step(S, F, W, C, dt, S_next, M0, M1, gains):
                return k + 1, cost
            for i in range(n):
                for a in range(n):
                    x[i] += M0[i, a] * g0[a] + M1[i, a] * g1[a]
            # The candidates' true-minus-estimate: open loop with the candidate's rate, then the same correction.
            evaluate(ahead_x, flight.inputs[k + 1], theta, table, constants, flight.positions, ahead, True, False)
            _apply(C, eps, scratch[0], 0.0)
            _apply(Phi, eps, scratch[1], 0.0)
            _apply(Gamma0, work.rates_p, scratch[1], 1.0)
            _apply(Gamma1, ahead.rates_p, scratch[1], 1.0)
            _apply(M0, scratch[0], eps, 0.0, -1.0)
            _apply(C, scratch[1], scratch[0], 0.0)
            _apply(M1, scratch[0], eps, 1.0, -1.0)
            for i in range(n):
                for c in range(width):
                    eps[i, c] += scratch[1, i, c]
        else:
            if not estimator_step(S, F, W, C, g0, g1, dt, S_next, e, corrections):
                return k + 1, cost
            for i in range(n):
                x[i] += e[i]
        for i in range(n):
            for j in range(n):
                S[i, j] = S_next[i, j]
    return samples, cost


@njit_inline
def _apply(
    A: NDArray[np.float64], B: NDArray[np.float64], out: NDArray[np.float64], keep: float, sign: float = 1.0
) -> None:
    """`sign` A B, plus `keep` times what was there, into out: A (4, 4), B and out of four rows or more."""
    for i in range(4):
        a, b, c, d = sign * A[i, 0], sign * A[i, 1], sign * A[i, 2], sign * A[i, 3]
        for j in range(B.shape[1]):
            value = a * B[0, j] + b * B[1, j] + c * B[2, j] + d * B[3, j]
            out[i, j] = value if keep == 0.0 else keep * out[i, j] + value


@njit_inline
def _surprise(
    S: NDArray[np.float64],
    Phi: NDArray[np.float64],
    W: NDArray[np.float64],
    dt: float,
    weights: NDArray[np.float64],
    residual: NDArray[np.float64],
    held: NDArray[np.float64],
    spread: NDArray[np.float64],
    factor: NDArray[np.float64],
    row: NDArray[np.float64],
) -> float:
    """Ln det B + r' B^-1 r of the predicted residual r with B = 2 (Phi S Phi' + W dt) + R; rows not held left out."""
    n = S.shape[0]
    # R is block diagonal: u and w together, q, theta.
    determinant = weights[0, 0] * weights[1, 1] - weights[0, 1] * weights[0, 1]
    for i in range(n):
        for b in range(n):
            factor[i, b] = 0.0
            for a in range(n):
                factor[i, b] += 2.0 * Phi[i, a] * S[a, b]
        for j in range(n):
            value = 2.0 * W[i, j] * dt
            for b in range(n):
                value += factor[i, b] * Phi[j, b]
            spread[i, j] = value
    if determinant > 0.0:
        spread[0, 0] += weights[1, 1] / determinant
        spread[1, 1] += weights[0, 0] / determinant
        spread[0, 1] -= weights[0, 1] / determinant
        spread[1, 0] -= weights[0, 1] / determinant
    for i in range(2, n):
        spread[i, i] += 1.0 / weights[i, i]
    total = 0.0
    for i in range(n):
        if held[i] == 0.0:
            for j in range(n):
                spread[i, j] = 0.0
                spread[j, i] = 0.0
            spread[i, i] = 1.0
    cholesky(spread, factor, n)
    for i in range(n):
        row[i] = residual[i] if held[i] > 0.0 else 0.0
        for j in range(i):
            row[i] -= factor[i, j] * row[j]
        row[i] /= factor[i, i]
        total += row[i] * row[i] + 2.0 * np.log(factor[i, i])
    return total
