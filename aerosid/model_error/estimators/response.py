"""Response of the estimator to a candidate: the same operator on candidates as on measurements.

The estimator answers a model error with a delay and a loss that its weights decide. A coefficient found by regressing
d^ on the candidate itself carries both. Regressed on the candidate's response, the d^ that this very estimator (same
steps, same gains, same missing samples) would have shown, had the model error been the candidate, it does not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.compiled import njit
from aerosid.errors import EstimationError, UsageError
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.invariant_embedding.estimator_step import gain_step, information
from aerosid.model_error.invariant_embedding.step_map import transition_step
from aerosid.model_error.invariant_embedding.step_work import StepWork, step_work

Array = NDArray[np.float64]


@njit
def _product(A: Array, B: Array, out: Array) -> None:
    """A B into `out`."""
    for i in range(A.shape[0]):
        for j in range(B.shape[1]):
            out[i, j] = 0.0
        for m in range(A.shape[1]):
            a = A[i, m]
            for j in range(B.shape[1]):
                out[i, j] += a * B[m, j]


class ResponseScratch(NamedTuple):
    """Work arrays of one recursion on candidates; make them by `response_scratch`."""

    C: Array  # (n, n), as the six below
    S_next: Array
    M0: Array
    M1: Array
    Phi: Array
    Gamma0: Array
    Gamma1: Array
    HQ: Array
    weight: Array
    path: Array
    columns: Array
    columns2: Array
    r0: Array
    r1: Array
    step: StepWork


def response_scratch(n: int, p: int, m: int) -> ResponseScratch:
    """Work arrays for n states, p outputs and m candidates."""
    return ResponseScratch(
        np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n)),
        np.empty((n, n)), np.empty((n, p)), np.empty(p), np.empty((n, m)), np.empty((n, m)), np.empty((n, m)),
        np.empty((p, m)), np.empty((p, m)), step_work(n, n, n),
    )  # fmt: skip


@njit
def response_at(
    S: Array, H: Array, Q1: Array, present: Array, epsilon: Array, response: Array, scratch: ResponseScratch
) -> None:
    """d^ of a sample for true states that lie epsilon, (n, m), off the estimates: 2 S H' Q1 H epsilon."""
    information(H, Q1, present, scratch.HQ, scratch.C)
    _product(scratch.C, epsilon, scratch.columns)
    _product(S, scratch.columns, response)


class ResponseStep(NamedTuple):
    """One step as the estimator took it, and the candidates that act over it."""

    dt: float  # s
    S: Array  # (n, n) at its beginning
    F: Array  # (n, n) f_x of the step
    W: Array  # (n, n) (1/2) Q2^-1
    Q1: Array  # (p, p)
    H: Array  # (p, n) h_x at its beginning
    H_step: Array  # (p, n) h_x of the step
    H_next: Array  # (p, n) h_x at its end
    present: Array  # (p,) 1 where measured at its beginning, else 0
    present_next: Array  # (p,) the same at its end
    candidates: Array  # (n, m) rates at its beginning, state units / s; linear between
    candidates_next: Array  # (n, m) rates at its end


@njit
def response_step(step: ResponseStep, epsilon: Array, scratch: ResponseScratch) -> bool:
    """True minus estimated states (n, m) of each candidate carried over one step, in place."""
    dt, S, F, W, Q1, H, H_step, H_next, present, present_next, candidates, candidates_next = step
    C, S_next, M0, M1 = scratch.C, scratch.S_next, scratch.M0, scratch.M1
    Phi, Gamma0, Gamma1 = scratch.Phi, scratch.Gamma0, scratch.Gamma1
    HQ, weight, path, columns, columns2 = scratch.HQ, scratch.weight, scratch.path, scratch.columns, scratch.columns2
    r0, r1 = scratch.r0, scratch.r1
    n, m = epsilon.shape
    if not transition_step(F, dt, Phi, Gamma0, Gamma1, scratch.step):
        return False
    _product(Phi, epsilon, path)
    _product(Gamma0, candidates, columns)
    _product(Gamma1, candidates_next, columns2)
    for i in range(n):
        for j in range(m):
            path[i, j] += columns[i, j] + columns2[i, j]
    _product(H, epsilon, r0)
    _product(H_next, path, r1)
    for i in range(H.shape[0]):
        first = present[i] > 0.0
        last = present_next[i] > 0.0
        weight[i] = 1.0 if first and last else (0.5 if first or last else 0.0)
        for j in range(m):
            if not first:
                r0[i, j] = r1[i, j]
            if not last:
                r1[i, j] = r0[i, j]
    information(H_step, Q1, weight, HQ, C)
    if not gain_step(S, F, W, C, dt, S_next, M0, M1, scratch.step):
        return False
    _product(HQ, r0, columns)
    _product(M0, columns, epsilon)
    _product(HQ, r1, columns)
    _product(M1, columns, columns2)
    for i in range(n):
        for j in range(m):
            epsilon[i, j] = path[i, j] - epsilon[i, j] - columns2[i, j]
    return True


