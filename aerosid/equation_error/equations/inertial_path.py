"""Strapdown integration in the plane of symmetry: angle of attack and speed from rates and accelerations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.equation_error.equations.complementary_filter import without_gusts
from aerosid.equation_error.equations.running_integral import summed_up

Array = NDArray[np.float64]

PATH_ROUNDS = 3
"""Numerical: times that the path is integrated, from measured velocities and then from its own, with fewer gusts."""


def inertial_path(
    air_sensors: tuple[Array, Array], q: Array, forcing: tuple[Array, Array], interval: float, drift: float
) -> tuple[Array, Array]:
    """Angle of attack, rad, and speed in the plane of symmetry, m/s, integrated, (2, N), and the angle's rate, (N,).

    Parameters
    ----------
    air_sensors : tuple of ndarray, shape (N,)
        Both as measured by vane and pitot tube, gusts included.
    forcing : tuple of ndarray, shape (N,)
        u' + q w and w' - q u, m/s^2.
    drift : float
        Standard deviation, samples, of the Gaussian that separates the wind's drift from gusts.
    """
    path = measured = np.stack(air_sensors)
    for turn in range(PATH_ROUNDS):
        if turn:
            path = without_gusts(measured, path, drift)
        path, rate = _integrated(path, q, *forcing, measured, interval)
    return path, rate


@njit
def _integrated(
    before: Array, q: Array, ahead: Array, below: Array, measured: Array, interval: float
) -> tuple[Array, Array]:
    """Angle of attack and speed in the plane, (2, N), from u' + q w and w' - q u, and the angle's rate, (N,).

    With u and w of the path `before`, (2, N), and the means of the measured signals.
    """
    samples = q.shape[0]
    rates = np.empty((2, samples))
    for n in range(samples):
        alpha, speed = before[0, n], before[1, n]
        u, w = speed * np.cos(alpha), speed * np.sin(alpha)
        u_dot, w_dot = ahead[n] - q[n] * w, below[n] + q[n] * u
        rates[0, n] = (u * w_dot - w * u_dot) / (speed * speed)
        rates[1, n] = (u * u_dot + w * w_dot) / speed
    path = np.empty((2, samples))
    for k in range(2):
        summed_up(rates[k], interval, path[k])
        _align(path[k], measured[k])
    return path, rates[0]


@njit_inline
def _align(path: Array, measured: Array) -> None:
    """Give a path the mean of the measured signal, in place."""
    total = 0.0
    for n in range(path.shape[0]):
        total += measured[n] - path[n]
    for n in range(path.shape[0]):
        path[n] += total / path.shape[0]


def aligned(path: Array, measured: Array) -> Array:
    """The path with the mean of the measured signal, (N,)."""
    return np.asarray(path + float(np.mean(measured - path)))
