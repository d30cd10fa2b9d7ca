"""What the noise of sensors leaves in an integral of theirs: cosine modes with their prior sizes.

White noise of density S [unit^2 s] integrated over a record of T seconds is a random walk, whose part along
cos(k pi t/T) is normal with deviation sqrt(2 S/T) T/(k pi); integrated twice, sqrt(2 S/T) (T/(k pi))^2 (cosine
expansion of white noise, term by term).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]


def random_walk_modes(time: Array, settings: EquationErrorSettings) -> tuple[Array, Array, float]:
    """Cosines at instants (N,) s, (N, K), what integrating makes of each, s, (K,), and the record's length, s."""
    length = float(time[-1] - time[0])
    order = np.arange(1, settings.wander_modes + 1)
    slow = np.asarray(length / (np.pi * order), dtype=np.float64)
    return np.cos(np.outer((time - time[0]) / length, np.pi * order)), slow, length


def noise_density(recording: Recording, channel: str, settings: EquationErrorSettings) -> float:
    """Spectral density of a sensor's slow noise, its unit squared times s."""
    least = settings.least_noise.get(channel, 0.0)
    return settings.noise_memory * float(np.fmax(least, _shown(recording, channel))) ** 2


def integral_modes(
    recording: Recording, time: Array, shares: Mapping[str, float], settings: EquationErrorSettings
) -> Array:
    """Modes (N, K) of an integral of sensors whose noise is white, each of one standard deviation, its unit.

    Parameters
    ----------
    shares : mapping of str to float
        By what each sensor's reading is multiplied in the integrand.
    """
    cosines, slow, length = random_walk_modes(time, settings)
    density = recording.interval * sum((share * _shown(recording, name)) ** 2 for name, share in shares.items())
    return np.asarray(cosines * (np.sqrt(2.0 * density / length) * slow))


def _shown(recording: Recording, channel: str) -> float:
    """Standard deviation of the noise that a channel's samples show."""
    manoeuvre = recording.manoeuvre
    return float(manoeuvre.noise[manoeuvre.row(channel)]) if channel in manoeuvre.axes.outputs else 0.0
