"""Sine and cosine of a series of angles in one pass, which shares the reduction of the angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit

Array = NDArray[np.float64]


def sine_and_cosine(angle: Array) -> tuple[Array, Array]:
    """Sine and cosine, (N,) each, of angles (N,), rad."""
    return _sine_and_cosine(np.ascontiguousarray(angle))


@njit
def _sine_and_cosine(angle: Array) -> tuple[Array, Array]:
    sine, cosine = np.empty(angle.shape[0]), np.empty(angle.shape[0])
    for n in range(angle.shape[0]):
        sine[n], cosine[n] = np.sin(angle[n]), np.cos(angle[n])
    return sine, cosine
