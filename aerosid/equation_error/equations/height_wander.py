"""What the noise of accelerometers and attitude leaves in the integrated height: cosine modes with their prior sizes.

Noise of density S_a [m^2/s^3] in the vertical acceleration is integrated twice, noise of density S_theta [rad^2 s] in
the attitude once, at the airspeed: the path of the height goes astray by an integrated random walk and a random walk.
On a record of T seconds the part of either along cos(k pi t/T) is normal with deviation sqrt(2 S_a/T) (T/(k pi))^2 and
V sqrt(2 S_theta/T) T/(k pi) (cosine expansion of white noise, term by term). A few poles of an autoregression do not
hold it beside the height's own noise, and what moves slowly would be told as a fault of the airspeed or the height.

The path's flow angle is that of the vane on average; after a mean gust w the climb is off by w V(t)/mean(V), which is a
line only while the airspeed is constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.running_integral import running_integral
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]


def height_wander(recording: Recording, time: Array, settings: EquationErrorSettings) -> Array:
    """Modes (N, K + 1), m, of unit standard deviation each, at instants (N,) s."""
    length = float(time[-1] - time[0])
    order = np.arange(1, settings.wander_modes + 1)
    slow = length / (np.pi * order)
    speed = float(np.mean(recording.held("V")))
    twice = np.sqrt(2.0 * _density(recording, "a_z", settings) / length) * slow**2
    once = speed * np.sqrt(2.0 * _density(recording, "theta", settings) / length) * slow
    modes = np.cos(np.outer((time - time[0]) / length, np.pi * order)) * np.hypot(twice, once)
    airspeed = np.interp(time, recording.time, recording.held("V"))
    astray = settings.drifts["h"] * running_integral(airspeed / airspeed.mean() - 1.0, float(time[1] - time[0]))
    return np.column_stack([modes, astray])


def _density(recording: Recording, channel: str, settings: EquationErrorSettings) -> float:
    """Spectral density of a sensor's slow noise, its unit squared times s."""
    least = settings.least_noise.get(channel, 0.0)
    manoeuvre = recording.manoeuvre
    shown = float(manoeuvre.noise[manoeuvre.row(channel)]) if channel in manoeuvre.axes.outputs else 0.0
    return settings.noise_memory * float(np.fmax(least, shown)) ** 2
