"""Flight-path reconstruction: integration of measured accelerations and rates, with sensitivities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.constants import GRAVITY
from aerosid.signals.array_elements import copy_row, copy_rows

DRIVING = ("a_x", "a_z", "q")
"""Measured inputs that drive the path: specific force at the centre of gravity, m/s^2, and pitch rate, rad/s."""

GIVEN = (*DRIVING, "p", "r", "phi", "beta")
"""All inputs of the path's equations, in the order of their columns; those not driving are taken as measured."""

STATES = ("u", "w", "theta", "h")
"""States of the path: body-axis velocities, m/s, pitch angle, rad, and altitude, m."""

OBSERVED = ("V", "alpha", "theta", "h")
"""Output channels compared with the path, in the order of their columns."""

LONGEST_STEP = 0.1
"""Numerical: largest integration step, s; a fourth-order step of this length is accurate to 1e-7 at half a radian per
second."""

Array = NDArray[np.float64]

_STATES, _DRIVING, _GIVEN = len(STATES), len(DRIVING), len(GIVEN)


class Path(NamedTuple):
    """A path and its derivatives along D directions of the driving inputs.

    `states` (n, 4), those of `STATES`; `columns` (n, 4, 4 + D) with respect to the initial state and along the
    directions.
    """

    states: Array
    columns: Array


@njit_inline
def _rates(x: Array, given: Array, rates: Array, by_state: Array, by_driving: Array) -> None:
    """Rates of the path and their partial derivatives with respect to the states and the driving inputs."""
    a_x, a_z, q, p, r, phi, beta = given
    u, w, theta, _ = x
    sin_pitch, cos_pitch = np.sin(theta), np.cos(theta)
    sin_phi, cos_phi = np.sin(phi), np.cos(phi)
    tan_beta = np.tan(beta)
    plane = np.sqrt(u * u + w * w)
    v, v_u, v_w = plane * tan_beta, u / plane * tan_beta, w / plane * tan_beta
    rates[0] = a_x - GRAVITY * sin_pitch - q * w + r * v
    rates[1] = a_z + GRAVITY * cos_pitch * cos_phi + q * u - p * v
    rates[2] = q * cos_phi - r * sin_phi
    rates[3] = u * sin_pitch - v * sin_phi * cos_pitch - w * cos_phi * cos_pitch
    by_state[0, 0], by_state[0, 1], by_state[0, 2] = r * v_u, -q + r * v_w, -GRAVITY * cos_pitch
    by_state[1, 0], by_state[1, 1], by_state[1, 2] = q - p * v_u, -p * v_w, -GRAVITY * sin_pitch * cos_phi
    by_state[3, 0] = sin_pitch - v_u * sin_phi * cos_pitch
    by_state[3, 1] = -v_w * sin_phi * cos_pitch - cos_phi * cos_pitch
    by_state[3, 2] = u * cos_pitch + v * sin_phi * sin_pitch + w * cos_phi * sin_pitch
    by_driving[0, 0], by_driving[0, 2] = 1.0, -w
    by_driving[1, 1], by_driving[1, 2] = 1.0, u
    by_driving[2, 2] = cos_phi


