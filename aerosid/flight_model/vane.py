"""Angle of attack at the centre of gravity from that of a vane elsewhere on the aircraft."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Angle = TypeVar("Angle", float, NDArray[np.float64])


def alpha_at_centre(
    alpha: Angle, place: tuple[float, float, float], p: Angle, q: Angle, r: Angle, speed: Angle
) -> Angle:
    """Angle of attack at the centre of gravity, rad, to first order in the rates.

    Parameters
    ----------
    alpha : float or ndarray
        At the vane, rad.
    place : (float, float, float)
        Of the vane, m ahead of the centre of gravity, right of it and below it.
    p, q, r : float or ndarray
        Rates, rad/s.
    speed : float or ndarray
        Airspeed, m/s.

    Notes
    -----
    A vane turns with the flow at its own place, tan(alpha_v) = (w + p y - q x) / (u + q z - r y), as `sensors.sense`
    has it: to first order in the rates that is alpha + ((p y - q x) cos(alpha) - (q z - r y) sin(alpha)) / V.
    """
    ahead, right, below = place
    turned = (q * ahead - p * right) * np.cos(alpha) + (q * below - r * right) * np.sin(alpha)
    at_centre: Angle = alpha + turned / speed
    return at_centre
