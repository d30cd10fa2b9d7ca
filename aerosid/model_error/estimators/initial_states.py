"""Poorly known initial states: forward and backward passes, or states declared unknown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from numba.extending import is_jitted
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import UsageError
from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.functions import BY_DIFFERENCES, Partials
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.weights import Weights

Array = NDArray[np.float64]


def with_unknown_initial(weights: Weights, states: Sequence[int], spread: ArrayLike) -> Weights:
    """These weights for initial states of which nothing is known.

    Parameters
    ----------
    weights : Weights
    states : sequence of int
        Which states are unknown at the beginning.
    spread : float or (len(states),)
        A standard deviation far beyond what the states can be, in state units; the first samples then decide. A
        thousand to ten thousand times the states' size: less leaves a trace of the guess, more costs digits (a spread
        of 10^k times takes 2 k of the sixteen where the first samples do not show all states).

    Raises
    ------
    UsageError
        Where a spread is not positive.
    """
    index = np.asarray(states, dtype=np.int64)
    deviation = np.broadcast_to(np.asarray(spread, dtype=np.float64), index.shape)
    if not np.all(deviation > 0.0):
        raise UsageError("The spread of an unknown initial state must be a positive number.")
    S0 = np.array(weights.S0)
    S0[index, :] = 0.0
    S0[:, index] = 0.0
    S0[index, index] = 0.5 * deviation**2
    return Weights(weights.Q1, weights.Q2_inverse, S0)


def estimate_forward_backward(
    f: Callable[..., Any],
    h: Callable[..., Any],
    time: ArrayLike,
    y: ArrayLike,
    x0: ArrayLike,
    weights: Weights,
    *,
    iterations: int = 1,
    u: ArrayLike | None = None,
    partials: Partials = BY_DIFFERENCES,
    substeps: int = 1,
) -> ModelErrorHistory:
    """The continuous estimate from an initial state that a backward run has improved.

    Each iteration runs the recursion forward, then over the reversed record (x' = -f) from the final states and their
    S, and forward again from where that ends. A discrete map has no inverse: restart it from the fixed-interval
    solution's first state.

    Parameters
    ----------
    f, h, time, y, x0, weights, u, partials, substeps
        As for `estimate_continuous`.
    iterations : int
        Backward runs; the estimate returned is of the last forward run.

    Returns
    -------
    ModelErrorHistory
        `weights.S0` there is what the backward run left.

    References
    ----------
    Parameswaran & Raol 1994, section 3.2: 'first solving them in forward direction and then, with the improved final
    states, in the backward direction'.
    """
    t, measured = np.array(time, dtype=np.float64), np.asarray(y, dtype=np.float64)
    inputs = None if u is None else np.asarray(u, dtype=np.float64)
    end = float(t[-1])

    def forward(start: ArrayLike, used: Weights) -> ModelErrorHistory:
        return estimate_continuous(f, h, t, measured, start, used, u=inputs, partials=partials, substeps=substeps)

    def backward(start: ArrayLike, used: Weights) -> ModelErrorHistory:
        return estimate_continuous(
            _reversed(f, end, -1.0),
            _reversed(h, end, 1.0),
            end - t[::-1],
            measured[::-1],
            start,
            used,
            u=None if inputs is None else inputs[::-1],
            partials=Partials(
                None if partials.f_x is None else _reversed(partials.f_x, end, -1.0),
                None if partials.h_x is None else _reversed(partials.h_x, end, 1.0),
                partials.state_scale,
            ),
            substeps=substeps,
        )

    history = forward(x0, weights)
    for _ in range(iterations):
        back = backward(history.states[-1], _reversed_weights(weights, history.S[-1]))
        history = forward(back.states[-1], Weights(weights.Q1, weights.Q2_inverse, back.S[-1]))
    return history


def _reversed_weights(weights: Weights, S: Array) -> Weights:
    # Weight k holds from sample k to k + 1: reversed, the last step's weight comes first.
    Q1 = weights.Q1 if weights.Q1.ndim == 2 else np.concatenate([weights.Q1[-2::-1], weights.Q1[:1]])
    Q2 = weights.Q2_inverse
    Q2 = Q2 if Q2.ndim == 2 else np.concatenate([Q2[-2::-1], Q2[:1]])
    return Weights(Q1, Q2, S)


def _reversed(function: Callable[..., Any], end: float, sign: float) -> Callable[..., Any]:
    def call(x: Array, u: Array, t: float) -> Array:
        return sign * function(x, u, end - t)  # type: ignore[no-any-return]

    def call_python(x: Array, u: Array, t: float) -> Array:
        return sign * np.asarray(function(x, u, end - t), dtype=np.float64)

    return numba.njit(call) if is_jitted(function) else call_python
