"""Integral of sampled rates by trapezoids."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def integral_from_start(time: NDArray[np.float64], rate: NDArray[np.float64]) -> NDArray[np.float64]:
    """The integral of a rate (N,) from the first sample to each, linear between samples; unit of the rate times s."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
