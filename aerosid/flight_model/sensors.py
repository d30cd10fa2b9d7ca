"""Sensors: what vanes, gyros, accelerometers and attitude references see at their positions, with the Jacobian."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.flight_model.air import Air, AirSlopes, Motion
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.layout import Layout, output_places, state_places
from aerosid.flight_model.loads import Centre, Forces
from aerosid.flight_model.workspace import Workspace


class Turning(NamedTuple):
    """Angular accelerations [rad/s^2]; zero where the rate is measured."""

    p: float
    q: float
    r: float


@njit_inline
def _turning(rates: NDArray[np.float64], layout: Layout) -> Turning:
    there, at = layout.motion, state_places(layout)
    p_dot, q_dot, r_dot = 0.0, 0.0, 0.0
    if len(there.p) > 0:
        p_dot = rates[at.p]
    if len(there.q) > 0:
        q_dot = rates[at.q]
    if len(there.r) > 0:
        r_dot = rates[at.r]
    return Turning(p_dot, q_dot, r_dot)


@njit_inline
def _arm(positions: NDArray[np.float64], row: int, centre: Centre) -> tuple[float, float, float]:
    """Where a sensor sits, from the centre of gravity [m]."""
    return positions[row, 0] - centre.ahead, positions[row, 1] - centre.right, positions[row, 2] - centre.below


@njit_inline
def sense(
    x: NDArray[np.float64],
    motion: Motion,
    air: Air,
    forces: Forces,
    centre: Centre,
    positions: NDArray[np.float64],
    constants: Constants,
    work: Workspace,
) -> None:
    """Write what the sensors see: `work.outputs` from states, specific forces and `work.rates`.

    Notes
    -----
    The vanes turn with the flow at their own places, alpha by the velocity there, beta by (x r - z p)/V. Specific force
    at r is f + omega' x r + omega x (omega x r).
    """
    layout = constants.layout
    there, at, row = layout.outputs, state_places(layout), output_places(layout)
    y, p, q, r = work.outputs, motion.p, motion.q, motion.r
    turning = _turning(work.rates, layout)
    if len(there.V) > 0:
        y[row.V] = air.speed
    if len(there.alpha) > 0:
        ahead, right, below = _arm(positions, row.alpha, centre)
        y[row.alpha] = np.arctan2(motion.w + p * right - q * ahead, motion.u + q * below - r * right)
    if len(there.beta) > 0:
        ahead, right, below = _arm(positions, row.beta, centre)
        y[row.beta] = air.beta + (ahead * r - below * p) / air.speed
    if len(there.p) > 0:
        y[row.p] = p
    if len(there.q) > 0:
        y[row.q] = q
    if len(there.r) > 0:
        y[row.r] = r
    if len(there.phi) > 0:
        y[row.phi] = x[at.phi]
    if len(there.theta) > 0:
        y[row.theta] = x[at.theta]
    if len(there.psi) > 0:
        y[row.psi] = x[at.psi]
    if len(there.a_x) > 0:
        ahead, right, below = _arm(positions, row.a_x, centre)
        y[row.a_x] = forces.a_x - (q * q + r * r) * ahead + (p * q - turning.r) * right + (p * r + turning.q) * below
    if len(there.a_y) > 0:
        ahead, right, below = _arm(positions, row.a_y, centre)
        y[row.a_y] = forces.a_y + (p * q + turning.r) * ahead - (p * p + r * r) * right + (q * r - turning.p) * below
    if len(there.a_z) > 0:
        ahead, right, below = _arm(positions, row.a_z, centre)
        y[row.a_z] = forces.a_z + (p * r - turning.q) * ahead + (q * r + turning.p) * right - (p * p + q * q) * below
    if len(there.p_dot) > 0:
        y[row.p_dot] = turning.p
    if len(there.q_dot) > 0:
        y[row.q_dot] = turning.q
    if len(there.r_dot) > 0:
        y[row.r_dot] = turning.r
    if len(there.h) > 0:
        y[row.h] = x[at.h]


@njit_inline
def sense_slopes(
    motion: Motion,
    air: Air,
    slopes: AirSlopes,
    centre: Centre,
    positions: NDArray[np.float64],
    constants: Constants,
    work: Workspace,
) -> None:
    """Write the Jacobian of `sense` by states, extra inputs and terms: `work.outputs_x`, `outputs_u`, `outputs_p`."""
    layout = constants.layout
    there, at, row = layout.outputs, state_places(layout), output_places(layout)
    y_x = work.outputs_x
    if len(there.V) > 0:
        _place_velocity(y_x, row.V, slopes.V_u, slopes.V_v, slopes.V_w, layout)
    if len(there.alpha) > 0:
        _alpha_slopes(motion, centre, positions, constants, work)
    if len(there.beta) > 0:
        _beta_slopes(motion, air, slopes, centre, positions, constants, work)
    if len(there.a_x) > 0:
        _x_slopes(motion, centre, positions, constants, work)
    if len(there.a_y) > 0:
        _y_slopes(motion, centre, positions, constants, work)
    if len(there.a_z) > 0:
        _z_slopes(motion, centre, positions, constants, work)
    if len(there.p_dot) > 0:
        _copy_rate(at.p, row.p_dot, work, layout)
    if len(there.q_dot) > 0:
        _copy_rate(at.q, row.q_dot, work, layout)
    if len(there.r_dot) > 0:
        _copy_rate(at.r, row.r_dot, work, layout)
    if constants.gust >= 0 and len(layout.motion.w) > 0:
        _gust(constants.gust, at.w, work, layout)
    if constants.side_gust >= 0 and len(layout.motion.v) > 0:
        _gust(constants.side_gust, at.v, work, layout)


@njit_inline
def _place_velocity(out: NDArray[np.float64], row: int, by_u: float, by_v: float, by_w: float, layout: Layout) -> None:
    """Write slopes by those velocity components that are states."""
    there, at = layout.motion, state_places(layout)
    if len(there.u) > 0:
        out[row, at.u], out[row, at.w] = by_u, by_w
    if len(there.v) > 0:
        out[row, at.v] = by_v


@njit_inline
def _alpha_slopes(
    motion: Motion, centre: Centre, positions: NDArray[np.float64], constants: Constants, work: Workspace
) -> None:
    layout = constants.layout
    there, at, row = layout.motion, state_places(layout), output_places(layout).alpha
    ahead, right, below = _arm(positions, row, centre)
    forward = motion.u + motion.q * below - motion.r * right
    down = motion.w + motion.p * right - motion.q * ahead
    square = forward * forward + down * down
    by_forward, by_down = -down / square, forward / square
    y_x, y_u = work.outputs_x, work.outputs_u
    y_x[row, at.u], y_x[row, at.w] = by_forward, by_down
    if len(there.p) > 0:
        y_x[row, at.p] = right * by_down
    if len(there.q) > 0:
        y_x[row, at.q] = below * by_forward - ahead * by_down
    if len(there.r) > 0:
        y_x[row, at.r] = -right * by_forward
    if constants.cg_x >= 0:
        y_u[row, constants.cg_x] = motion.q * by_down
    if constants.cg_y >= 0:
        y_u[row, constants.cg_y] = motion.r * by_forward - motion.p * by_down
    if constants.cg_z >= 0:
        y_u[row, constants.cg_z] = -motion.q * by_forward


@njit_inline
def _beta_slopes(
    motion: Motion,
    air: Air,
    slopes: AirSlopes,
    centre: Centre,
    positions: NDArray[np.float64],
    constants: Constants,
    work: Workspace,
) -> None:
    layout = constants.layout
    there, at, row = layout.motion, state_places(layout), output_places(layout).beta
    ahead, _, below = _arm(positions, row, centre)
    slower = -(ahead * motion.r - below * motion.p) / (air.speed * air.speed)
    by_u, by_v = slopes.beta_u + slower * slopes.V_u, slopes.beta_v + slower * slopes.V_v
    _place_velocity(work.outputs_x, row, by_u, by_v, slopes.beta_w + slower * slopes.V_w, layout)
    if len(there.p) > 0:
        work.outputs_x[row, at.p] = -below / air.speed
    if len(there.r) > 0:
        work.outputs_x[row, at.r] = ahead / air.speed
    if constants.cg_x >= 0:
        work.outputs_u[row, constants.cg_x] = -motion.r / air.speed
    if constants.cg_z >= 0:
        work.outputs_u[row, constants.cg_z] = motion.p / air.speed


@njit_inline
def _x_slopes(
    motion: Motion, centre: Centre, positions: NDArray[np.float64], constants: Constants, work: Workspace
) -> None:
    layout = constants.layout
    there, at, row = layout.motion, state_places(layout), output_places(layout).a_x
    ahead, right, below = _arm(positions, row, centre)
    _force_slopes(at.u, row, 0.0, below, -right, work, layout)
    p, q, r = motion.p, motion.q, motion.r
    if len(there.p) > 0:
        work.outputs_x[row, at.p] += q * right + r * below
    if len(there.q) > 0:
        work.outputs_x[row, at.q] += p * right - 2.0 * q * ahead
    if len(there.r) > 0:
        work.outputs_x[row, at.r] += p * below - 2.0 * r * ahead
    turning = _turning(work.rates, layout)
    _arm_slopes(row, q * q + r * r, turning.r - p * q, -turning.q - p * r, constants, work)


@njit_inline
def _y_slopes(
    motion: Motion, centre: Centre, positions: NDArray[np.float64], constants: Constants, work: Workspace
) -> None:
    layout = constants.layout
    there, at, row = layout.motion, state_places(layout), output_places(layout).a_y
    ahead, right, below = _arm(positions, row, centre)
    _force_slopes(at.v, row, -below, 0.0, ahead, work, layout)
    p, q, r = motion.p, motion.q, motion.r
    if len(there.p) > 0:
        work.outputs_x[row, at.p] += q * ahead - 2.0 * p * right
    if len(there.q) > 0:
        work.outputs_x[row, at.q] += p * ahead + r * below
    if len(there.r) > 0:
        work.outputs_x[row, at.r] += q * below - 2.0 * r * right
    turning = _turning(work.rates, layout)
    _arm_slopes(row, -turning.r - p * q, p * p + r * r, turning.p - q * r, constants, work)


@njit_inline
def _z_slopes(
    motion: Motion, centre: Centre, positions: NDArray[np.float64], constants: Constants, work: Workspace
) -> None:
    layout = constants.layout
    there, at, row = layout.motion, state_places(layout), output_places(layout).a_z
    ahead, right, below = _arm(positions, row, centre)
    _force_slopes(at.w, row, right, -ahead, 0.0, work, layout)
    p, q, r = motion.p, motion.q, motion.r
    if len(there.p) > 0:
        work.outputs_x[row, at.p] += r * ahead - 2.0 * p * below
    if len(there.q) > 0:
        work.outputs_x[row, at.q] += r * right - 2.0 * q * below
    if len(there.r) > 0:
        work.outputs_x[row, at.r] += p * ahead + q * right
    turning = _turning(work.rates, layout)
    _arm_slopes(row, turning.q - p * r, -turning.p - q * r, p * p + q * q, constants, work)


@njit_inline
def _force_slopes(
    force: int, row: int, by_p_dot: float, by_q_dot: float, by_r_dot: float, work: Workspace, layout: Layout
) -> None:
    """Write the slopes of a specific force, and add those of the angular accelerations times their arms."""
    f_x, f_u, f_p, inertial_x = work.rates_x, work.rates_u, work.rates_p, work.inertial_x
    y_x, y_u, y_p = work.outputs_x, work.outputs_u, work.outputs_p
    for k in range(state_places(layout).total):
        y_x[row, k] = _with_turning(f_x[force, k] - inertial_x[force, k], f_x, k, by_p_dot, by_q_dot, by_r_dot, layout)
    for j in range(f_u.shape[1]):
        y_u[row, j] = _with_turning(f_u[force, j], f_u, j, by_p_dot, by_q_dot, by_r_dot, layout)
    for t in range(f_p.shape[1]):
        y_p[row, t] = _with_turning(f_p[force, t], f_p, t, by_p_dot, by_q_dot, by_r_dot, layout)


@njit_inline
def _with_turning(
    slope: float,
    rates: NDArray[np.float64],
    column: int,
    by_p_dot: float,
    by_q_dot: float,
    by_r_dot: float,
    layout: Layout,
) -> float:
    """A slope of a specific force with those of the angular accelerations, in that column of `rates`, times their arms.

    A case integrates roll and yaw together.
    """
    there, at = layout.motion, state_places(layout)
    if len(there.p) > 0:
        slope += rates[at.p, column] * by_p_dot + rates[at.r, column] * by_r_dot
    if len(there.q) > 0:
        slope += rates[at.q, column] * by_q_dot
    return slope


@njit_inline
def _arm_slopes(
    row: int, by_ahead: float, by_right: float, by_below: float, constants: Constants, work: Workspace
) -> None:
    """Add the slopes by the position of the centre of gravity."""
    if constants.cg_x >= 0:
        work.outputs_u[row, constants.cg_x] += by_ahead
    if constants.cg_y >= 0:
        work.outputs_u[row, constants.cg_y] += by_right
    if constants.cg_z >= 0:
        work.outputs_u[row, constants.cg_z] += by_below


@njit_inline
def _copy_rate(state: int, row: int, work: Workspace, layout: Layout) -> None:
    """Write the slopes of an angular acceleration."""
    for k in range(state_places(layout).total):
        work.outputs_x[row, k] = work.rates_x[state, k]
    for j in range(work.rates_u.shape[1]):
        work.outputs_u[row, j] = work.rates_u[state, j]
    for t in range(work.rates_p.shape[1]):
        work.outputs_p[row, t] = work.rates_p[state, t]


@njit_inline
def _gust(column: int, state: int, work: Workspace, layout: Layout) -> None:
    """Air that moves with an axis acts on the air data as if the aircraft moved against it."""
    there, row = layout.outputs, output_places(layout)
    if len(there.V) > 0:
        work.outputs_u[row.V, column] = -work.outputs_x[row.V, state]
    if len(there.alpha) > 0:
        work.outputs_u[row.alpha, column] = -work.outputs_x[row.alpha, state]
    if len(there.beta) > 0:
        work.outputs_u[row.beta, column] = -work.outputs_x[row.beta, state]
