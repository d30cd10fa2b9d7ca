"""Work arrays of one step of the recursion, and the small dense algebra that it is made of."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline, njit_inline_room, njit_inline_vector
from aerosid.signals.array_elements import exchange_rows, pivot_row

Array = NDArray[np.float64]


class StepWork(NamedTuple):
    """Work arrays of one step for n states, k constant and k_ramp ramp forcing columns (K = k + k_ramp).

    Make one by `step_work`; one per thread. Two arrays and not one for each matrix, since compiled code passes an
    array as seven numbers.
    """

    blocks: Array  # (_BLOCKS, 2n, 3n + K): one matrix each, at the top left, see the numbers below
    forcing: Array  # (2n, k): forcing columns of (x, lambda), given in the caller's units


EPSILON = float(np.finfo(np.float64).eps)

SCALE, AHEAD, BACK = 0, 1, 2
"""Layout: blocks that hold the step after `step_map`, in balanced units (state i in units of blocks[SCALE, 0, i]).

AHEAD (n, 2n + K): Q | c_x | Phi - I, since the Phi of a short step is I to many digits; BACK (n, n + K):
-c_lambda | G. Factors of one product are stored side by side, so that one loop computes all of it.
"""

AUGMENTED, LEFT, MIDDLE, SERIES = 3, 4, 5, 6
"""Layout: work blocks. AUGMENTED (n, 3n + K), a system of equations and its right-hand sides; LEFT (n, 2n + K); MIDDLE
(n, n + K); SERIES, five of (2n, 2n + K).
"""

_BLOCKS = 11
"""Layout: how many there are."""


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


@njit_inline_vector
def multiply(A: Array, B: Array, out: Array, rows: int, inner: int, columns: int) -> None:
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
    eigenvalues of 1 or more and are well conditioned in balanced units. Unlike `solve_by_elimination`, which divides by
    the pivots, it multiplies by their inverses: few divisions, for systems solved at every step.
    """
    for k in range(n):
        pivot = pivot_row(aug, k, n)
        if not abs(aug[pivot, k]) > 0.0:
            return False
        if pivot != k:
            exchange_rows(aug, k, pivot, k, width)
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
        floor = n * EPSILON * S[j, j]
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
