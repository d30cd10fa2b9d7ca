"""Compiled sweeps of the fixed-interval solution: forward with the filter, backward with costate and information.

The costate carries the mean. What the rest of the record tells of a state is carried beside it as an information
matrix N of its own (the same map, read backward), since covariances formed by differences lose their digits where the
record tells much more than the past.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.model_error.invariant_embedding.estimator_step import (
    costate_step,
    measurement_update,
    predict_riccati,
    read_response,
    riccati_step,
    start_from,
)
from aerosid.model_error.invariant_embedding.residuals import multiply, weigh_sample, weigh_step
from aerosid.model_error.invariant_embedding.step_map import step_map
from aerosid.model_error.invariant_embedding.step_work import StepWork

Array = NDArray[np.float64]


class DiscreteRecord(NamedTuple):
    """A record of a discrete model, linearised along a trajectory."""

    F: Array  # (N - 1, n, n) f_x of each step
    H: Array  # (N, p, n) h_x
    offset: Array  # (N - 1, n) f(x) - x(next) along the trajectory
    residual: Array  # (N, p) y - h along the trajectory
    Q1: Array  # (1 or N, p, p)
    W: Array  # (1 or N, n, n) (1/2) Q2^-1
    start: Array  # (n,) x0 minus the trajectory's first state


class ContinuousRecord(NamedTuple):
    """A record of a model of rates, linearised about the chord of each step of a trajectory."""

    time: Array  # (N,) s
    F: Array  # (N - 1, n, n) f_x of each step
    H: Array  # (N - 1, p, n) h_x of each step
    before: Array  # (N - 1, n) f - dx/dt along the chord at the beginning of each step
    after: Array  # (N - 1, n) the same at its end
    r0: Array  # (N - 1, p) residual at the beginning of each step
    r1: Array  # (N - 1, p) the same at its end
    Q1: Array  # (1 or N, p, p)
    W: Array  # (1 or N, n, n) (1/2) Q2^-1
    start: Array  # (n,) x0 minus the trajectory's first state


class Smoothed(NamedTuple):
    """What a sweep writes; all of a state or of d given the whole record, but for S, which is the filter's."""

    S: Array  # (N, n, n); S[0] comes as the a-priori S0
    delta: Array  # (N, n) deviation from the trajectory
    costate: Array  # (N, n), or (N - 1, n) of a discrete model
    covariance: Array  # (N, n, n)
    d_covariance: Array  # (N - 1, n, n) of each step's d, or of its mean
    d_mean: Array  # (N - 1, n) that mean; untouched by a discrete model


@njit
def sweep_discrete(record: DiscreteRecord, smoothed: Smoothed, work: StepWork) -> bool:
    """Forward and backward over the linearised record; False where it stops being finite."""
    F, H, offset, residual, Q1, W, start = record
    S, delta, costate, covariance, d_covariance, _ = smoothed
    N, p, n = H.shape
    HQ, C, g = np.empty((n, p)), np.zeros((N, n, n)), np.zeros((N, n))
    weight, r = np.empty(p), np.empty(p)
    P, future, known, vector, correction = S.copy(), np.zeros((n, n)), np.empty((n, n)), start.copy(), np.empty(n)
    spread = np.empty((n, n))
    for k in range(N):
        if k > 0:
            multiply(F[k - 1], delta[k - 1], vector)
            vector += offset[k - 1]
            predict_riccati(F[k - 1], S[k - 1], W[min(k - 1, W.shape[0] - 1)], P[k], work)
        weigh_sample(H[k], Q1[min(k, Q1.shape[0] - 1)], residual[k], weight, r, HQ, C[k], g[k])
        multiply(C[k], vector, correction)
        correction = g[k] - correction
        if not measurement_update(P[k], C[k], correction, S[k], delta[k], work):
            return False
        delta[k] += vector
    covariance[N - 1] = 2.0 * S[N - 1]
    for j in range(N - 2, -1, -1):
        # costate[j] holds lambda(j): (7) with the smoothed residual at j + 1.
        multiply(C[j + 1], delta[j + 1], correction)
        costate[j] = g[j + 1] - correction
        if j < N - 2:
            for i in range(n):
                for m in range(n):
                    costate[j, i] += F[j + 1, m, i] * costate[j + 1, m]
        for i in range(n):
            vector[i] = 0.0
            for m in range(n):
                vector[i] += F[j, m, i] * costate[j, m]
        multiply(S[j], vector, correction)
        delta[j] += correction
        # future: information of the record from j + 1 on about the state there, measurement included.
        future += C[j + 1]
        W_j = W[min(j, W.shape[0] - 1)]
        measurement_update(future, P[j + 1], correction, known, vector, work)
        for a in range(n):
            for b in range(n):
                value = W_j[a, b]
                for c in range(n):
                    for e in range(n):
                        value -= W_j[a, c] * known[c, e] * W_j[e, b]
                d_covariance[j, a, b] = 2.0 * value
        measurement_update(future, W_j, correction, known, vector, work)
        predict_riccati(np.ascontiguousarray(F[j].T), known, np.zeros((n, n)), future, work)
        measurement_update(S[j], future, correction, spread, vector, work)
        covariance[j] = 2.0 * spread
    return True


