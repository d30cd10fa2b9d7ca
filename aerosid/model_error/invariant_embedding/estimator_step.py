"""The exact step of the invariant-embedding estimator with frozen linearisation.

Every estimator of this package (continuous, streaming, fixed interval, the aircraft's own driver) advances by these
kernels. They take plain contiguous float64 arrays and a `StepWork` made once by `step_work`; nothing is allocated
inside. They are merged into the loop that calls them. A loop that makes its arrays itself, of sizes written as numbers,
gets code for just these sizes: three times as fast as for any size, and compiled in less time.

Over a step of length dt with frozen F = f_x, W = (1/2) Q2^-1 and C = 2 H' Q1 H, the two-point boundary value problem
(18), (19) of Parameswaran & Raol 1994 for the deviation from the open-loop path is linear,

    x'      =  F x + W lambda + c(t)
    lambda' = -F' lambda + C x - g(t),     g = 2 H' Q1 r,  r the residual along the open-loop path,

which is (25), (26) with a forcing. Its solution is written from the two ends that are known (x at the beginning,
lambda at the end), not from one end to the other:

    x(dt)     = Phi x(0) + Q lambda(dt) + c_x
    lambda(0) = Phi' lambda(dt) - G x(0) + c_lambda.

In this form nothing grows, however stiff the step is, whereas the transition matrix of (25), (26) holds both
exp(+|s| dt) and exp(-|s| dt) and is useless past |s| dt of about 20. With x(0) = S lambda(0) (invariant embedding) it
gives the step of the Riccati equation (22) and of the mean (21):

    S(dt) = Q + Phi S (I + G S)^-1 Phi',    e(dt) = c_x + Phi S (I + G S)^-1 c_lambda.

(Phi, Q, G, c) of a short step come from a Taylor series that is exact to rounding, those of the whole step from
doubling it. The step is first balanced by a diagonal change of state units, so that neither the number of doublings
nor the rounding depends on the units in which the states are given.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.model_error.invariant_embedding.step_map import step_map, symmetrise
from aerosid.model_error.invariant_embedding.step_work import (
    AHEAD,
    AUGMENTED,
    BACK,
    LEFT,
    MIDDLE,
    SCALE,
    SERIES,
    StepWork,
    factor_information,
    solve_in_place,
)

Array = NDArray[np.float64]


@njit_inline
def riccati_step(S: Array, work: StepWork, S_next: Array) -> bool:
    """S at the end of the step in `work` into `S_next`; leaves the mean's response in a block, balanced.

    S+ = Q + Phi S (I + G S)^-1 Phi' is formed as Q + X X' with S = L L', I + L' G L = R R', X = Phi L R^-T:
    symmetric by construction, and the only inverse is of a matrix with eigenvalues of 1 or more.
    e = c_x + Phi S (I + G S)^-1 c_lambda uses the same factors.
    """
    blocks = work.blocks
    scale, ahead, back = blocks[SCALE, 0], blocks[AHEAD], blocks[BACK]
    X, middle, L, R, G = blocks[LEFT], blocks[MIDDLE], blocks[SERIES], blocks[SERIES + 1], blocks[SERIES + 2]
    n = S.shape[0]
    K = blocks.shape[2] - 3 * n
    e = n + K
    for i in range(n):
        for j in range(n):
            R[i, j] = S[i, j] / (scale[i] * scale[j])
            G[i, j] = back[i, K + j]
    factor_information(R, G, L, R, X, n)
    # X = R^-1 L' [Phi' | c_lambda], row by row
    for i in range(n):
        for j in range(n):
            X[i, j] = L[j, i]
        for j in range(n, n + K):
            X[i, j] = 0.0
        for m in range(i, n):
            t = L[m, i]
            for j in range(n):
                X[i, j] += t * ahead[j, e + m]
            for j in range(K):
                X[i, n + j] -= t * back[m, j]
        for m in range(i):
            r = R[i, m]
            for j in range(n + K):
                X[i, j] -= r * X[m, j]
        inverse = 1.0 / R[i, i]
        for j in range(n + K):
            X[i, j] *= inverse
    finite = True
    for i in range(n):
        for j in range(n + K):
            middle[i, j] = ahead[i, j]
        for m in range(n):
            t = X[m, i]
            for j in range(n + K):
                middle[i, j] += t * X[m, j]
    for i in range(n):
        for j in range(i + 1):
            value = middle[i, j] * scale[i] * scale[j]
            S_next[i, j] = value
            S_next[j, i] = value
        finite = finite and S_next[i, i] < math.inf
    return finite


@njit_inline
def read_response(work: StepWork, e: Array) -> None:
    """Response e of `riccati_step` to a forcing v linear in time, whose columns are v0 and v1 - v0."""
    blocks = work.blocks
    n = e.shape[0]
    last = blocks.shape[2] - 2 * n - 1  # the ramp of v1 - v0; its constant is only needed by the ramp's doubling
    for i in range(n):
        e[i] = blocks[SCALE, 0, i] * (blocks[MIDDLE, i, n] + blocks[MIDDLE, i, last])


@njit_inline
def start_from(delta: Array, work: StepWork) -> None:
    """The map in `work` for a deviation delta, (n,), at the beginning of the step: Phi delta and -G delta are added."""
    blocks, scale = work.blocks, work.blocks[SCALE, 0]
    n = delta.shape[0]
    K = blocks.shape[2] - 3 * n
    for i in range(n):
        blocks[AHEAD, i, n] += delta[i] / scale[i]
        for j in range(n):
            blocks[AHEAD, i, n] += blocks[AHEAD, i, n + K + j] * delta[j] / scale[j]
            blocks[BACK, i, 0] += blocks[BACK, i, K + j] * delta[j] / scale[j]


@njit_inline
def costate_step(S: Array, costate: Array, future: Array, work: StepWork) -> bool:
    """Costate and future information carried from the end of the step in `work` to its beginning, in place.

    Parameters
    ----------
    S : (n, n)
        Riccati matrix at the beginning of the step.
    costate : (n,)
        lambda at the end; becomes (I + G S)^-1 (Phi' lambda + c_lambda) of the beginning.
    future : (n, n)
        What the record after the end of the step tells of the state there, N, in the units of 2 H' Q1 H; becomes
        G + Phi' N (I + Q N)^-1 Phi of the beginning.
    work : StepWork
        After `step_map` with columns as for `read_response`, and `start_from`.
    """
    blocks = work.blocks
    scale, ahead, back, aug, left = blocks[SCALE, 0], blocks[AHEAD], blocks[BACK], blocks[AUGMENTED], blocks[LEFT]
    n = S.shape[0]
    K = blocks.shape[2] - 3 * n
    e = n + K
    for i in range(n):
        aug[i, n] = costate[i] * scale[i] - back[i, 0] - back[i, K - 1]
        for j in range(n):
            aug[i, n] += ahead[j, e + i] * costate[j] * scale[j]
            aug[i, j] = 1.0 if i == j else 0.0
            for m in range(n):
                aug[i, j] += back[i, K + m] * S[m, j] / (scale[m] * scale[j])
    if not solve_in_place(aug, n, n + 1):
        return False
    for i in range(n):
        costate[i] = aug[i, n] / scale[i]
    # I + N Q | N Phi
    for i in range(n):
        for j in range(n):
            aug[i, j] = 1.0 if i == j else 0.0
            aug[i, n + j] = future[i, j] * (scale[i] * scale[j])
            for m in range(n):
                N = future[i, m] * (scale[i] * scale[m])
                aug[i, j] += N * ahead[m, j]
                aug[i, n + j] += N * ahead[m, e + j]
    if not solve_in_place(aug, n, 2 * n):
        return False
    for i in range(n):
        for j in range(n):
            left[i, j] = back[i, K + j] + aug[i, n + j]
            for m in range(n):
                left[i, j] += ahead[m, e + i] * aug[m, n + j]
    symmetrise(left, 0, n)
    for i in range(n):
        for j in range(n):
            future[i, j] = left[i, j] / (scale[i] * scale[j])
    return True


@njit_inline
def estimator_step(
    S: Array, F: Array, W: Array, C: Array, g0: Array, g1: Array, dt: float, S_next: Array, e: Array, work: StepWork
) -> bool:
    """S and the correction of the mean at the end of a step: the step of (21), (22).

    Parameters
    ----------
    S : (n, n)
        Riccati matrix at the beginning of the step, positive definite.
    F, W, C : (n, n)
        f_x; (1/2) Q2^-1; 2 H' Q1 H; frozen over the step.
    g0, g1 : (n,)
        2 H' Q1 r with the residual r = y - h at the beginning, and at the end of the step on the open-loop path;
        linear in time between.
    dt : float
        Length of the step, s.
    S_next : (n, n)
        Out: Riccati matrix at the end.
    e : (n,)
        Out: what is to be added to the open-loop state at the end; the solution at dt of
        e' = F e + 2 S(t) H' Q1 (r(t) - H e), e(0) = 0.
    work : StepWork
        From `step_work(n)`.

    Returns
    -------
    bool
        False where the step cannot be formed (not finite).
    """
    n = F.shape[0]
    forcing = work.forcing
    for i in range(n):
        forcing[i, 0] = 0.0
        forcing[i, 1] = 0.0
        forcing[n + i, 0] = -g0[i]
        forcing[n + i, 1] = -(g1[i] - g0[i])
    if not step_map(F, W, C, dt, work):
        return False
    finite = riccati_step(S, work, S_next)
    read_response(work, e)
    return finite


@njit_inline
def gain_step(
    S: Array, F: Array, W: Array, C: Array, dt: float, S_next: Array, M0: Array, M1: Array, work: StepWork
) -> bool:
    """As `estimator_step` for every residual at once: e = M0 g0 + M1 g1.

    Parameters
    ----------
    S, F, W, C, dt, S_next
        As for `estimator_step`.
    M0, M1 : (n, n)
        Out. The gains on the residuals themselves are M0 (2 H' Q1) and M1 (2 H' Q1).
    work : StepWork
        From `step_work(n, n, n)`.

    Returns
    -------
    bool
        False where the step cannot be formed (not finite).
    """
    n = F.shape[0]
    forcing = work.forcing
    for i in range(n):
        for j in range(n):
            forcing[i, j] = 0.0
            forcing[n + i, j] = 0.0
        forcing[n + i, i] = -1.0
    if not step_map(F, W, C, dt, work):
        return False
    finite = riccati_step(S, work, S_next)
    scale, e = work.blocks[SCALE, 0], work.blocks[MIDDLE]
    for i in range(n):
        for j in range(n):
            ramp = scale[i] * e[i, 2 * n + j]
            M0[i, j] = scale[i] * e[i, n + j] - ramp
            M1[i, j] = ramp
    return finite


@njit_inline
def information(H: Array, Q1: Array, weight: Array, HQ: Array, C: Array) -> None:
    """2 H' Q1 and 2 H' Q1 H with rows of H weighted.

    Parameters
    ----------
    H : (p, n)
        Observation matrix.
    Q1 : (p, p)
        Measurement weight.
    weight : (p,)
        1 for a row that counts, 0 for one that is missing, 1/2 for one that is measured at one end of the step only;
        Q1[i, j] is scaled by the root of weight[i] weight[j].
    HQ : (n, p)
        Out: 2 H' Q1.
    C : (n, n)
        Out: 2 H' Q1 H.
    """
    p, n = H.shape
    for i in range(n):
        for j in range(p):
            HQ[i, j] = 0.0
    for m in range(p):
        if weight[m] > 0.0:
            for j in range(p):
                if weight[j] > 0.0 and Q1[m, j] != 0.0:
                    q = 2.0 * Q1[m, j] * math.sqrt(weight[m] * weight[j])
                    for i in range(n):
                        HQ[i, j] += q * H[m, i]
    for i in range(n):
        for j in range(i + 1):
            C[i, j] = 0.0
        for m in range(p):
            a = HQ[i, m]
            if a != 0.0:
                for j in range(i + 1):
                    C[i, j] += a * H[m, j]
        for j in range(i):
            C[j, i] = C[i, j]


@njit_inline
def predict_riccati(F: Array, S: Array, W: Array, P: Array, work: StepWork) -> None:
    """P = F S F' + W, (11), with W = (1/2) Q2^-1; P may be S."""
    X = work.blocks[LEFT]
    n = F.shape[0]
    for i in range(n):
        for j in range(n):
            value = 0.0
            for m in range(n):
                value += F[i, m] * S[m, j]
            X[i, j] = value
    for i in range(n):
        for j in range(i + 1):
            value = W[i, j]
            for m in range(n):
                value += X[i, m] * F[j, m]
            P[i, j] = value
            P[j, i] = value


@njit_inline
def measurement_update(P: Array, C: Array, g: Array, S: Array, d: Array, work: StepWork) -> bool:
    """The update of (9), (10), (12) at a sample: S = (I + P C)^-1 P and the correction d = S g.

    Parameters
    ----------
    P : (n, n)
        A-priori Riccati matrix of (11).
    C : (n, n)
        2 H' Q1 H of the rows that are measured.
    g : (n,)
        2 H' Q1 (y - h) of the rows that are measured.
    S : (n, n)
        Out: a-posteriori Riccati matrix; may be P.
    d : (n,)
        Out: the correction of the state.
    work : StepWork
        From `step_work(n)`.

    Returns
    -------
    bool
        False where S is not finite.
    """
    n = P.shape[0]
    X, L, R = work.blocks[LEFT], work.blocks[SERIES], work.blocks[SERIES + 1]
    factor_information(P, C, L, R, X, n)
    for i in range(n):  # X = R^-1 L'
        for j in range(n):
            X[i, j] = L[j, i]
        for m in range(i):
            r = R[i, m]
            for j in range(n):
                X[i, j] -= r * X[m, j]
        inverse = 1.0 / R[i, i]
        for j in range(n):
            X[i, j] *= inverse
    finite = True
    for i in range(n):
        for j in range(i + 1):
            value = 0.0
            for m in range(n):
                value += X[m, i] * X[m, j]
            S[i, j] = value
            S[j, i] = value
        finite = finite and S[i, i] < math.inf
    for i in range(n):
        value = 0.0
        for j in range(n):
            value += S[i, j] * g[j]
        d[i] = value
    return finite
