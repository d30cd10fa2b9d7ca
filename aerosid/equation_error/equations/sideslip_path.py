"""Sideslip: of the lateral accelerometer's path, of a vane elsewhere, and where there is no vane.

    beta = asin(I[a_y + g cos theta sin phi - r u + p w]/V)

(Klein & Morelli, Aircraft System Identification, eq. 10.3b). Without a vane nothing tells the path's first value nor
what the zeros of the accelerometer, the gyros and the bank angle add to it, which is a line in time: the path is taken
about its line, and the coefficient equations have one of their own. What is wrong with the angle of attack and with the
size of the bank angle comes and goes with the rolling: of that they have what is usual (`path_errors`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.equation_error.equations.angular_rates import Rates
from aerosid.equation_error.equations.inertial_path import aligned
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.running_integral import running_integral
from aerosid.equation_error.equations.sensors import position
from aerosid.flight_model.constants import GRAVITY

Array = NDArray[np.float64]

WIDEST = 0.99
"""Numerical: sine of the largest sideslip that a path may have, 1."""


@dataclass(frozen=True)
class LateralPath:
    """What turns a flight path aside.

    Attributes
    ----------
    side : ndarray, shape (N,)
        Specific force and gravity along y at the centre of gravity, m/s^2.
    rates : Rates
    interval : float
        s.
    seen : bool
        Whether a vane shows sideslip.
    """

    side: Array
    rates: Rates
    interval: float
    seen: bool

    def path(self, plane: tuple[Array, Array], v: Array, speed: Array) -> Array:
        """The sideslip, rad, of the lateral accelerometer's path with u and w in the `plane`, m/s.

        `v`: as the vane has it, m/s: the path has its mean; without a vane it is taken about its line.
        """
        u, w = plane
        path = running_integral(self.side - self.rates.r * u + self.rates.p * w, self.interval)
        path = aligned(path, v) if self.seen else detrended(path)
        # Beyond a right angle there is no sideslip that a faulty sensor could have read.
        return np.arcsin(np.clip(path / speed, -WIDEST, WIDEST))


def detrended(values: Array) -> Array:
    """A series without its mean and its trend, (N,)."""
    centred = np.arange(values.size) - 0.5 * (values.size - 1)
    return np.asarray(values - values.mean() - centred * float(centred @ values) / float(centred @ centred))


def path_errors(
    rates: Rates, attitude: tuple[Array, Array], speed: Array, interval: float, usual: Mapping[str, float]
) -> Array:
    """What usual errors of other sensors make of a path's sideslip, rad, (N, 2), each of one standard deviation.

    Parameters
    ----------
    attitude : tuple of ndarray, shape (N,)
        Bank and pitch angle, rad.
    usual : mapping of str to float
        Standard deviations of the zero of the angle of attack, rad, which turns rolling into sideslip, and of the scale
        of the bank angle, 1.
    """
    phi, theta = attitude
    rolled = usual["alpha"] * rates.p * speed
    banked = usual["phi"] * GRAVITY * np.cos(theta) * np.cos(phi) * phi
    paths = running_integral(np.column_stack([rolled, banked]), interval)
    return np.column_stack([detrended(path) / speed for path in paths.T])


def mean_gust_correction(left: Array, bent: Array, wind: Array) -> Array:
    """How far the mean of the gusts from the side bends the path in the plane, rad, (N,).

    A record tells the sideslip of the aircraft but for the mean of the gusts over it, which rolling turns into the
    plane, as the bank angle goes. Least squares with the deviation of the mean of a first-order autoregression.

    Parameters
    ----------
    left : ndarray, shape (N,)
        What the vane shows beyond the path, rad.
    bent : ndarray, shape (N,)
        The path's bend for one m/s, rad.
    wind : ndarray, shape (N,)
        What the vane of sideslip shows beyond its path, m/s.
    """
    left, bent = detrended(left), detrended(bent)
    wind = wind - wind.mean()
    kept = float(np.clip(wind[1:] @ wind[:-1] / max(float(wind @ wind), 1e-300), 0.0, 0.999))
    mean = float(np.var(wind)) * (1.0 + kept) / (1.0 - kept) / wind.size
    noise = float(np.var(left))
    return np.asarray(float(left @ bent) / (float(bent @ bent) + noise / max(mean, 1e-300)) * bent)


def beta_at_centre(
    recording: Recording, effects: Sequence[ActiveEffect], beta: Array, speed: Array, rates: Rates
) -> Array:
    """Sideslip at the centre of gravity from that of the vane."""
    if "beta" not in recording.channels:
        return beta
    x, _, z = position(recording, effects, "beta")
    if not (x or z):
        return beta
    return np.asarray(beta - (x * rates.r - z * rates.p) / speed)
