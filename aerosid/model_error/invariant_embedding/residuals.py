"""Weighted residuals at a sample and over a step; missing samples drop out."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.model_error.invariant_embedding.estimator_step import information

Array = NDArray[np.float64]


@njit
def multiply(A: Array, v: Array, out: Array) -> None:
    """A v into `out`."""
    for i in range(A.shape[0]):
        value = 0.0
        for j in range(A.shape[1]):
            value += A[i, j] * v[j]
        out[i] = value


@njit
def weigh_sample(H: Array, Q1: Array, residual: Array, weight: Array, r: Array, HQ: Array, C: Array, g: Array) -> None:
    """2 H' Q1, C = 2 H' Q1 H and g = 2 H' Q1 r of one sample; outputs whose residual is NaN take no part.

    Parameters
    ----------
    H : (p, n)
    Q1 : (p, p)
    residual : (p,)
        y - h; NaN where missing.
    weight, r : (p,)
        Out: 1 where measured, else 0; the residual, 0 where missing.
    HQ, C, g : (n, p), (n, n), (n,)
        Out. The model error of (23) is S g.
    """
    for i in range(H.shape[0]):
        missing = math.isnan(residual[i])
        weight[i] = 0.0 if missing else 1.0
        r[i] = 0.0 if missing else residual[i]
    information(H, Q1, weight, HQ, C)
    multiply(HQ, r, g)


@njit
def weigh_step(
    H: Array,
    Q1: Array,
    before: Array,
    after: Array,
    weight: Array,
    r: Array,
    HQ: Array,
    C: Array,
    g0: Array,
    g1: Array,
) -> None:
    """2 H' Q1, C = 2 H' Q1 H and g = 2 H' Q1 r at both ends of a step.

    An output that was measured at one end only keeps that residual over the step, at half the weight: in the sum of J
    each sample counts half in the step before it and half in the step after it, so that a channel recorded at half
    the rate still counts in full.

    Parameters
    ----------
    H : (p, n)
        Frozen over the step.
    Q1 : (p, p)
    before, after : (p,)
        y - h at the beginning, and at the end on the open-loop path; NaN where missing.
    weight, r : (p,)
        Out: the row's weight, 1, 1/2 or 0; work.
    HQ, C : (n, p), (n, n)
        Out.
    g0, g1 : (n,)
        Out, for `estimator_step`.
    """
    p = H.shape[0]
    for i in range(p):
        first = not math.isnan(before[i])
        last = not math.isnan(after[i])
        weight[i] = 1.0 if first and last else (0.5 if first or last else 0.0)
        r[i] = before[i] if first else (after[i] if last else 0.0)
    information(H, Q1, weight, HQ, C)
    multiply(HQ, r, g0)
    for i in range(p):
        if not math.isnan(after[i]):
            r[i] = after[i]
    multiply(HQ, r, g1)
