"""Random walk of the integrated height by accelerometer and attitude noise: cosine modes with their prior sizes.

Noise of density S_a [m^2/s^3] in the vertical acceleration is integrated twice, noise of density S_theta [rad^2 s] in
the attitude once, at the airspeed: the error of the height path is an integrated random walk and a random walk
(`integrated_noise`). The climb is V sin(theta - alpha): the flow angle of an inertial path contains the integral of the
gyro's noise, of density S_q [rad^2/s], and the measured attitude does not, so that V^2 S_q adds to S_a. An
autoregression of a few poles cannot represent this together with the noise of the height sensor, and slow motion would
be attributed to an error of the airspeed or height sensor.

The mean flow angle of the path is that of the vane; after a mean gust w the rate of climb is in error by
w V(t)/mean(V), which integrates to a straight line only while the airspeed is constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.integrated_noise import noise_density, random_walk_modes
from aerosid.equation_error.equations.recording import Recording, has_inertial_path
from aerosid.equation_error.equations.running_integral import running_integral
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]


def height_random_walk(recording: Recording, time: Array, settings: EquationErrorSettings) -> Array:
    """Modes (N, K + 1), m, of unit standard deviation each, at instants (N,) s."""
    cosines, integrals, length = random_walk_modes(time, settings)
    speed = float(np.mean(recording.as_measured("V")))
    vertical = noise_density(recording, "a_z", settings)
    if has_inertial_path(recording):
        vertical += speed**2 * noise_density(recording, "q", settings)
    twice = np.sqrt(2.0 * vertical / length) * integrals**2
    once = speed * np.sqrt(2.0 * noise_density(recording, "theta", settings) / length) * integrals
    if not has_inertial_path(recording):
        # A gust moves the vane: the rate of climb by it contains the gust, of density sigma^2 L/V (Dryden).
        gusts = settings.light_turbulence**2 * settings.turbulence_scale / speed
        once = np.hypot(once, np.sqrt(2.0 * gusts / length) * integrals)
    modes = cosines * np.hypot(twice, once)
    airspeed = np.interp(time, recording.time, recording.as_measured("V"))
    gust_mode = settings.drifts["h"] * running_integral(airspeed / airspeed.mean() - 1.0, float(time[1] - time[0]))
    return np.column_stack([modes, gust_mode])