@njit
def integrate_path(time: Array, given: Array, initial: Array, directions: Array) -> Path:
    """The path from an initial state, with its derivatives.

    Parameters
    ----------
    time : ndarray, shape (n,)
        s.
    given : ndarray, shape (n, 7)
        The channels of `GIVEN`, SI; linear between samples.
    initial : ndarray, shape (4,)
        u, w [m/s], theta [rad], h [m].
    directions : ndarray, shape (n, 3, D)
        Changes of a_x, a_z and q to which the path's sensitivities are computed.

    Notes
    -----
    u' = a_x - g sin(theta) - q w + r v, w' = a_z + g cos(theta) cos(phi) + q u - p v,
    theta' = q cos(phi) - r sin(phi), h' = u sin(theta) - v sin(phi) cos(theta) - w cos(phi) cos(theta), with
    v = sqrt(u^2 + w^2) tan(beta), by fourth-order Runge-Kutta steps; the derivatives are those of the discrete
    solution. Jategaonkar, Flight Vehicle System Identification, 2nd ed., section 10.3.
    """
    samples, width = time.shape[0], _STATES + directions.shape[2]
    states, columns = np.zeros((samples, _STATES)), np.zeros((samples, _STATES, width))
    x, column = initial.copy(), np.zeros((_STATES, width))
    for a in range(_STATES):
        column[a, a] = 1.0
    here, along = np.zeros(_GIVEN), np.zeros((_DRIVING, directions.shape[2]))
    rates, by_state, by_driving = np.zeros(_STATES), np.zeros((_STATES, _STATES)), np.zeros((_STATES, _DRIVING))
    slope = np.zeros((_STATES, width))
    copy_row(states[0], x)
    copy_rows(columns[0], column)
    for k in range(samples - 1):
        interval = time[k + 1] - time[k]
        pieces = max(1, int(np.ceil(interval / LONGEST_STEP - 1e-9)))
        step = interval / pieces
        for piece in range(pieces):
            at, column_at = x.copy(), column.copy()
            total, column_total = np.zeros(_STATES), np.zeros((_STATES, width))
            for stage in range(4):
                within = 0.0 if stage == 0 else (0.5 if stage < 3 else 1.0)
                fraction = (piece + within) / pieces
                for j in range(_GIVEN):
                    here[j] = (1.0 - fraction) * given[k, j] + fraction * given[k + 1, j]
                for j in range(_DRIVING):
                    for d in range(directions.shape[2]):
                        along[j, d] = (1.0 - fraction) * directions[k, j, d] + fraction * directions[k + 1, j, d]
                _rates(at, here, rates, by_state, by_driving)
                for a in range(_STATES):
                    for c in range(width):
                        value = 0.0
                        for b in range(_STATES):
                            value += by_state[a, b] * column_at[b, c]
                        if c >= _STATES:
                            for j in range(_DRIVING):
                                value += by_driving[a, j] * along[j, c - _STATES]
                        slope[a, c] = value
                weight = step / 6.0 if stage in (0, 3) else step / 3.0
                ahead = 0.5 * step if stage < 2 else step
                for a in range(_STATES):
                    total[a] += weight * rates[a]
                    at[a] = x[a] + ahead * rates[a]
                    for c in range(width):
                        column_total[a, c] += weight * slope[a, c]
                        column_at[a, c] = column[a, c] + ahead * slope[a, c]
            for a in range(_STATES):
                x[a] += total[a]
                for c in range(width):
                    column[a, c] += column_total[a, c]
        copy_row(states[k + 1], x)
        copy_rows(columns[k + 1], column)
    return Path(states, columns)


def observe(states: Array, given: Array, x_arm: float, z_arm: float) -> tuple[Array, Array, Array]:
    """Output equation of ideal instruments: outputs (n, 4), their derivatives by state and by driving input.

    Parameters
    ----------
    states : ndarray, shape (n, 4)
    given : ndarray, shape (n, 7)
    x_arm, z_arm : float
        Position of the angle-of-attack vane from the centre of gravity, m.
    """
    (u, w, theta, h), q, beta = states.T, given[:, GIVEN.index("q")], given[:, GIVEN.index("beta")]
    plane, cos_beta = np.hypot(u, w), np.cos(beta)
    vane_u, vane_w = u + q * z_arm, w - q * x_arm
    square = vane_u**2 + vane_w**2
    outputs = np.column_stack([plane / cos_beta, np.arctan2(vane_w, vane_u), theta, h])
    by_state = np.zeros((u.size, len(OBSERVED), len(STATES)))
    by_driving = np.zeros((u.size, len(OBSERVED), len(DRIVING)))
    by_state[:, OBSERVED.index("V"), STATES.index("u")] = u / plane / cos_beta
    by_state[:, OBSERVED.index("V"), STATES.index("w")] = w / plane / cos_beta
    by_state[:, OBSERVED.index("alpha"), STATES.index("u")] = -vane_w / square
    by_state[:, OBSERVED.index("alpha"), STATES.index("w")] = vane_u / square
    for name in ("theta", "h"):
        by_state[:, OBSERVED.index(name), STATES.index(name)] = 1.0
    by_driving[:, OBSERVED.index("alpha"), DRIVING.index("q")] = (-x_arm * vane_u - z_arm * vane_w) / square
    return outputs, by_state, by_driving
