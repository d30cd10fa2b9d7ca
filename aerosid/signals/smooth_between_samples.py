"""A signal that is smooth between samples, for computations that take it as linear there.

Lines through samples attenuate what passes between them: in the mean over an interval by the square of sin(x)/x,
x = pi f T of a frequency f at a sampling interval T, 3 % of 1 Hz at 10 Hz.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def samples_for_lines(values: Array) -> Array:
    """The samples (N,) changed by what lines through them lose, u - d2 u/12 + d4 u/90 of their differences.

    The response, 1 + s/12 + s^2/90 with s = 4 sin(x)^2, is the reciprocal of (sin(x)/x)^2 up to the sixth order of x.
    """
    changed = values.copy()
    changed[1:-1] -= np.diff(values, 2) / 12.0
    changed[2:-2] += np.diff(values, 4) / 90.0
    return changed
