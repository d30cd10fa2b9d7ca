"""Equations of motion of a rigid body in any of the cases of `axes`, and what its sensors see, with exact Jacobians.

Five stages, each with its value and its small Jacobian: air-relative motion (`air`), sums of terms (`terms`), forces
and moments (`loads`), Newton's and Euler's equations (`rigid_body`), `sensors`. The rates are affine in the
coefficients, so that the slopes by term, by input and by state are three products with one matrix.

The aircraft is data: a `TermTable` (which terms stand in which coefficient), the vector of their values and a
`Constants` tuple. One compiled kernel serves every aircraft and every set of terms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.flight_model.air import Air, AirSlopes, Motion, air_at, air_slopes
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.layout import input_places, load_places, state_places
from aerosid.flight_model.loads import (
    ALPHA_DOT_HAT,
    C_T,
    THRUST,
    Centre,
    Forces,
    Reference,
    centre_at,
    fill_variables,
    fold_slopes,
    forces_at,
    reference_at,
    sum_terms,
)
from aerosid.flight_model.rigid_body import (
    Inertia,
    about_centre,
    accelerate,
    attitude_slopes,
    inertial_accelerations,
    inertial_slopes,
    inverse_inertia,
    newton,
)
from aerosid.flight_model.sensors import sense, sense_slopes
from aerosid.flight_model.terms import VARIABLE_COUNT, TermTable
from aerosid.flight_model.workspace import Workspace


@njit_inline
def evaluate(
    x: NDArray[np.float64],
    u: NDArray[np.float64],
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    positions: NDArray[np.float64],
    work: Workspace,
    differentiate: bool,
    observe: bool,
) -> None:
    """Write state rates, sensor outputs and their exact partial derivatives into `work`.

    Parameters
    ----------
    x : float64[n]
        The states of the case, SI.
    u : float64[I]
        Inputs: the leading columns of the case, then the extra ones.
    parameters : float64[T]
        Values of the terms of `table`.
    positions : float64[m, 3]
        Sensor positions from the centre of gravity, body axes [m], in the order of the case's outputs.
    differentiate : bool
        Whether the partial derivatives are wanted.
    observe : bool
        Whether the outputs are wanted.

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (33)-(36), with thrust, and with the lateral motion in all terms. Where
    alpha_dot_hat stands in a term the equations are implicit in alphadot; it is solved by Newton's method, which is
    exact in one step where the term is linear in it.

    A centre of gravity that is not the declared one: forces keep their lines of action and sensors their places, and
    u, v, w, h are those of the true centre; the inertias are left as they are.
    """
    layout, values = constants.layout, work.values
    motion, air = air_at(x, u, layout)
    reference, centre = reference_at(air, u, constants), centre_at(u, constants)
    inertial, inertia = inertial_accelerations(motion), inverse_inertia(constants)
    fill_variables(motion, air, reference, u, constants, values)
    implicit = len(layout.motion.u) > 0 and _is_implicit(parameters, table, differentiate)
    slope = 0.0
    forces = Forces(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    passes = 3 if implicit else 1
    for i in range(passes):
        sum_terms(parameters, table, layout, values, work.coefficients, work.slopes, differentiate or implicit)
        forces = forces_at(work.coefficients, air, reference, constants)
        if implicit:
            slope = _alpha_dot_slope(motion, air, reference, constants, work)
            if i < passes - 1:
                pushed = motion.u * (forces.a_z + inertial.w) - motion.w * (forces.a_x + inertial.u)
                target = pushed / (air.plane * air.plane) * reference.half_chord
                values[ALPHA_DOT_HAT] += (target - values[ALPHA_DOT_HAT]) / (1.0 - slope)
                if i == 1 and slope == 0.0:
                    break  # candidates alone name it: nothing moves any more
    newton(motion, inertial, about_centre(forces, centre, reference.mass), inertia, constants, work.rates)
    if not differentiate:
        if observe:
            sense(x, motion, air, forces, centre, positions, constants, work)
        return
    slopes = air_slopes(motion, air, layout)
    inertial_slopes(motion, slopes, inertia, constants, work.inertial_x)
    attitude_slopes(motion, slopes, layout, work.rates_x)
    fill_reach(air, reference, centre, inertia, constants, work)
    _slopes_by_state(air, slopes, reference, centre, inertia, constants, work)
    by_u, by_w = 0.0, 0.0
    if implicit:
        by_u, by_w = _follow_alpha_dot(motion, air, slopes, reference, slope, constants, work)
    _slopes_by_input(forces, reference, centre, inertia, by_u, by_w, constants, work)
    _slopes_by_term(table, constants, work)
    if observe:
        sense(x, motion, air, forces, centre, positions, constants, work)
        sense_slopes(motion, air, slopes, centre, positions, constants, work)


@njit_inline
def _is_implicit(parameters: NDArray[np.float64], table: TermTable, differentiate: bool) -> bool:
    """Whether alphadot is solved for: a candidate that depends on it, of zero value, matters in derivatives alone."""
    first, last = table.uses_alpha_dot, parameters.shape[0]
    while not differentiate and last >= first > 0 and parameters[last - 1] == 0.0:
        last -= 1
    implicit: bool = last >= first > 0
    return implicit


@njit_inline
def _alpha_dot_slope(motion: Motion, air: Air, reference: Reference, constants: Constants, work: Workspace) -> float:
    """How alpha_dot_hat, as the forces make it, moves with the one that the terms were given."""
    at, c_v = load_places(constants.layout), work.slopes
    along, down = c_v[ALPHA_DOT_HAT, at.X], c_v[ALPHA_DOT_HAT, at.Z]
    if len(constants.layout.coefficients.L) > 0:
        lift, drag = c_v[ALPHA_DOT_HAT, at.L], c_v[ALPHA_DOT_HAT, at.D]
        along += lift * air.sin_alpha - drag * air.cos_alpha
        down -= lift * air.cos_alpha + drag * air.sin_alpha
    scale = reference.force / reference.mass * reference.half_chord / (air.plane * air.plane)
    slope: float = (motion.u * down - motion.w * along) * scale
    return slope


@njit_inline
def fill_reach(
    air: Air, reference: Reference, centre: Centre, inertia: Inertia, constants: Constants, work: Workspace
) -> None:
    """Write `work.reach` (n, K): the rate of each moving state that a unit of each coefficient makes."""
    layout, out = constants.layout, work.reach
    there, at = layout.coefficients, load_places(layout)
    mass, force = reference.mass, reference.force
    unit = force / mass
    if len(there.X) > 0:
        accelerate(Forces(unit, 0.0, 0.0, 0.0, 0.0, 0.0), centre, mass, inertia, layout, out, at.X)
        accelerate(Forces(0.0, 0.0, unit, 0.0, 0.0, 0.0), centre, mass, inertia, layout, out, at.Z)
        moment = force * constants.mean_chord
        accelerate(Forces(0.0, 0.0, 0.0, 0.0, moment, 0.0), centre, mass, inertia, layout, out, at.m)
    if len(there.L) > 0:
        along, down = unit * air.cos_alpha, unit * air.sin_alpha
        accelerate(Forces(down, 0.0, -along, 0.0, 0.0, 0.0), centre, mass, inertia, layout, out, at.L)
        accelerate(Forces(-along, 0.0, -down, 0.0, 0.0, 0.0), centre, mass, inertia, layout, out, at.D)
    if len(there.Y) > 0:
        accelerate(Forces(0.0, unit, 0.0, 0.0, 0.0, 0.0), centre, mass, inertia, layout, out, at.Y)
        moment = force * constants.span
        accelerate(Forces(0.0, 0.0, 0.0, moment, 0.0, 0.0), centre, mass, inertia, layout, out, at.l)
        accelerate(Forces(0.0, 0.0, 0.0, 0.0, 0.0, moment), centre, mass, inertia, layout, out, at.n)


@njit_inline
def _slopes_by_state(
    air: Air,
    slopes: AirSlopes,
    reference: Reference,
    centre: Centre,
    inertia: Inertia,
    constants: Constants,
    work: Workspace,
) -> None:
    """Write `work.rates_x` for a given alpha_dot_hat: slopes of the coefficients through `reach`, and inertial ones."""
    layout = constants.layout
    there, at, loads = layout.motion, state_places(layout), load_places(layout)
    f_x, by_air, reach, c = work.rates_x, work.by_air, work.reach, work.coefficients
    fold_slopes(air, reference, constants, work.values, work.slopes, by_air)
    if len(layout.coefficients.L) > 0:  # lift and drag turn with the wind
        along = reference.force / reference.mass * (c[loads.L] * air.cos_alpha + c[loads.D] * air.sin_alpha)
        down = reference.force / reference.mass * (c[loads.L] * air.sin_alpha - c[loads.D] * air.cos_alpha)
        turned = Forces(along, 0.0, down, 0.0, 0.0, 0.0)
        accelerate(turned, centre, reference.mass, inertia, layout, work.column, 0)
    for i in range(at.moving):
        by_speed, by_alpha, by_beta, by_p, by_q, by_r, by_phi, by_theta = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        aerodynamic = 0.0
        for k in range(loads.total):
            share = reach[i, k]
            if len(there.u) > 0:
                aerodynamic += share * c[k]
                by_speed += share * by_air[0, k]
                by_alpha += share * by_air[1, k]
            if len(there.v) > 0:
                by_beta += share * by_air[2, k]
            if len(there.p) > 0:
                by_p += share * by_air[3, k]
            if len(there.q) > 0:
                by_q += share * by_air[4, k]
            if len(there.r) > 0:
                by_r += share * by_air[5, k]
            if len(there.phi) > 0:
                by_phi += share * by_air[6, k]
            if len(there.theta) > 0:
                by_theta += share * by_air[7, k]
        for k in range(at.total):
            f_x[i, k] = work.inertial_x[i, k]
        if len(there.u) > 0:
            by_speed += 2.0 * aerodynamic / air.speed
            if len(layout.coefficients.L) > 0:
                by_alpha += work.column[i, 0]
            f_x[i, at.u] += by_speed * slopes.V_u + by_alpha * slopes.alpha_u
            f_x[i, at.w] += by_speed * slopes.V_w + by_alpha * slopes.alpha_w
            if len(there.v) > 0:
                f_x[i, at.u] += by_beta * slopes.beta_u
                f_x[i, at.w] += by_beta * slopes.beta_w
                f_x[i, at.v] += by_speed * slopes.V_v
        if len(there.v) > 0:
            f_x[i, at.v] += by_beta * slopes.beta_v
        if len(there.p) > 0:
            f_x[i, at.p] += by_p
        if len(there.q) > 0:
            f_x[i, at.q] += by_q
        if len(there.r) > 0:
            f_x[i, at.r] += by_r
        if len(there.phi) > 0:
            f_x[i, at.phi] += by_phi
        if len(there.theta) > 0:
            f_x[i, at.theta] += by_theta


@njit_inline
def _follow_alpha_dot(
    motion: Motion,
    air: Air,
    slopes: AirSlopes,
    reference: Reference,
    slope: float,
    constants: Constants,
    work: Workspace,
) -> tuple[float, float]:
    """Let alpha_dot_hat follow the rates of u and w, in `reach` and in `rates_x`: the implicit function's slopes.

    With rates f = A c(h) + b and h = g f the change of the rates is (I + a g'/(1 - g a)) times the one for a given h,
    a = A dc/dh; g moves with the velocity itself. Returns g/(1 - g a), the shares of u' and w'.
    """
    layout = constants.layout
    at, loads = state_places(layout), load_places(layout)
    f_x, reach, follows = work.rates_x, work.reach, work.implicit
    square = air.plane * air.plane
    scale = reference.half_chord / (square * (1.0 - slope))
    by_u, by_w = -motion.w * scale, motion.u * scale
    for i in range(at.moving):
        follows[i] = 0.0
        for k in range(loads.total):
            follows[i] += reach[i, k] * work.slopes[ALPHA_DOT_HAT, k]
    for k in range(at.total):
        work.column[k, 1] = by_u * f_x[at.u, k] + by_w * f_x[at.w, k]
    hat = work.values[ALPHA_DOT_HAT] / (1.0 - slope)
    work.column[at.u, 1] += scale * work.rates[at.w] - 2.0 * motion.u / square * hat
    work.column[at.w, 1] -= scale * work.rates[at.u] + 2.0 * motion.w / square * hat
    if reference.current:
        work.column[at.u, 1] -= hat * slopes.V_u / air.speed
        work.column[at.w, 1] -= hat * slopes.V_w / air.speed
        if len(layout.motion.v) > 0:
            work.column[at.v, 1] -= hat * slopes.V_v / air.speed
    for i in range(at.moving):
        for k in range(at.total):
            f_x[i, k] += follows[i] * work.column[k, 1]
    for k in range(loads.total):
        moved = by_u * reach[at.u, k] + by_w * reach[at.w, k]
        for i in range(at.moving):
            reach[i, k] += follows[i] * moved
    return by_u, by_w


@njit_inline
def _slopes_by_input(
    forces: Forces,
    reference: Reference,
    centre: Centre,
    inertia: Inertia,
    by_u: float,
    by_w: float,
    constants: Constants,
    work: Workspace,
) -> None:
    """Write `work.rates_u`: the coefficients' slopes through `reach`, and what acts beside the coefficients."""
    layout = constants.layout
    there, at, loads = layout.motion, state_places(layout), load_places(layout)
    f_u, reach, first, mass = work.rates_u, work.reach, VARIABLE_COUNT + input_places(layout).total, reference.mass
    for i in range(at.moving):
        for j in range(f_u.shape[1]):
            total = 0.0
            for k in range(loads.total):
                total += reach[i, k] * work.slopes[first + j, k]
            f_u[i, j] = total
    if constants.thrust_change >= 0:
        j, incidence = constants.thrust_change, constants.thrust_incidence
        along, down = 0.0, 0.0
        if len(layout.coefficients.X) > 0:
            along, down = np.cos(incidence) / mass, -np.sin(incidence) / mass
        pushed = Forces(along, 0.0, down, 0.0, constants.thrust_z_arm, 0.0)
        accelerate(pushed, centre, mass, inertia, layout, work.column, 0)
        followed = 0.0
        if len(there.u) > 0:
            followed = by_u * work.column[at.u, 0] + by_w * work.column[at.w, 0]
        for i in range(at.moving):
            total = work.column[i, 0] + work.implicit[i] * followed
            for k in range(loads.total):
                total += reach[i, k] * (work.slopes[C_T, k] / reference.force + work.slopes[THRUST, k])
            f_u[i, j] += total
    if centre.shifted:
        a_x, a_y, a_z = mass * forces.a_x, mass * forces.a_y, mass * forces.a_z
        here = Centre(False, 0.0, 0.0, 0.0)
        if constants.cg_x >= 0:
            accelerate(Forces(0.0, 0.0, 0.0, 0.0, a_z, -a_y), here, mass, inertia, layout, work.column, 0)
            _add_column(constants.cg_x, constants, work)
        if constants.cg_y >= 0:
            accelerate(Forces(0.0, 0.0, 0.0, -a_z, 0.0, a_x), here, mass, inertia, layout, work.column, 0)
            _add_column(constants.cg_y, constants, work)
        if constants.cg_z >= 0:
            accelerate(Forces(0.0, 0.0, 0.0, a_y, -a_x, 0.0), here, mass, inertia, layout, work.column, 0)
            _add_column(constants.cg_z, constants, work)
    if constants.gust >= 0 and len(there.w) > 0:
        # Air that moves down lowers alpha as if the aircraft rose; the inertial terms do not see it.
        for i in range(at.moving):
            f_u[i, constants.gust] = work.inertial_x[i, at.w] - work.rates_x[i, at.w]
    if constants.side_gust >= 0 and len(there.v) > 0:
        for i in range(at.moving):
            f_u[i, constants.side_gust] = work.inertial_x[i, at.v] - work.rates_x[i, at.v]


@njit_inline
def _add_column(place: int, constants: Constants, work: Workspace) -> None:
    """Add the work column to that of an extra input."""
    for i in range(state_places(constants.layout).moving):
        work.rates_u[i, place] += work.column[i, 0]


@njit_inline
def _slopes_by_term(table: TermTable, constants: Constants, work: Workspace) -> None:
    """Write `work.rates_p`: each term's value through `reach`, of a term of lift also through what lift moves."""
    moving, count = state_places(constants.layout).moving, load_places(constants.layout).total
    for t in range(table.coefficient.shape[0]):
        k, value = table.coefficient[t], work.values[table.value[t]]
        for i in range(moving):
            work.rates_p[i, t] = work.reach[i, k] * value
        if k == table.lift_row:
            for row in range(count):
                moved = work.slopes[table.lift_slot, row] * value
                if moved != 0.0:
                    for i in range(moving):
                        work.rates_p[i, t] += work.reach[i, row] * moved
