"""Newton's and Euler's equations of a rigid body over a flat earth, and their Jacobian."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.flight_model.air import AirSlopes, Motion
from aerosid.flight_model.constants import GRAVITY, Constants
from aerosid.flight_model.layout import Layout, input_places, state_places
from aerosid.flight_model.loads import Centre, Forces


class Inertia(NamedTuple):
    """Inverse of the inertia tensor [1/(kg m^2)]: roll by roll, roll by yaw and yaw by yaw moment, and pitch."""

    pp: float
    pr: float
    rr: float
    qq: float


class Inertial(NamedTuple):
    """Accelerations of gravity and rotating axes [m/s^2]."""

    u: float
    v: float
    w: float


@njit_inline
def inverse_inertia(constants: Constants) -> Inertia:
    """The inverse of the inertia tensor with I_xz; roll and yaw are zero where they are not integrated."""
    pp, pr, rr, qq = 0.0, 0.0, 0.0, 0.0
    if len(constants.layout.motion.p) > 0:
        scale = 1.0 / (constants.I_xx * constants.I_zz - constants.I_xz * constants.I_xz)
        pp, pr, rr = constants.I_zz * scale, constants.I_xz * scale, constants.I_xx * scale
    if len(constants.layout.motion.q) > 0:
        qq = 1.0 / constants.I_yy
    return Inertia(pp, pr, rr, qq)


@njit_inline
def inertial_accelerations(motion: Motion) -> Inertial:
    """Gravity and the rotation of the axes, in body axes."""
    return Inertial(
        -GRAVITY * motion.sin_theta + motion.r * motion.v - motion.q * motion.w,
        GRAVITY * motion.sin_phi * motion.cos_theta + motion.p * motion.w - motion.r * motion.u,
        GRAVITY * motion.cos_theta * motion.cos_phi + motion.q * motion.u - motion.p * motion.v,
    )


@njit_inline
def about_centre(forces: Forces, centre: Centre, mass: float) -> Forces:
    """The same forces with their moments about the centre of gravity: less the centre's arm times the force."""
    if not centre.shifted:
        return forces
    return Forces(
        forces.a_x,
        forces.a_y,
        forces.a_z,
        forces.L + mass * (forces.a_y * centre.below - forces.a_z * centre.right),
        forces.M + mass * (forces.a_z * centre.ahead - forces.a_x * centre.below),
        forces.N + mass * (forces.a_x * centre.right - forces.a_y * centre.ahead),
    )


@njit_inline
def newton(
    motion: Motion,
    inertial: Inertial,
    forces: Forces,
    inertia: Inertia,
    constants: Constants,
    rates: NDArray[np.float64],
) -> None:
    """Write the rates of the states (n,) from specific forces and moments about the centre of gravity.

    Notes
    -----
    L = I_xx p' - I_xz (r' + p q) + (I_zz - I_yy) q r, M = I_yy q' + (I_xx - I_zz) p r + I_xz (p^2 - r^2) and
    N = I_zz r' - I_xz (p' - q r) + (I_yy - I_xx) p q.
    """
    there, at = constants.layout.motion, state_places(constants.layout)
    p, q, r = motion.p, motion.q, motion.r
    if len(there.u) > 0:
        rates[at.u] = forces.a_x + inertial.u
    if len(there.v) > 0:
        rates[at.v] = forces.a_y + inertial.v
    if len(there.w) > 0:
        rates[at.w] = forces.a_z + inertial.w
    if len(there.p) > 0:
        roll = forces.L + constants.I_xz * p * q - (constants.I_zz - constants.I_yy) * q * r
        yaw = forces.N - constants.I_xz * q * r - (constants.I_yy - constants.I_xx) * p * q
        rates[at.p] = inertia.pp * roll + inertia.pr * yaw
        rates[at.r] = inertia.pr * roll + inertia.rr * yaw
    if len(there.q) > 0:
        rates[at.q] = inertia.qq * (
            forces.M - (constants.I_xx - constants.I_zz) * p * r - constants.I_xz * (p * p - r * r)
        )
    turn = q * motion.sin_phi + r * motion.cos_phi
    if len(there.phi) > 0:
        rates[at.phi] = p + turn * motion.sin_theta / motion.cos_theta
    if len(there.theta) > 0:
        rates[at.theta] = q * motion.cos_phi - r * motion.sin_phi
    if len(there.h) > 0:
        level = motion.v * motion.sin_phi + motion.w * motion.cos_phi
        rates[at.h] = motion.u * motion.sin_theta - level * motion.cos_theta
    if len(there.psi) > 0:
        rates[at.psi] = turn / motion.cos_theta


