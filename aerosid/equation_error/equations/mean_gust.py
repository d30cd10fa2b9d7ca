"""Error of the integrated airspeed by the mean gust of a record.

The mean flow angle of the path is that of the vane, which sees the mean gust of the record. With an angle of attack c
off, the airspeed path is in error by the integral of c dV'/d(alpha) = c V (alpha' - q), by -c times the airspeed and
the change of the flight path's angle: as by a bias of the vane, but by a different one on each record. In air that
moves steadily there is no such error, since path and vane are then in one frame; a gust of some hundred metres that
turns with the aircraft, as in the Dryden spectra of MIL-F-8785C, which are about body axes, makes all of it. Found on
benchmarks/field_detection.py, seed 168, where it was told as a bias of the vane.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.kinematic import reconstruct
from aerosid.equation_error.equations.recording import Recording, has_inertial_path
from aerosid.equation_error.equations.running_integral import running_integral
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]

FEWEST_PARTS = 4
"""Numerical: parts of a record whose means tell a standard deviation about a line."""


def airspeed_by_mean_gust(recording: Recording, settings: EquationErrorSettings) -> Array | None:
    """The error of the airspeed path, m/s, in the band, (n, 1), by a mean gust of one standard deviation.

    That of the mean gusts of parts of the record, by which its vane differs from its path, and no larger than the
    vertical air motion of `settings.drifts`. None without a vane or an integrated path.
    """
    if "alpha" not in recording.channels or not has_inertial_path(recording):
        return None
    motion = reconstruct(recording, (), recording.channels, settings)
    gusts = _spread_of_means(recording.channels["alpha"] - motion.path["alpha"], recording.interval, settings)
    angle = min(gusts, settings.drifts["h"] / float(np.mean(motion.V)))
    error = angle * running_integral(motion.V * (motion.alpha_dot - motion.rates.q), recording.interval)
    return recording.band(error[:, None])


def _spread_of_means(difference: Array, interval: float, settings: EquationErrorSettings) -> float:
    """Standard deviation of the means of a record's parts about a line in time, which the path's drift makes.

    A late vane differs from its path while it turns, and hardly on average.
    """
    count = max(FEWEST_PARTS, int(difference.size * interval / settings.block_length))
    means = np.array([part.mean() for part in np.array_split(difference, count)])
    left = means - np.polyval(np.polyfit(np.arange(count), means, 1), np.arange(count))
    return float(np.sqrt(left @ left / (count - 2)))
