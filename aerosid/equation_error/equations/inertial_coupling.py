"""Inertial coupling, lever arms of sensors and a displaced centre of gravity in the accelerations, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.equation_error.equations.term_series import MASS, PITCH, ROLL, YAW, Body, MotionSeries, X, Y, Z

Array = NDArray[np.float64]


class Aircraft(NamedTuple):
    """The aircraft as it acts, as it is declared, and the positions of its accelerometers.

    `modelled`, bool[6]: which of the body-axis coefficients have an equation. `positions`, float64[3, 3]: of the
    accelerometers along x, y, z, m from the declared centre of gravity; zero of those that are not recorded. `further`,
    float64[3, 3]: position errors by effects, m.
    """

    acting: Body
    declared: Body
    modelled: NDArray[np.bool_]
    positions: Array
    further: Array


@njit_inline
def _lever(
    index: int, x: float, y: float, z: float, p: float, q: float, r: float, turning: tuple[float, float, float]
) -> float:
    """Acceleration of an accelerometer at (x, y, z), m, relative to one at the centre of gravity, m/s^2.

    `turning`: the angular accelerations.
    """
    p_dot, q_dot, r_dot = turning
    if index == X:
        return -(q * q + r * r) * x + (p * q - r_dot) * y + (q_dot + p * r) * z
    if index == Y:
        return (r_dot + p * q) * x - (p * p + r * r) * y + (q * r - p_dot) * z
    return (p * r - q_dot) * x + (q * r + p_dot) * y - (p * p + q * q) * z


@njit
def levers(
    index: int, x: float, y: float, z: float, p: Array, q: Array, r: Array, p_dot: Array, q_dot: Array, r_dot: Array
) -> Array:
    """Acceleration of the accelerometer along an axis relative to one at the centre of gravity, (N,) m/s^2."""
    found = np.empty(p.shape[0])
    for n in range(p.shape[0]):
        found[n] = _lever(index, x, y, z, p[n], q[n], r[n], (p_dot[n], q_dot[n], r_dot[n]))
    return found


@njit_inline
def add_thrust_and_arms(course: MotionSeries, thrust: Array, inputs: Array, aircraft: Aircraft, known: Array) -> None:
    """Forces that are no terms: thrust, and the declared lever arms of the accelerometers by the rates as measured."""
    ahead, below = np.cos(aircraft.acting.thrust_incidence), -np.sin(aircraft.acting.thrust_incidence)
    if aircraft.modelled[X]:
        for n in range(thrust.shape[0]):
            pushed = thrust[n] / inputs[n, MASS]
            known[X, n] += pushed * ahead
            known[Z, n] += pushed * below
    for index in range(3):
        x, y, z = aircraft.positions[index, 0], aircraft.positions[index, 1], aircraft.positions[index, 2]
        if aircraft.modelled[index] and (x != 0.0 or y != 0.0 or z != 0.0):
            for n in range(thrust.shape[0]):
                p, q, r = course.p[n], course.q[n], course.r[n]
                turning = course.p_dot[n], course.q_dot[n], course.r_dot[n]
                known[index, n] += _lever(index, x, y, z, p, q, r, turning)


@njit_inline
def add_moments(
    course: MotionSeries,
    thrust: Array,
    c: Body,
    modelled: NDArray[np.bool_],
    sign: float,
    p_dot: Array,
    r_dot: Array,
    known: Array,
) -> None:
    """Add angular accelerations that are no terms, times `sign`: by thrust and by inertial coupling."""
    samples = thrust.shape[0]
    if modelled[PITCH]:
        share = sign / c.I_yy
        for n in range(samples):
            p, r = course.p[n], course.r[n]
            M = thrust[n] * c.thrust_z_arm - (c.I_xx - c.I_zz) * p * r - c.I_xz * (p * p - r * r)
            known[PITCH, n] += share * M
    if modelled[ROLL]:
        share = sign / c.I_xx
        for n in range(samples):
            p, q, r = course.p[n], course.q[n], course.r[n]
            known[ROLL, n] += share * (c.I_xz * (r_dot[n] + p * q) - (c.I_zz - c.I_yy) * q * r)
    if modelled[YAW]:
        share = sign / c.I_zz
        for n in range(samples):
            p, q, r = course.p[n], course.q[n], course.r[n]
            known[YAW, n] += share * (c.I_xz * (p_dot[n] - q * r) - (c.I_yy - c.I_xx) * p * q)


@njit_inline
def _centre_at(inputs: Array, n: int, body: Body) -> tuple[float, float, float]:
    """Position of the centre of gravity ahead of, right of and below the declared one at a sample, m."""
    ahead = inputs[n, body.cg_x] if body.cg_x >= 0 else 0.0
    right = inputs[n, body.cg_y] if body.cg_y >= 0 else 0.0
    below = inputs[n, body.cg_z] if body.cg_z >= 0 else 0.0
    return ahead, right, below


@njit_inline
def is_moved(inputs: Array, body: Body) -> bool:
    """Whether the centre of gravity differs from the declared one at any time."""
    if body.cg_x < 0 and body.cg_y < 0 and body.cg_z < 0:
        return False
    for n in range(inputs.shape[0]):
        ahead, right, below = _centre_at(inputs, n, body)
        if ahead != 0.0 or right != 0.0 or below != 0.0:
            return True
    return False


@njit_inline
def add_levers(inputs: Array, aircraft: Aircraft, forces: Array, known: Array) -> None:
    """Add the moments of modelled forces, m/s^2, about a displaced centre of gravity."""
    c, modelled = aircraft.acting, aircraft.modelled
    for n in range(inputs.shape[0]):
        ahead, right, below = _centre_at(inputs, n, c)
        ahead_force, side_force, down_force = forces[X, n], forces[Y, n], forces[Z, n]
        mass = inputs[n, MASS]
        if modelled[PITCH]:
            known[PITCH, n] += mass * (ahead * down_force - below * ahead_force) / c.I_yy
        if modelled[ROLL] and modelled[Z]:
            known[ROLL, n] += mass * (below * side_force - right * down_force) / c.I_xx
        if modelled[YAW] and modelled[X]:
            known[YAW, n] += mass * (right * ahead_force - ahead * side_force) / c.I_zz


@njit_inline
def add_further_arms(course: MotionSeries, inputs: Array, aircraft: Aircraft, turning: Array, known: Array) -> None:
    """Add the accelerations at further lever arms: of sensor position errors and of a displaced centre of gravity.

    By the model's angular accelerations, rows 3 to 5 of `turning`: the measured ones respond to the gusts to which the
    forces respond, and an arm would be found where there is none. Sensors keep their places in the aircraft when the
    centre of gravity moves.
    """
    for index in range(3):
        if not aircraft.modelled[index]:
            continue
        further = aircraft.further[index]
        for n in range(inputs.shape[0]):
            ahead, right, below = _centre_at(inputs, n, aircraft.acting)
            x, y, z = further[0] - ahead, further[1] - right, further[2] - below
            about = turning[ROLL, n], turning[PITCH, n], turning[YAW, n]
            known[index, n] += _lever(index, x, y, z, course.p[n], course.q[n], course.r[n], about)


@njit_inline
def are_others(acting: Body, declared: Body) -> bool:
    """Whether effects change the inertia or the thrust arm."""
    return not (
        acting.I_xx == declared.I_xx
        and acting.I_yy == declared.I_yy
        and acting.I_zz == declared.I_zz
        and acting.I_xz == declared.I_xz
        and acting.thrust_z_arm == declared.thrust_z_arm
    )