@njit_inline
def accelerate(
    forces: Forces,
    centre: Centre,
    mass: float,
    inertia: Inertia,
    layout: Layout,
    column: NDArray[np.float64],
    place: int,
) -> None:
    """Write what forces and moments make of the moving states, a column of (n, M): the linear part of `newton`."""
    there, at = layout.motion, state_places(layout)
    total = about_centre(forces, centre, mass)
    if len(there.u) > 0:
        column[at.u, place] = total.a_x
    if len(there.v) > 0:
        column[at.v, place] = total.a_y
    if len(there.w) > 0:
        column[at.w, place] = total.a_z
    if len(there.p) > 0:
        column[at.p, place] = inertia.pp * total.L + inertia.pr * total.N
        column[at.r, place] = inertia.pr * total.L + inertia.rr * total.N
    if len(there.q) > 0:
        column[at.q, place] = inertia.qq * total.M


@njit_inline
def rates_per_unit(force: float, u: NDArray[np.float64], constants: Constants, out: NDArray[np.float64]) -> None:
    """Write the rate of each moving state that a unit of its own coefficient makes, about the declared centre.

    Parameters
    ----------
    force : float
        Dynamic pressure times wing area, N.
    u : float64[I]
        Inputs.
    """
    layout = constants.layout
    there, at = layout.motion, state_places(layout)
    mass, inertia = u[input_places(layout).mass], inverse_inertia(constants)
    if len(there.u) > 0:
        out[at.u] = force / mass
    if len(there.v) > 0:
        out[at.v] = force / mass
    if len(there.w) > 0:
        out[at.w] = force / mass
    if len(there.p) > 0:
        out[at.p] = force * constants.span * inertia.pp
        out[at.r] = force * constants.span * inertia.rr
    if len(there.q) > 0:
        out[at.q] = force * constants.mean_chord * inertia.qq


@njit_inline
def _by_velocity(
    row: int, by_u: float, by_v: float, by_w: float, slopes: AirSlopes, layout: Layout, out: NDArray[np.float64]
) -> None:
    """Write slopes by the velocity into those states of a row that are integrated."""
    there, at = layout.motion, state_places(layout)
    if len(there.u) > 0:
        if len(there.v) > 0:
            out[row, at.u], out[row, at.v], out[row, at.w] = by_u, by_v, by_w
        else:
            out[row, at.u], out[row, at.w] = by_u + by_v * slopes.v_u, by_w + by_v * slopes.v_w
    else:
        out[row, at.v] = by_v + by_u * slopes.u_v + by_w * slopes.w_v


