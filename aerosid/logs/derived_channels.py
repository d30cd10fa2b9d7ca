"""Channels computed from others: air density, true airspeed from calibrated, flow angles at the centre of gravity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.logs.standard_atmosphere import density, true_airspeed

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Law:
    """The law by which a channel is computed from others.

    Attributes
    ----------
    compute : callable
        From one array per quantity, shape (N,), and the numbers of `constants`, to the channel.
    inputs : tuple of (str, str)
        Name and unit of each quantity; the channel map may give another source for a name.
    unit : str
        Of the result.
    constants : tuple of (str, str)
        Names and units of constants that the channel map has to give.
    """

    compute: Callable[..., FloatArray]
    inputs: tuple[tuple[str, str], ...]
    unit: str
    constants: tuple[str, ...] = ()


def alpha_at_centre_of_gravity(
    alpha: FloatArray, airspeed: FloatArray, p: FloatArray, q: FloatArray, x: float, y: float, z: float
) -> FloatArray:
    """Angle of attack, rad, at the centre of gravity from a vane at (x, y, z) m from it; shape (N,).

    Notes
    -----
    The vane moves by omega cross r: w_vane = w + p y - q x and u_vane = u + q z (the small term of the
    yaw rate is neglected),
    V. Klein and E. A. Morelli, Aircraft System Identification, eq. (10.9).
    """
    u = airspeed * np.cos(alpha) - q * z
    w = airspeed * np.sin(alpha) - p * y + q * x
    return np.asarray(np.arctan2(w, u))


def beta_at_centre_of_gravity(
    beta: FloatArray, airspeed: FloatArray, p: FloatArray, r: FloatArray, x: float, z: float
) -> FloatArray:
    """Sideslip angle, rad, at the centre of gravity from a vane at (x, ., z) m from it; shape (N,).

    Notes
    -----
    v_vane = v + r x - p z, the same source, eq. (10.10).
    """
    v = airspeed * np.sin(beta) - r * x + p * z
    return np.asarray(np.arcsin(np.clip(v / np.where(airspeed > 0.0, airspeed, np.nan), -1.0, 1.0)))


def pitch_of_quaternion(w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Pitch angle, rad, of the rotation from north-east-down to body axes; shape (N,)."""
    return np.asarray(np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)))


def bank_of_quaternion(w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Bank angle, rad, of the rotation from north-east-down to body axes; shape (N,)."""
    return np.asarray(np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x**2 + y**2)))


def heading_of_quaternion(w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    """Heading, rad, of the rotation from north-east-down to body axes; shape (N,)."""
    return np.asarray(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y**2 + z**2)))


_QUATERNION = (("quaternion_w", "1"), ("quaternion_x", "1"), ("quaternion_y", "1"), ("quaternion_z", "1"))

LAWS: dict[str, Law] = {
    "density": Law(density, (("h", "m"), ("temperature", "K")), "kg/m^3"),
    "true airspeed": Law(true_airspeed, (("cas", "m/s"), ("h", "m"), ("temperature", "K")), "m/s"),
    "alpha at the centre of gravity": Law(
        alpha_at_centre_of_gravity,
        (("alpha_vane", "rad"), ("V", "m/s"), ("p", "rad/s"), ("q", "rad/s")),
        "rad",
        ("x", "y", "z"),
    ),
    "beta at the centre of gravity": Law(
        beta_at_centre_of_gravity,
        (("beta_vane", "rad"), ("V", "m/s"), ("p", "rad/s"), ("r", "rad/s")),
        "rad",
        ("x", "z"),
    ),
    "pitch of a quaternion": Law(pitch_of_quaternion, _QUATERNION, "rad"),
    "bank of a quaternion": Law(bank_of_quaternion, _QUATERNION, "rad"),
    "heading of a quaternion": Law(heading_of_quaternion, _QUATERNION, "rad"),
}
"""Every law, by its name in a channel map."""
