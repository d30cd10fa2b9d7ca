"""The longitudinal motion as a user writes it down: (33)-(36) of Parameswaran & Raol 1994, compiled by numba.

Shares nothing with aerosid's own flight model. One fourth-order Runge-Kutta step a sample, the elevator linear between
samples; the tool that brings its own integrator takes `rates`.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.rivals.task import CHANNELS, Body

Array = NDArray[np.float64]

GRAVITY = 9.80665
STATES = 5


@numba.njit(cache=True, error_model="numpy")
def specific_forces(x: Array, elevator: float, table: Array, body: Body) -> tuple[float, float, float]:
    """a_x, a_z [m/s^2] and the pitch acceleration [rad/s^2] of a state (5,) with a table of derivatives (3, 10)."""
    square = x[0] * x[0] + x[1] * x[1]
    alpha = math.atan2(x[1], x[0])
    q_hat = x[2] * body.mean_chord / (2.0 * body.reference_speed)
    force = 0.5 * body.density * square * body.wing_area
    c_x = c_z = c_m = 0.0
    terms = (1.0, alpha, q_hat, elevator, alpha * alpha, alpha * q_hat, alpha * elevator, q_hat * q_hat,
             q_hat * elevator, elevator * elevator)  # fmt: skip
    for place in range(10):
        c_x += table[0, place] * terms[place]
        c_z += table[1, place] * terms[place]
        c_m += table[2, place] * terms[place]
    return (force * c_x + body.thrust) / body.mass, force * c_z / body.mass, force * body.mean_chord * c_m / body.I_yy


@numba.njit(cache=True, error_model="numpy")
def rates(x: Array, elevator: float, table: Array, body: Body, out: Array) -> None:
    """Rates of u, w, q, theta, h (5,) into `out`."""
    a_x, a_z, pitch = specific_forces(x, elevator, table, body)
    sin, cos = math.sin(x[3]), math.cos(x[3])
    out[0] = a_x - GRAVITY * sin - x[2] * x[1]
    out[1] = a_z + GRAVITY * cos + x[2] * x[0]
    out[2] = pitch
    out[3] = x[2]
    out[4] = x[0] * sin - x[1] * cos


@numba.njit(cache=True, error_model="numpy")
def advance(x: Array, before: float, after: float, dt: float, table: Array, body: Body) -> Array:
    """The state (5,) one sample later, the elevator [rad] going from `before` to `after`."""
    k1, k2, k3, k4 = np.empty(5), np.empty(5), np.empty(5), np.empty(5)
    middle = 0.5 * (before + after)
    rates(x, before, table, body, k1)
    rates(x + 0.5 * dt * k1, middle, table, body, k2)
    rates(x + 0.5 * dt * k2, middle, table, body, k3)
    rates(x + dt * k3, after, table, body, k4)
    return x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@numba.njit(cache=True, error_model="numpy")
def observe(x: Array, elevator: float, table: Array, body: Body) -> Array:
    """V, alpha, q, theta, a_x, a_z, h (7,) of a state."""
    a_x, a_z, _ = specific_forces(x, elevator, table, body)
    return np.array([math.hypot(x[0], x[1]), math.atan2(x[1], x[0]), x[2], x[3], a_x, a_z, x[4]])


@numba.njit(cache=True, error_model="numpy")
def simulate(start: Array, time: Array, elevator: Array, table: Array, body: Body) -> Array:
    """Outputs (N, 7) of a flight from its initial state (5,), open loop."""
    outputs = np.empty((time.size, 7))
    x = start.copy()
    for k in range(time.size):
        outputs[k] = observe(x, elevator[k], table, body)
        if k + 1 < time.size:
            x = advance(x, elevator[k], elevator[k + 1], time[k + 1] - time[k], table, body)
    return outputs


assert len(CHANNELS) == 7
