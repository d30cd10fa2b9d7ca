"""Mean, largest and smallest value over a window that moves along a signal.

As `uniform_filter1d`, `maximum_filter1d` and `minimum_filter1d` of scipy.ndimage, with the same bits; the import of
that package takes longer than a whole loop spends in them.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Beyond = Literal["symmetric", "edge"]
"""What a signal is taken to be beyond its ends: mirrored, its last sample twice, or held."""


def moving_mean(values: Array, size: int, beyond: Beyond = "symmetric") -> Array:
    """Mean over a window of `size` samples about each one, along the first axis.

    Parameters
    ----------
    values : ndarray, shape (N, ...)
    size : int
        Samples of the window; of an even number the one in excess is before the sample.
    """
    extended = _extended(values, size, beyond)
    first = np.cumsum(extended[:size], axis=0)[-1:]
    return np.asarray(np.cumsum(np.concatenate([first, extended[size:] - extended[:-size]]), axis=0) / size)


def moving_range(values: Array, size: int) -> Array:
    """Largest less smallest value within a window of `size` samples about each one, (N,)."""
    extended = _extended(values, size, "symmetric")
    largest = smallest = extended[: values.size]
    for first in range(1, size):
        part = extended[first : first + values.size]
        largest, smallest = np.maximum(largest, part), np.minimum(smallest, part)
    return np.asarray(largest - smallest)


def _extended(values: Array, size: int, beyond: Beyond) -> Array:
    """The signal with half a window beyond each end."""
    before = size // 2
    widths = [(before, size - before - 1), *[(0, 0)] * (values.ndim - 1)]
    return np.pad(values, widths, mode=beyond)