@njit
def sweep_continuous(record: ContinuousRecord, smoothed: Smoothed, work: StepWork, work2: StepWork) -> bool:
    """As `sweep_discrete` for rates; `work2` is of 2 n states."""
    time, F, H, before, after, r0, r1, Q1, W, start = record
    S, delta, costate, covariance, d_covariance, d_mean = smoothed
    N, n = S.shape[0], S.shape[1]
    p = r0.shape[1]
    HQ, C = np.empty((n, p)), np.empty((n, n))
    weight, r, g0, g1 = np.empty(p), np.empty(p), np.empty(n), np.empty(n)
    for i in range(n):
        delta[0, i] = start[i]
    for k in range(N - 1):
        weigh_step(H[k], Q1[min(k, Q1.shape[0] - 1)], r0[k], r1[k], weight, r, HQ, C, g0, g1)
        dt = time[k + 1] - time[k]
        _force(before[k], after[k], g0, g1, work)
        if not step_map(F[k], W[min(k, W.shape[0] - 1)], C, dt, work):
            return False
        start_from(delta[k], work)
        if not riccati_step(S[k], work, S[k + 1]):
            return False
        read_response(work, delta[k + 1])
    covariance[N - 1] = 2.0 * S[N - 1]
    future, spread, unused = np.zeros((n, n)), np.empty((n, n)), np.zeros(n)
    # The state with the integral of d over the step beside it, for the covariance of that integral.
    F2, W2, C2, S2, S2_next = (
        np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n)),
        np.zeros((2 * n, 2 * n)),
    )  # fmt: skip
    future2, spread2, zero2, mean2 = (
        np.zeros((2 * n, 2 * n)),
        np.empty((2 * n, 2 * n)),
        np.zeros(2 * n),
        np.zeros(2 * n),
    )
    delta2 = np.zeros(2 * n)
    for i in range(n):
        costate[N - 1, i] = 0.0
    for k in range(N - 2, -1, -1):
        weigh_step(H[k], Q1[min(k, Q1.shape[0] - 1)], r0[k], r1[k], weight, r, HQ, C, g0, g1)
        dt = time[k + 1] - time[k]
        W_k = W[min(k, W.shape[0] - 1)]
        for i in range(n):
            delta2[i] = delta[k, i]
            for j in range(n):
                F2[i, j] = F[k, i, j]
                C2[i, j] = C[i, j]
                S2[i, j] = S[k, i, j]
                future2[i, j] = future[i, j]
                W2[i, j] = W_k[i, j]
                W2[n + i, j] = W_k[i, j]
                W2[i, n + j] = W_k[i, j]
                W2[n + i, n + j] = W_k[i, j]
        for i in range(n):
            work2.forcing[i, 0] = before[k, i]
            work2.forcing[i, 1] = after[k, i] - before[k, i]
            work2.forcing[2 * n + i, 0] = -g0[i]
            work2.forcing[2 * n + i, 1] = -(g1[i] - g0[i])
            for j in range(2):
                work2.forcing[n + i, j] = 0.0
                work2.forcing[3 * n + i, j] = 0.0
        if not step_map(F2, W2, C2, dt, work2):
            return False
        start_from(delta2, work2)
        riccati_step(S2, work2, S2_next)
        read_response(work2, mean2)
        measurement_update(S2_next, future2, zero2, spread2, zero2, work2)
        for i in range(n):
            d_mean[k, i] = mean2[n + i] / dt
            for j in range(n):
                # Smoothed: the filter's mean at the end of the step plus S lambda there.
                d_mean[k, i] += S2_next[n + i, j] * costate[k + 1, j] / dt
                d_covariance[k, i, j] = 2.0 * spread2[n + i, n + j] / dt**2
        _force(before[k], after[k], g0, g1, work)
        step_map(F[k], W_k, C, dt, work)
        start_from(delta[k], work)
        for i in range(n):
            costate[k, i] = costate[k + 1, i]
        if not costate_step(S[k], costate[k], future, work):
            return False
        measurement_update(S[k], future, unused, spread, g0, work)
        covariance[k] = 2.0 * spread
    for k in range(N):
        multiply(S[k], costate[k], g0)
        for i in range(n):
            delta[k, i] += g0[i]
    return True


@njit
def _force(before: Array, after: Array, g0: Array, g1: Array, work: StepWork) -> None:
    n = before.shape[0]
    for i in range(n):
        work.forcing[i, 0] = before[i]
        work.forcing[i, 1] = after[i] - before[i]
        work.forcing[n + i, 0] = -g0[i]
        work.forcing[n + i, 1] = -(g1[i] - g0[i])
