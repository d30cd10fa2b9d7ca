"""Decimation: windowed-sinc low-pass and every n-th sample of a convolution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline

FloatArray = NDArray[np.float64]

FEW = 4
"""Numerical: columns up to which each is summed by itself; vectors of columns are too short to be quicker."""


def windowed_sinc(length: int, cut_off: float) -> FloatArray:
    """Weights (length,) of a symmetric low-pass of unit gain at rest, with a Hamming window.

    Parameters
    ----------
    length : int
        Odd.
    cut_off : float
        Half-amplitude frequency over half the sampling frequency, 1.

    References
    ----------
    Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed., section 7.5.
    """
    away = np.arange(length) - 0.5 * (length - 1)
    weights = cut_off * np.sinc(cut_off * away) * np.hamming(length)
    return np.asarray(weights / weights.sum())


@njit
def decimated(weights: FloatArray, values: FloatArray, step: int) -> FloatArray:
    """Every `step`-th sample of the convolution of `values` (N, C) with `weights` (L,), where all weights find one.

    Row n is the sum of weights[L - 1 - k] values[n step + k]; (1 + (N - L) // step, C).
    """
    count = 1 + (values.shape[0] - weights.size) // step
    result = np.zeros((count, values.shape[1]))
    if values.shape[1] <= FEW:
        _decimated_alone(weights, values, step, result)
        return result
    for n in range(count):
        for k in range(weights.size):
            weight = weights[weights.size - 1 - k]
            for c in range(values.shape[1]):
                result[n, c] += weight * values[n * step + k, c]
    return result


@njit_inline
def _decimated_alone(weights: FloatArray, values: FloatArray, step: int, result: FloatArray) -> None:
    """As `decimated`, a column at a time, four rows side by side: one sum by itself waits for each of its additions."""
    count = result.shape[0]
    for c in range(values.shape[1]):
        for n in range(0, count, 4):
            # The last rows are made again where fewer than four are left.
            first = min(n, max(count - 4, 0))
            second, third, last = min(first + 1, count - 1), min(first + 2, count - 1), min(first + 3, count - 1)
            one = two = three = four = 0.0
            for k in range(weights.size):
                weight = weights[weights.size - 1 - k]
                one += weight * values[first * step + k, c]
                two += weight * values[second * step + k, c]
                three += weight * values[third * step + k, c]
                four += weight * values[last * step + k, c]
            result[first, c], result[second, c], result[third, c], result[last, c] = one, two, three, four
