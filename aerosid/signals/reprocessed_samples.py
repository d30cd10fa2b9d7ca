"""Detection of samples that were repeated, interpolated, quantised or filtered, whose differences show no noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.signals.moving_window import moving_range
from aerosid.signals.settings import REPROCESSING, ReprocessingSettings

__all__ = ["doubt_of_noise"]


def doubt_of_noise(values: NDArray[np.float64], estimated: float, settings: ReprocessingSettings = REPROCESSING) -> str:
    """Why an estimate of white noise is not to be believed, as a sentence's end; empty where it is.

    Parameters
    ----------
    values : ndarray, shape (N,)
        Samples of one channel, in its unit; NaN where missing.
    estimated : float
        Standard deviation of their noise by their differences, in the channel's unit.
    """
    present = values[np.isfinite(values)]
    excursion = float(np.ptp(present)) if present.size else 0.0
    if present.size < settings.fewest or excursion == 0.0:
        return ""
    step = np.abs(np.diff(present))
    nothing = settings.rounding * excursion
    # At rest a channel repeats itself rightly: only where it moves can repetition be told.
    moving = _moving(present, excursion, settings)
    repeated = step[moving[1:] & moving[:-1]] <= nothing
    if repeated.size > settings.fewest and float(np.mean(repeated)) > settings.repeated_share:
        levels = np.unique(present).size
        if levels < settings.level_share * present.size:
            # The quantum over sqrt(12) is then the estimate; without even that nothing is known.
            return "" if estimated > 0.0 else "it is quantised: its steps hide the noise"
        return "samples are repeated: it was recorded more slowly than the log"
    bend = np.abs(np.diff(present, 2))
    straight = bend[moving[2:] & moving[:-2]] <= nothing
    if straight.size > settings.fewest and float(np.mean(straight)) > settings.straight_share:
        return "it lies on straight lines: it was interpolated"
    if estimated < settings.finest * excursion:
        return "it is smoother than any sensor: it was filtered, or computed"
    return ""


def _moving(values: NDArray[np.float64], excursion: float, settings: ReprocessingSettings) -> NDArray[np.bool_]:
    """Where a channel travels far enough within a window, (N,)."""
    return moving_range(values, settings.window) > settings.travel * excursion