@njit_inline
def inertial_slopes(
    motion: Motion, slopes: AirSlopes, inertia: Inertia, constants: Constants, out: NDArray[np.float64]
) -> None:
    """Write the moving rows (n, n) of the Jacobian of what `newton` adds to forces and moments."""
    layout = constants.layout
    there, at = layout.motion, state_places(layout)
    u, v, w, p, q, r = motion.u, motion.v, motion.w, motion.p, motion.q, motion.r
    sin_phi, cos_phi = motion.sin_phi, motion.cos_phi
    sin_theta, cos_theta = motion.sin_theta, motion.cos_theta
    if len(there.u) > 0:
        _by_velocity(at.u, 0.0, r, -q, slopes, layout, out)
        if len(there.q) > 0:
            out[at.u, at.q] = -w
        if len(there.r) > 0:
            out[at.u, at.r] = v
        if len(there.theta) > 0:
            out[at.u, at.theta] = -GRAVITY * cos_theta
    if len(there.v) > 0:
        _by_velocity(at.v, -r, 0.0, p, slopes, layout, out)
        if len(there.p) > 0:
            out[at.v, at.p] = w
        if len(there.r) > 0:
            out[at.v, at.r] = -u
        if len(there.phi) > 0:
            out[at.v, at.phi] = GRAVITY * cos_phi * cos_theta
        if len(there.theta) > 0:
            out[at.v, at.theta] = -GRAVITY * sin_phi * sin_theta
    if len(there.w) > 0:
        _by_velocity(at.w, q, -p, 0.0, slopes, layout, out)
        if len(there.p) > 0:
            out[at.w, at.p] = -v
        if len(there.q) > 0:
            out[at.w, at.q] = u
        if len(there.phi) > 0:
            out[at.w, at.phi] = -GRAVITY * cos_theta * sin_phi
        if len(there.theta) > 0:
            out[at.w, at.theta] = -GRAVITY * sin_theta * cos_phi
    if len(there.p) > 0:
        across, coupled = constants.I_zz - constants.I_yy, constants.I_yy - constants.I_xx
        roll_p, yaw_p = constants.I_xz * q, -coupled * q
        roll_r, yaw_r = -across * q, -constants.I_xz * q
        out[at.p, at.p] = inertia.pp * roll_p + inertia.pr * yaw_p
        out[at.r, at.p] = inertia.pr * roll_p + inertia.rr * yaw_p
        out[at.p, at.r] = inertia.pp * roll_r + inertia.pr * yaw_r
        out[at.r, at.r] = inertia.pr * roll_r + inertia.rr * yaw_r
        if len(there.q) > 0:
            roll_q, yaw_q = constants.I_xz * p - across * r, -constants.I_xz * r - coupled * p
            out[at.p, at.q] = inertia.pp * roll_q + inertia.pr * yaw_q
            out[at.r, at.q] = inertia.pr * roll_q + inertia.rr * yaw_q
            along = constants.I_xx - constants.I_zz
            out[at.q, at.p] = inertia.qq * (-along * r - 2.0 * constants.I_xz * p)
            out[at.q, at.r] = inertia.qq * (-along * p + 2.0 * constants.I_xz * r)


@njit_inline
def attitude_slopes(motion: Motion, slopes: AirSlopes, layout: Layout, out: NDArray[np.float64]) -> None:
    """Write the rows (n, n) of the Jacobian of `newton` for bank, pitch angle, altitude and heading."""
    there, at = layout.motion, state_places(layout)
    q, r = motion.q, motion.r
    sin_phi, cos_phi = motion.sin_phi, motion.cos_phi
    sin_theta, cos_theta = motion.sin_theta, motion.cos_theta
    turn, lean = q * sin_phi + r * cos_phi, q * cos_phi - r * sin_phi
    if len(there.phi) > 0:
        tangent = sin_theta / cos_theta
        out[at.phi, at.phi] = lean * tangent
        if len(there.p) > 0:
            out[at.phi, at.p] = 1.0
        if len(there.q) > 0:
            out[at.phi, at.q] = sin_phi * tangent
        if len(there.r) > 0:
            out[at.phi, at.r] = cos_phi * tangent
        if len(there.theta) > 0:
            out[at.phi, at.theta] = turn / (cos_theta * cos_theta)
    if len(there.theta) > 0:
        if len(there.q) > 0:
            out[at.theta, at.q] = cos_phi
        if len(there.r) > 0:
            out[at.theta, at.r] = -sin_phi
        if len(there.phi) > 0:
            out[at.theta, at.phi] = -turn
    if len(there.h) > 0:
        _by_velocity(at.h, sin_theta, -sin_phi * cos_theta, -cos_phi * cos_theta, slopes, layout, out)
        if len(there.phi) > 0:
            out[at.h, at.phi] = (motion.w * sin_phi - motion.v * cos_phi) * cos_theta
        if len(there.theta) > 0:
            out[at.h, at.theta] = motion.u * cos_theta + (motion.v * sin_phi + motion.w * cos_phi) * sin_theta
    if len(there.psi) > 0:
        out[at.psi, at.phi] = lean / cos_theta
        if len(there.q) > 0:
            out[at.psi, at.q] = sin_phi / cos_theta
        if len(there.r) > 0:
            out[at.psi, at.r] = cos_phi / cos_theta
        if len(there.theta) > 0:
            out[at.psi, at.theta] = turn * sin_theta / (cos_theta * cos_theta)
