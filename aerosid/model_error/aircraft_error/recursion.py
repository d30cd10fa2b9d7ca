"""The continuous recursion (21)-(26) on an aircraft's equations of motion, compiled.

Candidates go through the same gains as the measurements, sample by sample.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import ALPHA_LIMIT, Flight
from aerosid.flight_model.layout import Layout, input_places, leading_columns, state_count, state_places
from aerosid.flight_model.loads import pressure_area
from aerosid.flight_model.rigid_body import rates_per_unit
from aerosid.flight_model.sampling_interval import Stages, inputs_at_end, integrate, make_stages
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.workspace import Workspace, make_workspace
from aerosid.model_error.invariant_embedding.estimator_step import estimator_step, gain_step, information
from aerosid.model_error.invariant_embedding.step_map import transition_step
from aerosid.model_error.invariant_embedding.step_work import StepWork, cholesky, step_work


class History(NamedTuple):
    """What the recursion writes, sample by sample; the attributes of `AircraftErrorHistory`, `columns` of all."""

    states: NDArray[np.float64]
    d: NDArray[np.float64]
    columns: NDArray[np.float64]
    rate_per_unit: NDArray[np.float64]
    innovations: NDArray[np.float64]
    riccati: NDArray[np.float64]


class _Matrices(NamedTuple):
    """Room for one sample: matrices of the c coupled states, in the letters of `_recur`."""

    predicted: NDArray[np.float64]
    factor: NDArray[np.float64]
    S: NDArray[np.float64]
    S_next: NDArray[np.float64]
    F: NDArray[np.float64]
    H: NDArray[np.float64]
    W: NDArray[np.float64]
    Q1: NDArray[np.float64]
    C: NDArray[np.float64]
    HQ: NDArray[np.float64]
    M0: NDArray[np.float64]
    M1: NDArray[np.float64]
    Phi: NDArray[np.float64]
    Gamma0: NDArray[np.float64]
    Gamma1: NDArray[np.float64]


class _Rows(NamedTuple):
    """Room for one sample: vectors of the c coupled states, in the letters of `_recur`; `ahead` (n) of all states."""

    row: NDArray[np.float64]
    r0: NDArray[np.float64]
    r1: NDArray[np.float64]
    weight: NDArray[np.float64]
    here: NDArray[np.float64]
    there: NDArray[np.float64]
    g0: NDArray[np.float64]
    g1: NDArray[np.float64]
    e: NDArray[np.float64]
    ahead: NDArray[np.float64]


class RecursionWeights(NamedTuple):
    """What the recursion is weighted with."""

    weights: NDArray[np.float64]  # (N, c, c) R^-1 of each sample of the measured states
    covariance: NDArray[np.float64]  # (N, c, c) R
    density: NDArray[np.float64]  # (c,) diagonal of Q2^-1
    riccati: NDArray[np.float64]  # (c, c) S at the first sample


class _Room(NamedTuple):
    """Work arrays of the recursion: of the equations of motion at a sample and ahead of it, then of its own algebra.

    `eps` (c, T + c) true minus estimated states of each candidate; `scratch` (2, c, T + c).
    """

    work: Workspace
    ahead: Workspace
    stages: Stages
    matrices: _Matrices
    rows: _Rows
    gains: StepWork
    corrections: StepWork
    eps: NDArray[np.float64]
    scratch: NDArray[np.float64]


@njit
def run(
    flight: Flight,
    start: NDArray[np.float64],
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    measured: NDArray[np.float64],
    given: RecursionWeights,
    likelihood: bool,
    history: History,
) -> tuple[int, float]:
    """The recursion over a whole record; returns the number of samples that it reached, and -2 ln L.

    Arrays are made here, of sizes that the compiler knows, so that the step's code is made for just that many states.
    """
    layout = constants.layout
    n = len(layout.sizes.coupled)
    extra, width = flight.inputs.shape[1] - leading_columns(layout), history.columns.shape[2]
    work, ahead = make_workspace(extra, table, layout), make_workspace(extra, table, layout)
    matrices = _Matrices(
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)),
    )  # fmt: skip
    rows = _Rows(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n),
        np.zeros(n), np.zeros(state_count(layout)),
    )  # fmt: skip
    room = _Room(
        work, ahead, make_stages(extra, layout), matrices, rows, step_work(n, n, n), step_work(n, 2, 2),
        np.zeros((n, width)), np.zeros((2, n, width)),
    )  # fmt: skip
    return _recur(flight, start.copy(), parameters, table, constants, measured, given, likelihood, history, room)


@njit_inline
def _recur(
    flight: Flight,
    x: NDArray[np.float64],
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    measured: NDArray[np.float64],
    given: RecursionWeights,
    likelihood: bool,
    history: History,
    room: _Room,
) -> tuple[int, float]:
    """As `run`, from `x` and in work arrays that are given."""
    layout = constants.layout
    n, count = len(layout.sizes.coupled), state_count(layout)
    p = n
    weights = given.weights
    states, d, columns, rate_per_unit, innovations, riccati = history
    samples, terms, width = flight.time.shape[0], parameters.shape[0], columns.shape[2]
    respond = width > 0
    cost = 0.0
    work, ahead, stages, matrices, rows, gains, corrections, eps, scratch = room
    predicted, factor, S, S_next, F, H, W, Q1, C, HQ, M0, M1, Phi, Gamma0, Gamma1 = matrices
    row, r0, r1, weight, here, there, g0, g1, e, ahead_x = rows
    for i in range(n):
        H[i, i] = 1.0
        W[i, i] = 0.5 * given.density[i]
        for j in range(n):
            S[i, j] = given.riccati[i, j]
        if respond:
            eps[i, terms + i] = 1.0
    for k in range(samples):
        evaluate(x, flight.inputs[k], parameters, table, constants, flight.positions, work, True, False)
        if not _within(x, flight.inputs[k], layout):
            return k, cost
        for i in range(n):
            states[k, i] = x[i]
            for j in range(n):
                F[i, j] = work.rates_x[i, j]
                riccati[k, i, j] = S[i, j]
        rates_per_unit(pressure_area(x, flight.inputs[k], constants), flight.inputs[k], constants, rate_per_unit[k])
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
                _apply(n, C, eps, scratch[0], 0.0)
                _apply(n, S, scratch[0], columns[k], 0.0)
        if k + 1 == samples:
            return samples, cost
        for i in range(count):
            ahead_x[i] = x[i]
            ahead.rates[i] = work.rates[i]
        inputs_at_end(flight.inputs[k], flight.inputs[k + 1], flight.held, flight.ramp, stages.last)
        integrate(
            ahead_x, flight.inputs[k], stages.last, dt, 0, flight.substeps, flight.substeps,
            parameters, table, constants, flight.positions, ahead, stages,
        )  # fmt: skip
        if not _within(ahead_x, flight.inputs[k + 1], layout):
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
            cost += _surprise(S, Phi, W, dt, given.covariance[k + 1], r1, there, predicted, factor, row)
        information(H, Q1, weight, HQ, C)
        for i in range(n):
            g0[i] = 0.0
            g1[i] = 0.0
            for j in range(p):
                g0[i] += HQ[i, j] * r0[j]
                g1[i] += HQ[i, j] * r1[j]
        for i in range(n):
            x[i] = ahead_x[i]
        for i in range(n, count):
            x[i] = ahead_x[i]
        if respond:
            if not gain_step(S, F, W, C, dt, S_next, M0, M1, gains):
                return k + 1, cost
            for i in range(n):
                for a in range(n):
                    x[i] += M0[i, a] * g0[a] + M1[i, a] * g1[a]
            # The candidates' true-minus-estimate: open loop with the candidate's rate, then the same correction.
            evaluate(ahead_x, stages.last, parameters, table, constants, flight.positions, ahead, True, False)
            _apply(n, C, eps, scratch[0], 0.0)
            _apply(n, Phi, eps, scratch[1], 0.0)
            _apply(n, Gamma0, work.rates_p, scratch[1], 1.0)
            _apply(n, Gamma1, ahead.rates_p, scratch[1], 1.0)
            _apply(n, M0, scratch[0], eps, 0.0, -1.0)
            _apply(n, C, scratch[1], scratch[0], 0.0)
            _apply(n, M1, scratch[0], eps, 1.0, -1.0)
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
def _within(x: NDArray[np.float64], u: NDArray[np.float64], layout: Layout) -> bool:
    """Whether the angle of attack, or the sideslip where it alone is estimated, is within the limit."""
    at = state_places(layout)
    inside: bool
    if len(layout.motion.u) > 0:
        inside = abs(np.arctan2(x[at.w], x[at.u])) < ALPHA_LIMIT
    else:
        inside = abs(x[at.v]) < u[input_places(layout).V]
    return inside


@njit_inline
def _apply(
    n: int, A: NDArray[np.float64], B: NDArray[np.float64], out: NDArray[np.float64], keep: float, sign: float = 1.0
) -> None:
    """`sign` A B, plus `keep` times what was there, into out: A (c, c), B and out of c rows or more."""
    for i in range(n):
        for j in range(B.shape[1]):
            value = 0.0
            for k in range(n):
                value += A[i, k] * B[k, j]
            out[i, j] = sign * value if keep == 0.0 else keep * out[i, j] + sign * value


@njit_inline
def _surprise(
    S: NDArray[np.float64],
    Phi: NDArray[np.float64],
    W: NDArray[np.float64],
    dt: float,
    covariance: NDArray[np.float64],
    residual: NDArray[np.float64],
    there: NDArray[np.float64],
    predicted: NDArray[np.float64],
    factor: NDArray[np.float64],
    row: NDArray[np.float64],
) -> float:
    """Ln det B + r' B^-1 r of the predicted residual r, B = 2 (Phi S Phi' + W dt) + R; missing rows left out."""
    n = S.shape[0]
    for i in range(n):
        for b in range(n):
            factor[i, b] = 0.0
            for a in range(n):
                factor[i, b] += 2.0 * Phi[i, a] * S[a, b]
        for j in range(n):
            value = 2.0 * W[i, j] * dt + covariance[i, j]
            for b in range(n):
                value += factor[i, b] * Phi[j, b]
            predicted[i, j] = value
    total = 0.0
    for i in range(n):
        if there[i] == 0.0:
            for j in range(n):
                predicted[i, j] = 0.0
                predicted[j, i] = 0.0
            predicted[i, i] = 1.0
    cholesky(predicted, factor, n)
    for i in range(n):
        row[i] = residual[i] if there[i] > 0.0 else 0.0
        for j in range(i):
            row[i] -= factor[i, j] * row[j]
        row[i] /= factor[i, i]
        total += row[i] * row[i] + 2.0 * np.log(factor[i, i])
    return total
