"""The recursion's algebra, once: the exact step of the invariant-embedding estimator with frozen linearisation.

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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline, njit_inline_room

Array = NDArray[np.float64]

# Balanced norm of the short step: at 1/11 the first neglected term of the ninth-degree series, relative to the linear
# one, is (1/11)^9 / 10! = 1.2e-16.
_SHORT_STEP_NORM = 1.0 / 11.0
# A step of norm 2^60 short steps is beyond any meaning of the numbers; more doublings only spread rounding.
_MAX_DOUBLINGS = 60
_EPSILON = float(np.finfo(np.float64).eps)
_TINY = float(np.finfo(np.float64).tiny)


class StepWork(NamedTuple):
    """Work arrays of one step for n states, k constant and k_ramp ramp forcing columns (K = k + k_ramp).

    Make one by `step_work`; one per thread. Two arrays and not one for each matrix, since compiled code passes an
    array as seven numbers.
    """

    blocks: Array  # (_BLOCKS, 2n, 3n + K): one matrix each, at the top left, see the numbers below
    forcing: Array  # (2n, k): forcing columns of (x, lambda), given in the caller's units


# Blocks that hold the step after `step_map`, in balanced units (state i in units of blocks[_SCALE, 0, i]). What meets
# in one product stands side by side, so that one loop serves all of it.
_SCALE = 0
_AHEAD = 1  # (n, 2n + K): Q | c_x | Phi - I; Phi - I, since the Phi of a short step is I to many digits
_BACK = 2  # (n, n + K): -c_lambda | G
# Work blocks.
_AUGMENTED = 3  # (n, 3n + K): a system of equations and its right-hand sides
_LEFT = 4  # (n, 2n + K)
_MIDDLE = 5  # (n, n + K)
_SERIES = 6  # five of (2n, 2n + K)
_BLOCKS = 11


@njit_inline_room
def step_work(n: int, constant: int = 2, ramp: int = 2) -> StepWork:
    """Work arrays for steps of `n` states.

    Parameters
    ----------
    n : int
        Number of states.
    constant, ramp : int
        Forcing columns that act constantly, and those that also act as a ramp from 0 to 1 over the step (always the
        last `ramp` of the constant ones). `estimator_step` needs (2, 1), and with n = 4 is faster with (2, 2), which
        fills whole vector registers; `gain_step` needs (n, n).

    Returns
    -------
    StepWork
    """
    return StepWork(np.zeros((_BLOCKS, 2 * n, 3 * n + constant + ramp)), np.zeros((2 * n, constant)))


@njit_inline
def _multiply(A: Array, B: Array, out: Array, rows: int, inner: int, columns: int) -> None:
    """Form out[:rows, :columns] = A[:rows, :inner] B[:inner, :columns]."""
    for i in range(rows):
        for j in range(columns):
            out[i, j] = 0.0
        for m in range(inner):
            a = A[i, m]
            for j in range(columns):
                out[i, j] += a * B[m, j]


@njit_inline
def solve_in_place(aug: Array, n: int, width: int) -> bool:
    """Right-hand sides aug[:, n:width] replaced by their solutions; False where the system aug[:, :n] is singular.

    Gaussian elimination with row pivoting. The systems here, I + Q G with Q and G positive semi-definite, have real
    eigenvalues of 1 or more and are well conditioned in balanced units.
    """
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(aug[i, k]) > abs(aug[pivot, k]):
                pivot = i
        if not abs(aug[pivot, k]) > 0.0:
            return False
        if pivot != k:
            for j in range(k, width):
                swap = aug[k, j]
                aug[k, j] = aug[pivot, j]
                aug[pivot, j] = swap
        inverse = 1.0 / aug[k, k]
        for i in range(k + 1, n):
            factor = aug[i, k] * inverse
            for j in range(k + 1, width):
                aug[i, j] -= factor * aug[k, j]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / aug[k, k]
        for j in range(n, width):
            aug[k, j] *= inverse
        for i in range(k):
            factor = aug[i, k]
            for j in range(n, width):
                aug[i, j] -= factor * aug[k, j]
    return True


@njit_inline
def cholesky(S: Array, L: Array, n: int) -> bool:
    """Lower factor of the symmetric S into L; False where a pivot had to be raised to rounding level.

    A semi-definite S (a state known exactly) gives a zero column, which is exact. A pivot below n eps S_ii is lost in
    rounding and is set to that level, which keeps the matrix positive definite.
    """
    sound = True
    for j in range(n):
        for i in range(j):
            L[i, j] = 0.0
        pivot = S[j, j]
        for k in range(j):
            pivot -= L[j, k] * L[j, k]
        floor = n * _EPSILON * S[j, j]
        if pivot < floor or not pivot > 0.0:
            sound = sound and S[j, j] == 0.0
            pivot = floor
        if pivot <= 0.0:
            for i in range(j, n):
                L[i, j] = 0.0
            continue
        root = math.sqrt(pivot)
        L[j, j] = root
        for i in range(j + 1, n):
            value = S[i, j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            L[i, j] = value / root
    return sound


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
    """The step whose Hamiltonian A and forcing b, times its length, stand as A | b | b of the ramps in block _SERIES.

    M - I = phi_1(A) A and the responses phi_1(A) b, phi_2(A) b by the Taylor series to the ninth power of A, summed in
    powers of A^3 (Paterson and Stockmeyer) for all columns together; phi_m(A) = sum A^j/(j + m)!.
    """
    blocks = work.blocks
    W0, W1, W2, T, M = (
        blocks[_SERIES], blocks[_SERIES + 1], blocks[_SERIES + 2], blocks[_SERIES + 3], blocks[_SERIES + 4],
    )  # fmt: skip
    n2, k = work.forcing.shape
    n = n2 // 2
    K = blocks.shape[2] - 3 * n
    width = n2 + K
    _multiply(W0, W0, W1, n2, n2, width)
    _multiply(W0, W1, W2, n2, n2, width)  # begins with A^3
    for i in range(n2):
        for j in range(width):
            T[i, j] = 0.0
    _series_term(6, W0, W1, W2, T, n2, k, K)
    _multiply(W2, T, M, n2, n2, width)
    _series_term(3, W0, W1, W2, M, n2, k, K)
    _multiply(W2, M, T, n2, n2, width)
    _series_term(0, W0, W1, W2, T, n2, k, K)

    # From one-ended to two-ended: Phi' = M22^-1, G = M22^-1 M21, -c_lambda = M22^-1 z_lambda.
    aug, ahead, back = blocks[_AUGMENTED], blocks[_AHEAD], blocks[_BACK]
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
    _symmetrise(ahead, 0, n)
    _symmetrise(back, K, n)
    return True


@njit_inline
def _symmetrise(A: Array, first: int, n: int) -> None:
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
        blocks[_AHEAD], blocks[_BACK], blocks[_LEFT], blocks[_AUGMENTED], blocks[_MIDDLE],
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
    _multiply(ahead, left, aug, n, n, n2 + K)
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
    _symmetrise(ahead, 0, n)
    _symmetrise(back, K, n)
    return True


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
    scale, A, forcing = work.blocks[_SCALE, 0], work.blocks[_SERIES], work.forcing
    k = forcing.shape[1]
    K = work.blocks.shape[2] - 3 * n
    norm = _balance(F, W, C, scale) * dt
    if not norm < math.inf:
        return False
    doublings = 0
    while norm > _SHORT_STEP_NORM and doublings < _MAX_DOUBLINGS:
        norm *= 0.5
        dt *= 0.5
        doublings += 1
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
def factor_information(S: Array, G: Array, L: Array, R: Array, X: Array, n: int) -> None:
    """L L' = S and R R' = I + L' G L, both lower, so that S (I + G S)^-1 = L R^-T R^-1 L'; R may be S, X is work."""
    cholesky(S, L, n)
    for i in range(n):
        for j in range(n):
            value = 0.0
            for m in range(j, n):
                value += G[i, m] * L[m, j]
            X[i, j] = value
    for i in range(n):
        for j in range(i + 1):
            value = 0.0
            for m in range(i, n):
                value += L[m, i] * X[m, j]
            R[i, j] = value
            R[j, i] = value
        R[i, i] += 1.0
    cholesky(R, R, n)


@njit_inline
def riccati_step(S: Array, work: StepWork, S_next: Array) -> bool:
    """S at the end of the step in `work` into `S_next`; leaves the mean's response in a block, balanced.

    S+ = Q + Phi S (I + G S)^-1 Phi' is formed as Q + X X' with S = L L', I + L' G L = R R', X = Phi L R^-T:
    symmetric by construction, and the only inverse is of a matrix with eigenvalues of 1 or more.
    e = c_x + Phi S (I + G S)^-1 c_lambda uses the same factors.
    """
    blocks = work.blocks
    scale, ahead, back = blocks[_SCALE, 0], blocks[_AHEAD], blocks[_BACK]
    X, middle, L, R, G = blocks[_LEFT], blocks[_MIDDLE], blocks[_SERIES], blocks[_SERIES + 1], blocks[_SERIES + 2]
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
        e[i] = blocks[_SCALE, 0, i] * (blocks[_MIDDLE, i, n] + blocks[_MIDDLE, i, last])


@njit_inline
def start_from(delta: Array, work: StepWork) -> None:
    """The map in `work` for a deviation delta, (n,), at the beginning of the step: Phi delta and -G delta are added."""
    blocks, scale = work.blocks, work.blocks[_SCALE, 0]
    n = delta.shape[0]
    K = blocks.shape[2] - 3 * n
    for i in range(n):
        blocks[_AHEAD, i, n] += delta[i] / scale[i]
        for j in range(n):
            blocks[_AHEAD, i, n] += blocks[_AHEAD, i, n + K + j] * delta[j] / scale[j]
            blocks[_BACK, i, 0] += blocks[_BACK, i, K + j] * delta[j] / scale[j]


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
    scale, ahead, back, aug, left = blocks[_SCALE, 0], blocks[_AHEAD], blocks[_BACK], blocks[_AUGMENTED], blocks[_LEFT]
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
    _symmetrise(left, 0, n)
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
    scale, e = work.blocks[_SCALE, 0], work.blocks[_MIDDLE]
    for i in range(n):
        for j in range(n):
            ramp = scale[i] * e[i, 2 * n + j]
            M0[i, j] = scale[i] * e[i, n + j] - ramp
            M1[i, j] = ramp
    return finite


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
        blocks[_SCALE, 0], blocks[_SERIES], blocks[_SERIES + 1], blocks[_SERIES + 2], blocks[_SERIES + 3],
        blocks[_SERIES + 4],
    )  # fmt: skip
    for i in range(n):
        for j in range(n):
            Phi[i, j] = 0.0
    norm = _balance(F, Phi, Phi, scale) * dt
    if not norm < math.inf:
        return False
    doublings = 0
    while norm > _SHORT_STEP_NORM and doublings < _MAX_DOUBLINGS:
        norm *= 0.5
        dt *= 0.5
        doublings += 1
    for i in range(n):
        for j in range(n):
            A[i, j] = F[i, j] * dt * scale[j] / scale[i]
    _multiply(A, A, A2, n, n, n)
    _multiply(A, A2, A3, n, n, n)
    for i in range(n):
        for j in range(n):
            T[i, j] = A[i, j] / 362880.0 + A2[i, j] / 3628800.0
        T[i, i] += 1.0 / 40320.0
    _multiply(A3, T, M, n, n, n)
    for i in range(n):
        for j in range(n):
            M[i, j] += A[i, j] / 720.0 + A2[i, j] / 5040.0
        M[i, i] += 1.0 / 120.0
    _multiply(A3, M, T, n, n, n)
    # M: E | dt phi_1 | dt phi_2
    for i in range(n):
        for j in range(n):
            T[i, j] += A[i, j] / 6.0 + A2[i, j] / 24.0
        T[i, i] += 0.5
        for j in range(n):
            M[i, 2 * n + j] = dt * T[i, j]
    _multiply(A, T, A2, n, n, n)
    for i in range(n):
        A2[i, i] += 1.0
        for j in range(n):
            M[i, n + j] = dt * A2[i, j]
    _multiply(A, A2, M, n, n, n)
    for _ in range(doublings):
        _multiply(M, M, T, n, n, 3 * n)
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
    ahead, back, scale = work.blocks[_AHEAD], work.blocks[_BACK], work.blocks[_SCALE, 0]
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
    X = work.blocks[_LEFT]
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
    X, L, R = work.blocks[_LEFT], work.blocks[_SERIES], work.blocks[_SERIES + 1]
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
