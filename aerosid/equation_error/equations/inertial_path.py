"""Strapdown integration in the plane of symmetry: angle of attack and speed from rates and accelerations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.equation_error.equations.running_integral import running_integral
from aerosid.equation_error.equations.smoothing import without_gusts

Array = NDArray[np.float64]

PATH_ROUNDS = 3
"""Numerical: times that the path is integrated, from measured velocities and then from its own, with fewer gusts."""


def inertial_path(
    alpha: Array,
    speed: Array,
    velocities: tuple[Array, Array],
    q: Array,
    forcing: tuple[Array, Array],
    interval: float,
    drift: float,
) -> tuple[Array, Array, Array]:
    """Angle of attack, rad, and speed in the plane of symmetry, m/s, by integration, and the angle's rate, (N,) each.

    Parameters
    ----------
    alpha, speed : ndarray, shape (N,)
        As vane and pitot tube have them, gusts included; their `velocities` u and w.
    forcing : tuple of ndarray, shape (N,)
        u' + q w and w' - q u, m/s^2.
    drift : float
        Standard deviation, samples, of the Gaussian that tells the wind's drift from gusts.
    """
    path_alpha, path_speed = alpha, speed
    u, w = velocities
    for turn in range(PATH_ROUNDS):
        if turn:
            path_alpha = without_gusts(alpha, path_alpha, drift)
            path_speed = without_gusts(speed, path_speed, drift)
            u, w = path_speed * np.cos(path_alpha), path_speed * np.sin(path_alpha)
        rate, along = _turned_and_gained(u, w, path_speed, q, *forcing)
        path_alpha = aligned(running_integral(rate, interval), alpha)
        path_speed = aligned(running_integral(along, interval), speed)
    return path_alpha, path_speed, rate


@njit
def _turned_and_gained(u: Array, w: Array, speed: Array, q: Array, ahead: Array, below: Array) -> tuple[Array, Array]:
    """The rates of the angle of attack and of the speed in the plane, (N,) each, of u' + q w and w' - q u."""
    rate, along = np.empty(u.size), np.empty(u.size)
    for n in range(u.size):
        u_dot, w_dot = ahead[n] - q[n] * w[n], below[n] + q[n] * u[n]
        rate[n] = (u[n] * w_dot - w[n] * u_dot) / (speed[n] * speed[n])
        along[n] = (u[n] * u_dot + w[n] * w_dot) / speed[n]
    return rate, along


def aligned(path: Array, measured: Array) -> Array:
    """The path with the mean of what was measured, (N,)."""
    return np.asarray(path + float(np.mean(measured - path)))