class _RespondedRecord(NamedTuple):
    """A continuous history and the candidates, in the letters of `ModelErrorHistory`."""

    time: Array
    S: Array
    F: Array
    H: Array
    H_step: Array
    present: Array
    Q1: Array
    W: Array
    candidates: Array


@njit
def _respond_continuous(
    record: _RespondedRecord,
    epsilon: Array,
    response: Array,
    scratch: ResponseScratch,
) -> int:
    time, S, F, H, H_step, present, Q1, W, candidates = record
    N, p, n = H.shape
    # Copies of one sample each: the histories are read-only, which is another type to compiled code.
    F_k, W_k, S_k, Q1_k = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((p, p))
    H_k, H_between, H_next, here, there = (
        np.empty((p, n)), np.empty((p, n)), np.empty((p, n)), np.empty(p), np.empty(p),
    )  # fmt: skip
    for k in range(N):
        Q1_k[:] = Q1[min(k, Q1.shape[0] - 1)]
        H_k[:], S_k[:], here[:] = H[k], S[k], present[k]
        response_at(S_k, H_k, Q1_k, here, epsilon, response[k], scratch)
        if k == N - 1:
            break
        F_k[:], W_k[:] = F[k], W[min(k, W.shape[0] - 1)]
        H_between[:], H_next[:], there[:] = H_step[k], H[k + 1], present[k + 1]
        step = ResponseStep(
            time[k + 1] - time[k], S_k, F_k, W_k, Q1_k, H_k, H_between, H_next, here, there,
            candidates[k], candidates[k + 1],
        )  # fmt: skip
        if not response_step(step, epsilon, scratch):
            return k + 1
    return -1


@njit
def _respond_discrete(
    S: Array,
    F: Array,
    H: Array,
    present: Array,
    Q1: Array,
    candidates: Array,
    epsilon: Array,
    response: Array,
) -> None:
    N, p, n = H.shape
    m = epsilon.shape[1]
    HQ, C, H_k, Q1_k, weight = np.empty((n, p)), np.empty((n, n)), np.empty((p, n)), np.empty((p, p)), np.empty(p)
    path, columns, correction = epsilon.copy(), np.empty((n, m)), np.empty((n, m))
    for k in range(N):
        if k > 0:
            _product(F[k - 1], epsilon, path)
            for i in range(n):
                for j in range(m):
                    path[i, j] += candidates[k - 1, i, j]
        Q1_k[:] = Q1[min(k, Q1.shape[0] - 1)]
        H_k[:] = H[k]
        for i in range(p):
            weight[i] = present[k, i]
        information(H_k, Q1_k, weight, HQ, C)
        _product(C, path, columns)
        _product(S[k], columns, correction)
        for i in range(n):
            for j in range(m):
                epsilon[i, j] = path[i, j] - correction[i, j]
                if k > 0:
                    response[k - 1, i, j] = correction[i, j]


def respond(history: ModelErrorHistory, candidates: ArrayLike, initial: ArrayLike | None = None) -> Array:
    """The d^ that each candidate, as the true model error, would have produced through the same estimator.

    Linear in the candidates, at the frozen linearisation and gains of `history`; the time is linear in N.

    Parameters
    ----------
    history : ModelErrorHistory
        From the continuous or the discrete estimator.
    candidates : (M, n, m)
        m candidate model errors, of the size of `history.model_error`: rates at the samples, state units / s, linear
        between them (continuous), or the error of each step, state units (discrete).
    initial : (n, m), optional
        Error of the initial state, true minus given, that goes with each candidate; 0 where absent. Columns of the
        identity with candidates 0 are the regressors of an unknown initial state.

    Returns
    -------
    (M, n, m) array
        As `history.model_error`, for each candidate.

    Raises
    ------
    UsageError
        On shapes that do not fit.
    """
    given = np.array(candidates, dtype=np.float64, order="C")
    M, n = history.model_error.shape
    if given.ndim != 3 or given.shape[:2] != (M, n):
        raise UsageError(f"candidates have shape {given.shape} where ({M}, {n}, m) was expected.")
    m = given.shape[2]
    epsilon = np.zeros((n, m)) if initial is None else np.array(initial, dtype=np.float64, order="C")
    if epsilon.shape != (n, m):
        raise UsageError(f"initial has shape {epsilon.shape} where ({n}, {m}) was expected.")
    p = history.present.shape[1]
    Q1 = history.weights.Q1.reshape(-1, p, p)
    response = np.zeros((M, n, m))
    if history.discrete:
        _respond_discrete(history.S, history.F, history.H, history.present, Q1, given, epsilon, response)
        return response
    W = 0.5 * history.weights.Q2_inverse.reshape(-1, n, n)
    record = _RespondedRecord(
        history.time, history.S, history.F, history.H, history.H_step, history.present, Q1, W, given
    )
    failed = _respond_continuous(record, epsilon, response, response_scratch(n, p, m))
    if failed >= 0:
        raise EstimationError(f"The response to the candidates stops being finite at sample {failed}.")
    return response
