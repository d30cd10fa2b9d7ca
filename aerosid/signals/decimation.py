"""Decimation: windowed-sinc low-pass and every n-th sample of a convolution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline

FloatArray = NDArray[np.float64]

FEW = 12
"""Numerical: columns up to which each is summed by itself, along its rows; vectors of columns are too short to be
quicker."""


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
        phases = np.empty((step, values.shape[0] // step + 1))
        for c in range(values.shape[1]):
            total = np.zeros(count)
            _decimated_alone(weights, values[:, c], phases, total)
            result[:, c] = total
        return result
    for n in range(count):
        for k in range(weights.size):
            weight = weights[weights.size - 1 - k]
            for c in range(values.shape[1]):
                result[n, c] += weight * values[n * step + k, c]
    return result


@njit_inline
def _decimated_alone(weights: FloatArray, values: FloatArray, phases: FloatArray, total: FloatArray) -> None:
    """As `decimated`, of one column: one weight after the other is added to all rows, which stand side by side.

    `phases`: room for the samples, those that lie whole steps apart in one row.
    """
    step = phases.shape[0]
    for phase in range(step):
        for n in range((values.shape[0] - 1 - phase) // step + 1):
            phases[phase, n] = values[n * step + phase]
    for k in range(weights.shape[0]):
        weight, later = weights[weights.shape[0] - 1 - k], phases[k % step, k // step :]
        for n in range(total.shape[0]):
            total[n] += weight * later[n]
