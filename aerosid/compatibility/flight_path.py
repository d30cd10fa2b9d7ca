"""Flight-path reconstruction: integration of measured accelerations and rates, with sensitivities.

States are u, w, q, theta, h in the places of `longitudinal.STATES`; the pitch rate is a measured input here and its
place stays empty.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.flight_model.constants import GRAVITY

DRIVING = ("a_x", "a_z", "q")
"""The measured inputs that drive the path, specific force at the centre of gravity [m/s^2] and pitch rate [rad/s]."""

LONGEST_STEP = 0.1
"""s; a fourth-order step this long is exact to 1e-7 at half a radian per second."""

Array = NDArray[np.float64]


class PathTrace(NamedTuple):
    """A path and its derivatives: D directions of the driving inputs.

    `states` (n, 5); `columns` (n, 5, 5 + D) with respect to the initial state and along the directions;
    `transition` (n, 5, 5), `start` and `end` (n, 5, 3) from each sample to the next, with respect to the state and the
    driving inputs at both its ends.
    """

    states: Array
    columns: Array
    transition: Array
    start: Array
    end: Array


@njit
def _rates(x: Array, u: Array, rates: Array, by_state: Array, by_input: Array) -> None:
    """Rates of the path (5) and their partial derivatives with respect to the states and a_x, a_z, q."""
    a_x, a_z, q, p, r, phi, beta = u[0], u[1], u[2], u[3], u[4], u[5], u[6]
    u_b, w_b = x[0], x[1]
    sin_pitch, cos_pitch = np.sin(x[3]), np.cos(x[3])
    sin_phi, cos_phi = np.sin(phi), np.cos(phi)
    tan_beta = np.tan(beta)
    plane = np.sqrt(u_b * u_b + w_b * w_b)
    v_b, v_u, v_w = plane * tan_beta, u_b / plane * tan_beta, w_b / plane * tan_beta
    rates[0] = a_x - GRAVITY * sin_pitch - q * w_b + r * v_b
    rates[1] = a_z + GRAVITY * cos_pitch * cos_phi + q * u_b - p * v_b
    rates[2] = 0.0
    rates[3] = q * cos_phi - r * sin_phi
    rates[4] = u_b * sin_pitch - v_b * sin_phi * cos_pitch - w_b * cos_phi * cos_pitch
    by_state[0, 0], by_state[0, 1], by_state[0, 3] = r * v_u, -q + r * v_w, -GRAVITY * cos_pitch
    by_state[1, 0], by_state[1, 1], by_state[1, 3] = q - p * v_u, -p * v_w, -GRAVITY * sin_pitch * cos_phi
    by_state[4, 0] = sin_pitch - v_u * sin_phi * cos_pitch
    by_state[4, 1] = -v_w * sin_phi * cos_pitch - cos_phi * cos_pitch
    by_state[4, 3] = u_b * cos_pitch + v_b * sin_phi * sin_pitch + w_b * cos_phi * sin_pitch
    by_input[0, 0], by_input[0, 2] = 1.0, -w_b
    by_input[1, 1], by_input[1, 2] = 1.0, u_b
    by_input[3, 2] = cos_phi


@njit
def trace_path(time: Array, inputs: Array, initial: Array, directions: Array) -> PathTrace:
    """The path from an initial state, with its derivatives.

    Parameters
    ----------
    time : (n,) s.
    inputs : (n, 7) a_x, a_z [m/s^2], q, p, r [rad/s], phi, beta [rad]; linear between samples.
    initial : (5,) u, w [m/s], nothing, theta [rad], h [m].
    directions : (n, 3, D) changes of a_x, a_z, q whose effect is wanted.

    Notes
    -----
    u' = a_x - g sin(theta) - q w + r v, w' = a_z + g cos(theta) cos(phi) + q u - p v,
    theta' = q cos(phi) - r sin(phi), h' = u sin(theta) - v sin(phi) cos(theta) - w cos(phi) cos(theta), with
    v = sqrt(u^2 + w^2) tan(beta), by Runge and Kutta's fourth-order step; the derivatives are those of the discrete
    solution. Jategaonkar, Flight Vehicle System Identification, 2nd ed., section 10.3.
    """
    samples, width = time.shape[0], directions.shape[2]
    states = np.zeros((samples, 5))
    columns = np.zeros((samples, 5, 5 + width))
    transition = np.zeros((samples, 5, 5))
    start, end = np.zeros((samples, 5, 3)), np.zeros((samples, 5, 3))
    x, at, rates = initial.copy(), np.zeros(5), np.zeros(5)
    by_state, by_input, u = np.zeros((5, 5)), np.zeros((5, 3)), np.zeros(7)
    moved, moved_at, moved_sum, slope = np.zeros((5, 11)), np.zeros((5, 11)), np.zeros((5, 11)), np.zeros((5, 11))
    total, column = np.zeros(5), np.zeros((5, 5 + width))
    for a in range(5):
        column[a, a] = 1.0
    for k in range(samples):
        states[k] = x
        columns[k] = column
        if k + 1 == samples:
            break
        interval = time[k + 1] - time[k]
        pieces = max(1, int(np.ceil(interval / LONGEST_STEP - 1e-9)))
        step = interval / pieces
        moved[:, :] = 0.0
        for a in range(5):
            moved[a, a] = 1.0
        for piece in range(pieces):
            total[:] = 0.0
            moved_sum[:, :] = 0.0
            at[:] = x
            moved_at[:, :] = moved
            for stage in range(4):
                within = 0.0 if stage == 0 else (0.5 if stage < 3 else 1.0)
                share = (piece + within) / pieces
                for j in range(7):
                    u[j] = (1.0 - share) * inputs[k, j] + share * inputs[k + 1, j]
                _rates(at, u, rates, by_state, by_input)
                for a in range(5):
                    for c in range(11):
                        value = 0.0
                        for b in range(5):
                            value += by_state[a, b] * moved_at[b, c]
                        slope[a, c] = value
                    for j in range(3):
                        slope[a, 5 + j] += (1.0 - share) * by_input[a, j]
                        slope[a, 8 + j] += share * by_input[a, j]
                weight = 1.0 if stage in (0, 3) else 2.0
                ahead = 0.5 * step if stage < 2 else step
                for a in range(5):
                    total[a] += weight * rates[a]
                    at[a] = x[a] + ahead * rates[a]
                    for c in range(11):
                        moved_sum[a, c] += weight * slope[a, c]
                        moved_at[a, c] = moved[a, c] + ahead * slope[a, c]
            for a in range(5):
                x[a] += step / 6.0 * total[a]
                for c in range(11):
                    moved[a, c] += step / 6.0 * moved_sum[a, c]
        transition[k] = moved[:, :5]
        start[k] = moved[:, 5:8]
        end[k] = moved[:, 8:11]
        for c in range(5 + width):
            for a in range(5):
                value = 0.0
                for b in range(5):
                    value += moved[a, b] * columns[k, b, c]
                if c >= 5:
                    for j in range(3):
                        value += moved[a, 5 + j] * directions[k, j, c - 5]
                        value += moved[a, 8 + j] * directions[k + 1, j, c - 5]
                column[a, c] = value
    return PathTrace(states, columns, transition, start, end)
