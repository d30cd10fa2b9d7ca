"""Pearson's correlation coefficient of two series."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Linear correlation about the means of two series (N,); 0 where either does not vary."""
    a, b = a - a.mean(), b - b.mean()
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0.0 else 0.0
