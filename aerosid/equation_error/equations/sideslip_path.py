"""Sideslip: from the lateral accelerometer's path, from an offset vane, and without a vane.

    beta = asin(I[a_y + g cos theta sin phi - r u + p w]/V)

(Klein & Morelli, Aircraft System Identification, eq. 10.3b). Without a vane the path's first value is unknown, as is
the contribution of the biases of the accelerometer, the gyros and the bank angle, which is a line in time: the path is
detrended, and the coefficient equations have a line of their own. Errors of the angle of attack and of the scale of the
bank angle vary with the rolling motion: they are modelled with their usual sizes (`path_errors`).
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
from aerosid.signals.autoregression import variance_of_mean

Array = NDArray[np.float64]

WIDEST = 0.99
"""Numerical: sine of the largest sideslip that a path may have, 1."""


@dataclass(frozen=True)
class LateralPath:
    """Signals that determine the lateral flight path.

    Attributes
    ----------
    side : ndarray, shape (N,)
        Specific force and gravity along y at the centre of gravity, m/s^2.
    rates : Rates
    interval : float
        s.
    has_vane : bool
        Whether a vane measures sideslip.
    """

    side: Array
    rates: Rates
    interval: float
    has_vane: bool

    def path(self, plane: tuple[Array, Array], v: Array, speed: Array) -> Array:
        """The sideslip, rad, of the lateral accelerometer's path with u and w in the `plane`, m/s.

        `v`: as measured by the vane, m/s, whose mean the path gets; without a vane it is detrended.
        """
        u, w = plane
        path = running_integral(self.side - self.rates.r * u + self.rates.p * w, self.interval)
        path = aligned(path, v) if self.has_vane else detrended(path)
        # No sideslip that a faulty sensor could have read lies beyond a right angle.
        return np.arcsin(np.clip(path / speed, -WIDEST, WIDEST))


def detrended(values: Array) -> Array:
    """A series without its mean and its trend, (N,)."""
    centred = np.arange(values.size) - 0.5 * (values.size - 1)
    return np.asarray(values - values.mean() - centred * float(centred @ values) / float(centred @ centred))


def path_errors(
    rates: Rates, attitude: tuple[Array, Array], speed: Array, interval: float, usual: Mapping[str, float]
) -> Array:
    """Effect of usual errors of other sensors on a path's sideslip, rad, (N, 2), each of one standard deviation.

    Parameters
    ----------
    attitude : tuple of ndarray, shape (N,)
        Bank and pitch angle, rad.
    usual : mapping of str to float
        Standard deviations of the bias of the angle of attack, rad, which couples rolling into sideslip, and of the
        scale factor error of the bank angle, 1.
    """
    phi, theta = attitude
    rolled = usual["alpha"] * rates.p * speed
    banked = usual["phi"] * GRAVITY * np.cos(theta) * np.cos(phi) * phi
    paths = running_integral(np.column_stack([rolled, banked]), interval)
    return np.column_stack([detrended(path) / speed for path in paths.T])


def mean_gust_correction(left: Array, bend: Array, wind: Array) -> Array:
    """Correction of the path in the plane for the mean of the side gusts, rad, (N,).

    A record determines the aircraft's sideslip except for the mean of the gusts over it, which rolling couples into the
    plane, in proportion to the bank angle. Least squares with the standard error of the mean of a first-order
    autoregression.

    Parameters
    ----------
    left : ndarray, shape (N,)
        Difference of the vane from the path, rad.
    bend : ndarray, shape (N,)
        Change of the path by one m/s, rad.
    wind : ndarray, shape (N,)
        Difference of the sideslip vane from its path, m/s.
    """
    left, bend = detrended(left), detrended(bend)
    noise = float(np.var(left))
    return np.asarray(float(left @ bend) / (float(bend @ bend) + noise / max(variance_of_mean(wind), 1e-300)) * bend)


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
