"""The transition of the linear form (25), (26) over a step, by structure-preserving doubling."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.model_error.invariant_embedding.step_work import (
    AHEAD,
    AUGMENTED,
    BACK,
    LEFT,
    MIDDLE,
    SCALE,
    SERIES,
    StepWork,
    multiply,
    solve_in_place,
)

Array = NDArray[np.float64]


_SHORT_STEP_NORM = 1.0 / 11.0
"""Numerical: balanced norm of the short step; the first neglected term of the ninth-degree series, relative to the
linear one, is (1/11)^9 / 10! = 1.2e-16."""

_MAX_DOUBLINGS = 60
"""Numerical: a step of norm 2^60 short steps is beyond any meaning of the numbers; more only spread rounding."""


@njit_inline
def _balance(F: Array, W: Array, C: Array, scale: Array) -> float:
    """State units into `scale` that make the norm of [[F, W], [C, -F']] small; returns that norm (largest row sum).

    Osborne's balancing, restricted to the symplectic scalings x -> x/s, lambda -> s lambda: each state's unit is set
    so that what enters its equation weighs as much as what it enters. From (W_ii/C_ii)^(1/4) three sweeps suffice.
    """
    n = F.shape[0]
    for i in range(n):
        scale[i] = 1.0
        if W[i, i] > 0.0 and C[i, i] > 0.0:
            scale[i] = math.sqrt(math.sqrt(W[i, i] / C[i, i]))
    for _ in range(3):
        for i in range(n):
            # W_ii and C_ii change with the square of the unit; their roots put them on the footing of the others.
            into = math.sqrt(abs(W[i, i]))
            out = math.sqrt(abs(C[i, i]))
            for j in range(n):
                if j != i:
                    into += abs(F[i, j]) * scale[j] + abs(W[i, j]) / scale[j]
                    out += abs(F[j, i]) / scale[j] + abs(C[i, j]) * scale[j]
            if into > 0.0 and out > 0.0:
                scale[i] = math.sqrt(into / out)
    norm = 0.0
    for i in range(n):
        upper = 0.0
        lower = 0.0
        for j in range(n):
            upper += abs(F[i, j]) * scale[j] / scale[i] + abs(W[i, j]) / (scale[i] * scale[j])
            lower += abs(F[j, i]) * scale[i] / scale[j] + abs(C[i, j]) * scale[i] * scale[j]
        norm = max(norm, upper, lower)
    return norm


@njit_inline
def _series_term(c: int, W0: Array, W1: Array, W2: Array, out: Array, n2: int, k: int, K: int) -> None:
    """Three terms, (W0 + W1/(c + 2) + W2/(c + 2)(c + 3))/(c + 1)!, added; ramp columns are one factorial further."""
    factorial = 1.0
    for i in range(2, c + 2):
        factorial *= i
    for i in range(n2):
        f0 = 1.0 / factorial
        f1 = f0 / (c + 2)
        f2 = f1 / (c + 3)
        for j in range(n2 + K):
            if j == n2 + k:
                f0, f1, f2 = f1, f2, f2 / (c + 4)
            out[i, j] += f0 * W0[i, j] + f1 * W1[i, j] + f2 * W2[i, j]


@njit_inline
def _short_step(work: StepWork) -> bool:
    """The step whose Hamiltonian A and forcing b, times its length, stand as A | b | b of the ramps in block SERIES.

    M - I = phi_1(A) A and the responses phi_1(A) b, phi_2(A) b by the Taylor series to the ninth power of A, summed in
    powers of A^3 (Paterson and Stockmeyer) for all columns together; phi_m(A) = sum A^j/(j + m)!.
    """
    blocks = work.blocks
    W0, W1, W2, T, M = (
        blocks[SERIES], blocks[SERIES + 1], blocks[SERIES + 2], blocks[SERIES + 3], blocks[SERIES + 4],
    )  # fmt: skip
    n2, k = work.forcing.shape
    n = n2 // 2
    K = blocks.shape[2] - 3 * n
    width = n2 + K
    multiply(W0, W0, W1, n2, n2, width)
    multiply(W0, W1, W2, n2, n2, width)  # begins with A^3
    for i in range(n2):
        for j in range(width):
            T[i, j] = 0.0
    _series_term(6, W0, W1, W2, T, n2, k, K)
    multiply(W2, T, M, n2, n2, width)
    _series_term(3, W0, W1, W2, M, n2, k, K)
    multiply(W2, M, T, n2, n2, width)
    _series_term(0, W0, W1, W2, T, n2, k, K)

    # From one-ended to two-ended: Phi' = M22^-1, G = M22^-1 M21, -c_lambda = M22^-1 z_lambda.
    aug, ahead, back = blocks[AUGMENTED], blocks[AHEAD], blocks[BACK]
    for i in range(n):
        for j in range(n):
            aug[i, j] = T[n + i, n + j]
            aug[i, n + j] = -T[n + i, n + j]
            aug[i, n2 + K + j] = T[n + i, j]
        aug[i, i] += 1.0
        for j in range(K):
            aug[i, n2 + j] = T[n + i, n2 + j]
    if not solve_in_place(aug, n, 3 * n + K):
        return False
    for i in range(n):
        for j in range(n + K):
            back[i, j] = aug[i, n2 + j]
            ahead[i, j] = T[i, n + j]  # M12 | z_x
        for j in range(n):
            ahead[i, n + K + j] = aug[j, n + i]
        for m in range(n):
            t = T[i, n + m]
            for j in range(n):
                ahead[i, j] += t * aug[m, n + j]
            for j in range(n, n + K):
                ahead[i, j] -= t * aug[m, n + j]
    symmetrise(ahead, 0, n)
    symmetrise(back, K, n)
    return True


@njit_inline
def symmetrise(A: Array, first: int, n: int) -> None:
    """The n columns of A from `first` on replaced by their symmetric part."""
    for i in range(n):
        for j in range(i):
            mean = 0.5 * (A[i, first + j] + A[j, first + i])
            A[i, first + j] = mean
            A[j, first + i] = mean


@njit_inline
def _double(work: StepWork) -> bool:
    """The step in `work` followed by itself; ramps rise over both together.

    Structure-preserving doubling: with V = (I + Q G)^-1,
    Phi <- Phi V Phi, Q <- Q + Phi V Q Phi', G <- G + Phi' G V Phi,
    and, with the first half's forcing a and the second half's b, y = V (a_x + Q b_lambda),
    c_x <- b_x + Phi y, c_lambda <- a_lambda + Phi' (b_lambda - G y).
    V Phi = I + Z gives Phi V Phi - I = E + Phi Z with E = Phi - I, which is exact where the step is short.
    """
    blocks = work.blocks
    ahead, back, left, aug, middle = (
        blocks[AHEAD], blocks[BACK], blocks[LEFT], blocks[AUGMENTED], blocks[MIDDLE],
    )  # fmt: skip
    n2, k = work.forcing.shape
    n = n2 // 2
    K = blocks.shape[2] - 3 * n
    ramp = K - k
    e = n + K  # where Phi - I begins in `ahead`, and Z after V Q Phi' and y in the solution
    for i in range(n):
        # left: G | Phi' | b_lambda. A ramp begins as half a ramp and goes on as half a constant and half a ramp.
        for j in range(n):
            left[i, j] = back[i, K + j]
            left[i, n + j] = ahead[j, e + i]
        left[i, n + i] += 1.0
        for j in range(k):
            left[i, n2 + j] = -back[i, j]
        for j in range(k, K):
            back[i, j] *= 0.5
            left[i, n2 + j] = -0.5 * back[i, j - ramp] - back[i, j]
    # aug: I + Q G | Q Phi' | a_x + Q b_lambda | Q G Phi
    multiply(ahead, left, aug, n, n, n2 + K)
    for i in range(n):
        for j in range(n):
            aug[i, n2 + K + j] = aug[i, j]
        for m in range(n):
            t = aug[i, m]
            for j in range(n):
                aug[i, n2 + K + j] += t * ahead[m, e + j]
        aug[i, i] += 1.0
        for j in range(k):
            aug[i, n2 + j] += ahead[i, n + j]
        for j in range(k, K):
            aug[i, n2 + j] += 0.5 * ahead[i, n + j]
            ahead[i, n + j] = 0.5 * (ahead[i, n + j] + ahead[i, n + j - ramp])
    if not solve_in_place(aug, n, 3 * n + K):
        return False
    for i in range(n):  # the last columns hold V Q G Phi; Z = E - V Q G Phi
        for j in range(n):
            aug[i, n2 + K + j] = ahead[i, e + j] - aug[i, n2 + K + j]
    for i in range(n):  # G y - b_lambda | G V Phi
        for j in range(K):
            middle[i, j] = -left[i, n2 + j]
        for j in range(n):
            middle[i, K + j] = left[i, j]
        for m in range(n):
            g = left[i, m]
            for j in range(n + K):
                middle[i, j] += g * aug[m, n2 + j]
    for i in range(n):
        for m in range(n):
            t = left[i, n + m]  # Phi'
            for j in range(n + K):
                back[i, j] += t * middle[m, j]
            t = left[m, n + i]  # Phi
            for j in range(n2 + K):
                ahead[i, j] += t * aug[m, n + j]
    symmetrise(ahead, 0, n)
    symmetrise(back, K, n)
    return True


@njit_inline
def _halvings(norm: float) -> int:
    """How often a step of this norm, 1, is halved to be short."""
    halvings = 0
    while norm > _SHORT_STEP_NORM and halvings < _MAX_DOUBLINGS:
        norm *= 0.5
        halvings += 1
    return halvings


@njit_inline
def step_map(F: Array, W: Array, C: Array, dt: float, work: StepWork) -> bool:
    """The step's Phi, Q, G, c_x, c_lambda into `work`, in balanced units; False where they cannot be formed.

    Parameters
    ----------
    F : (n, n)
        f_x, 1/s times state units.
    W : (n, n)
        (1/2) Q2^-1, positive semi-definite.
    C : (n, n)
        2 H' Q1 H, positive semi-definite.
    dt : float
        Length of the step, s.
    work : StepWork
        work.forcing[:n] holds c, work.forcing[n:] holds -g, column by column, in the caller's units.
    """
    n = F.shape[0]
    scale, A, forcing = work.blocks[SCALE, 0], work.blocks[SERIES], work.forcing
    k = forcing.shape[1]
    K = work.blocks.shape[2] - 3 * n
    norm = _balance(F, W, C, scale) * dt
    if not norm < math.inf:
        return False
    doublings = _halvings(norm)
    dt *= 0.5**doublings
    for i in range(n):
        down, up = dt / scale[i], dt * scale[i]
        for j in range(n):
            A[i, j] = F[i, j] * down * scale[j]
            A[n + i, n + j] = -F[j, i] * up / scale[j]
            A[i, n + j] = W[i, j] * down / scale[j]
            A[n + i, j] = C[i, j] * up * scale[j]
        for j in range(K):
            m = j if j < k else j - (K - k)
            A[i, 2 * n + j] = forcing[i, m] * down
            A[n + i, 2 * n + j] = forcing[n + i, m] * up
    if not _short_step(work):
        return False
    sound = True
    for _ in range(doublings):
        sound = sound and _double(work)
    return sound


@njit_inline
def transition_step(F: Array, dt: float, Phi: Array, Gamma0: Array, Gamma1: Array, work: StepWork) -> bool:
    """exp(F dt) and what a forcing that is linear over the step leaves at its end: Gamma0 c0 + Gamma1 c1.

    Parameters
    ----------
    F : (n, n)
        f_x, frozen over the step.
    dt : float
        Length of the step, s.
    Phi, Gamma0, Gamma1 : (n, n)
        Out. Gamma0 + Gamma1 is the integral of exp(F s) over the step, s.
    work : StepWork
        From `step_work(n)`.

    Notes
    -----
    phi_2(A) = sum A^j/(j + 2)! to the eighth power gives phi_1 = I + A phi_2 and exp = I + A phi_1, of a short step;
    doubled, with E = exp - I: E <- 2 E + E E, phi_1 <- 2 phi_1 + E phi_1, and of the ramp, which rises over both
    halves, phi_2 <- phi_2 + (phi_1 + E phi_2)/2.
    """
    n = F.shape[0]
    blocks = work.blocks
    scale, A, A2, A3, T, M = (
        blocks[SCALE, 0], blocks[SERIES], blocks[SERIES + 1], blocks[SERIES + 2], blocks[SERIES + 3],
        blocks[SERIES + 4],
    )  # fmt: skip
    for i in range(n):
        for j in range(n):
            Phi[i, j] = 0.0
    norm = _balance(F, Phi, Phi, scale) * dt
    if not norm < math.inf:
        return False
    doublings = _halvings(norm)
    dt *= 0.5**doublings
    for i in range(n):
        for j in range(n):
            A[i, j] = F[i, j] * dt * scale[j] / scale[i]
    multiply(A, A, A2, n, n, n)
    multiply(A, A2, A3, n, n, n)
    for i in range(n):
        for j in range(n):
            T[i, j] = A[i, j] / 362880.0 + A2[i, j] / 3628800.0
        T[i, i] += 1.0 / 40320.0
    multiply(A3, T, M, n, n, n)
    for i in range(n):
        for j in range(n):
            M[i, j] += A[i, j] / 720.0 + A2[i, j] / 5040.0
        M[i, i] += 1.0 / 120.0
    multiply(A3, M, T, n, n, n)
    # M: E | dt phi_1 | dt phi_2
    for i in range(n):
        for j in range(n):
            T[i, j] += A[i, j] / 6.0 + A2[i, j] / 24.0
        T[i, i] += 0.5
        for j in range(n):
            M[i, 2 * n + j] = dt * T[i, j]
    multiply(A, T, A2, n, n, n)
    for i in range(n):
        A2[i, i] += 1.0
        for j in range(n):
            M[i, n + j] = dt * A2[i, j]
    multiply(A, A2, M, n, n, n)
    for _ in range(doublings):
        multiply(M, M, T, n, n, 3 * n)
        for i in range(n):
            for j in range(n):
                M[i, 2 * n + j] += 0.5 * (M[i, n + j] + T[i, 2 * n + j])
            for j in range(2 * n):
                M[i, j] = 2.0 * M[i, j] + T[i, j]
    for i in range(n):
        for j in range(n):
            unit = scale[i] / scale[j]
            Phi[i, j] = M[i, j] * unit
            Gamma1[i, j] = M[i, 2 * n + j] * unit
            Gamma0[i, j] = M[i, n + j] * unit - Gamma1[i, j]
        Phi[i, i] += 1.0
    return True


@njit_inline
def read_map(work: StepWork, Phi: Array, Q: Array, G: Array, c_x: Array, c_lambda: Array) -> None:
    """The step that `step_map` left in `work`, in the caller's units.

    Parameters
    ----------
    work : StepWork
    Phi, Q, G : (n, n)
        Out.
    c_x, c_lambda : (n, K)
        Out: the response to each constant column, then to each ramp.
    """
    ahead, back, scale = work.blocks[AHEAD], work.blocks[BACK], work.blocks[SCALE, 0]
    n = Phi.shape[0]
    K = work.blocks.shape[2] - 3 * n
    for i in range(n):
        for j in range(n):
            Phi[i, j] = ahead[i, n + K + j] * scale[i] / scale[j]
            Q[i, j] = ahead[i, j] * (scale[i] * scale[j])
            G[i, j] = back[i, K + j] / (scale[i] * scale[j])
        Phi[i, i] += 1.0
        for j in range(K):
            c_x[i, j] = ahead[i, n + j] * scale[i]
            c_lambda[i, j] = -back[i, j] / scale[i]
