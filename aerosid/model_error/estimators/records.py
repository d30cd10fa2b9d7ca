"""Input checks: records as the compiled drivers take them, contiguous and writable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import UsageError
from aerosid.model_error.estimators.weights import Weights

Array = NDArray[np.float64]


class DrivenRecord(NamedTuple):
    """A record's arrays as a compiled driver takes them; see `Records`."""

    time: Array  # (N,) s
    y: Array  # (N, p) measurements, NaN where missing
    u: Array  # (N, m) inputs
    Q1: Array  # (1 or N, p, p) weight of the residual
    W: Array  # (1 or N, n, n) (1/2) Q2^-1


@dataclass(frozen=True)
class Records:
    """A record ready for a driver.

    Attributes
    ----------
    time : (N,)
        s.
    y : (N, p)
        Measurements, NaN where missing.
    u : (N, m)
        Inputs.
    x0 : (n,)
        Initial state.
    Q1 : (1 or N, p, p)
        Weight of the residual.
    W : (1 or N, n, n)
        (1/2) Q2^-1.
    weights : Weights
        As given.
    """

    time: Array
    y: Array
    u: Array
    x0: Array
    Q1: Array
    W: Array
    weights: Weights

    @property
    def driven(self) -> DrivenRecord:
        """The arrays alone."""
        return DrivenRecord(self.time, self.y, self.u, self.Q1, self.W)

    @property
    def N(self) -> int:
        """Number of samples."""
        return int(self.time.size)

    @property
    def n(self) -> int:
        """Number of states."""
        return int(self.x0.size)

    @property
    def p(self) -> int:
        """Number of outputs."""
        return int(self.y.shape[1])


def _copy(value: ArrayLike) -> Array:
    return np.array(value, dtype=np.float64, order="C")


def as_records(time: ArrayLike, y: ArrayLike, x0: ArrayLike, u: ArrayLike | None, weights: Weights) -> Records:
    """The record, checked.

    Parameters
    ----------
    time : (N,)
        s, strictly increasing.
    y : (N, p)
        Measurements, NaN where missing.
    x0 : (n,)
        Initial state.
    u : (N, m) or None
        Inputs.
    weights : Weights
        For n states and p outputs.

    Raises
    ------
    UsageError
        On shapes that do not fit, time that does not increase, values that are not finite.
    """
    t, measured, start = _copy(time), _copy(y), _copy(x0)
    if t.ndim != 1 or t.size < 1:
        raise UsageError(f"time has shape {t.shape} where (N,) with N >= 1 was expected.")
    N = t.size
    late = np.flatnonzero(~(np.diff(t) > 0.0))
    if late.size:
        k = int(late[0]) + 1
        raise UsageError(f"time does not increase at sample {k} ({t[k - 1]:g} to {t[k]:g} s); sort the record.")
    if measured.ndim != 2 or measured.shape[0] != N:
        raise UsageError(f"y has shape {measured.shape} where ({N}, p) was expected, one row a sample.")
    if np.any(np.isinf(measured)):
        k = int(np.flatnonzero(np.isinf(measured).any(axis=1))[0])
        raise UsageError(f"y is infinite at sample {k}; give NaN where a sample is missing.")
    inputs = np.zeros((N, 0)) if u is None else _copy(u)
    if inputs.ndim != 2 or inputs.shape[0] != N:
        raise UsageError(f"u has shape {inputs.shape} where ({N}, m) was expected, one row a sample.")
    if not np.all(np.isfinite(inputs)):
        k = int(np.flatnonzero(~np.isfinite(inputs).all(axis=1))[0])
        raise UsageError(f"u is not finite at sample {k}; the model cannot run without its inputs.")
    if start.ndim != 1 or not np.all(np.isfinite(start)):
        raise UsageError("x0 must be a vector of finite numbers.")
    n, p = start.size, measured.shape[1]
    for name, value, size in (("Q1", weights.Q1, p), ("Q2_inverse", weights.Q2_inverse, n), ("S0", weights.S0, n)):
        if value.shape[-1] != size or (value.ndim == 3 and value.shape[0] != N):
            raise UsageError(
                f"{name} has shape {value.shape} where ({size}, {size}) or ({N}, {size}, {size}) was expected."
            )
    Q1 = _copy(weights.Q1).reshape(-1, p, p)
    W = 0.5 * weights.Q2_inverse.reshape(-1, n, n)
    return Records(t, measured, inputs, start, Q1, W, weights)
