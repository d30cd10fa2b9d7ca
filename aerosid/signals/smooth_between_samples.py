"""Signals that are smooth between samples, for computations that take them as linear there.

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


def refined(time: Array, values: Array, parts: int) -> tuple[Array, Array]:
    """Instants and samples of a signal (N,) at every part of an interval, by cubics through the four nearest samples.

    Continued in a line beyond either end.
    """
    places = np.arange(parts * (time.size - 1) + 1) / parts
    beyond = [2.0 * values[:1] - values[1:2], values, 2.0 * values[-1:] - values[-2:-1]]
    four = np.lib.stride_tricks.sliding_window_view(np.concatenate(beyond), 4)
    fine = np.append(np.empty(parts * (time.size - 1)), values[-1])
    for n in range(parts):
        s = n / parts
        weights = [-s * (s - 1) * (s - 2) / 6, (s + 1) * (s - 1) * (s - 2) / 2]
        weights += [-(s + 1) * s * (s - 2) / 2, (s + 1) * s * (s - 1) / 6]
        fine[n:-1:parts] = four @ np.array(weights)
    return np.interp(places, np.arange(time.size), time), fine
