"""Complementary filter of inertial path and air sensors: what is fast from the one, what is slow from the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.signals.gaussian_filter import gaussian_filtered
from aerosid.signals.local_regression import locally_smoothed

Array = NDArray[np.float64]


def without_gusts(measured: Array, path: Array, samples: float) -> Array:
    """The path with the wind's drift: what was measured beyond it, smoothed over scales of gusts.

    Held beyond the ends, where a line would follow the last gust out of the record.
    """
    difference = measured - path
    centred = np.arange(path.size) - 0.5 * (path.size - 1)
    line = difference.mean() + centred * float(centred @ difference) / float(centred @ centred)
    return np.asarray(path + line + gaussian_filtered(difference - line, samples))


def blended(measured: Array, path: Array, samples: float) -> Array:
    """The path with the difference of what was measured from it, smoothed by a Gaussian of that standard deviation."""
    if samples < 0.5:
        return measured
    return np.asarray(path + locally_smoothed(measured - path, samples))
