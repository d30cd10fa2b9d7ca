"""What the noise of accelerometers and attitude leaves in the integrated height: cosine modes with their prior sizes.

Noise of density S_a [m^2/s^3] in the vertical acceleration is integrated twice, noise of density S_theta [rad^2 s] in
the attitude once, at the airspeed: the path of the height goes astray by an integrated random walk and a random walk
(`slow_noise`). A few poles of an autoregression do not hold it beside the height's own noise, and what moves slowly
would be told as a fault of the airspeed or the height.

The path's flow angle is that of the vane on average; after a mean gust w the climb is off by w V(t)/mean(V), which is a
line only while the airspeed is constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.running_integral import running_integral
from aerosid.equation_error.equations.slow_noise import noise_density, slow_modes
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]


def height_wander(recording: Recording, time: Array, settings: EquationErrorSettings) -> Array:
    """Modes (N, K + 1), m, of unit standard deviation each, at instants (N,) s."""
    cosines, slow, length = slow_modes(time, settings)
    speed = float(np.mean(recording.held("V")))
    twice = np.sqrt(2.0 * noise_density(recording, "a_z", settings) / length) * slow**2
    once = speed * np.sqrt(2.0 * noise_density(recording, "theta", settings) / length) * slow
    modes = cosines * np.hypot(twice, once)
    airspeed = np.interp(time, recording.time, recording.held("V"))
    astray = settings.drifts["h"] * running_integral(airspeed / airspeed.mean() - 1.0, float(time[1] - time[0]))
    return np.column_stack([modes, astray])
