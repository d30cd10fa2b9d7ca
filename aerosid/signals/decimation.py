"""Decimation: windowed-sinc low-pass and every n-th sample of a convolution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit

FloatArray = NDArray[np.float64]


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
    for n in range(count):
        for k in range(weights.size):
            weight = weights[weights.size - 1 - k]
            for c in range(values.shape[1]):
                result[n, c] += weight * values[n * step + k, c]
    return result
