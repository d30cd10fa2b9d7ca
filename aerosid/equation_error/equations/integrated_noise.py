"""Random walk of integrated sensor noise: cosine modes with their prior sizes.

White noise of density S [unit^2 s] integrated over a record of T seconds is a random walk, whose component along cos(k
pi t/T) is normal with standard deviation sqrt(2 S/T) T/(k pi); integrated twice, sqrt(2 S/T) (T/(k pi))^2 (cosine
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
    """Cosines at instants (N,) s, (N, K), integration gain of each, s, (K,), and the record's length, s."""
    length = float(time[-1] - time[0])
    order = np.arange(1, settings.wander_modes + 1)
    integrals = np.asarray(length / (np.pi * order), dtype=np.float64)
    return np.cos(np.outer((time - time[0]) / length, np.pi * order)), integrals, length


def noise_density(recording: Recording, channel: str, settings: EquationErrorSettings) -> float:
    """Spectral density of a sensor's low-frequency noise, its unit squared times s."""
    least = settings.least_noise.get(channel, 0.0)
    return settings.noise_memory * float(np.fmax(least, _noise(recording, channel))) ** 2


def integral_modes(
    recording: Recording, time: Array, gains: Mapping[str, float], settings: EquationErrorSettings
) -> Array:
    """Modes (N, K) of an integral of sensors with white noise, each of one standard deviation, its unit.

    Parameters
    ----------
    gains : mapping of str to float
        Factor of each sensor's signal in the integrand.
    """
    cosines, integrals, length = random_walk_modes(time, settings)
    density = recording.own_interval * sum((gain * _noise(recording, name)) ** 2 for name, gain in gains.items())
    return np.asarray(cosines * (np.sqrt(2.0 * density / length) * integrals))


def _noise(recording: Recording, channel: str) -> float:
    """Standard deviation of the noise estimated from a channel's samples."""
    manoeuvre = recording.manoeuvre
    return float(manoeuvre.noise[manoeuvre.row(channel)]) if channel in manoeuvre.axes.outputs else 0.0
