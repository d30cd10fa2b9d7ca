"""Forces and moments: nondimensional rates, sums of terms, body axes, thrust and centre of gravity, with Jacobians."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.flight_model.air import Air, Motion
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.layout import Layout, input_places, load_places, state_places
from aerosid.flight_model.terms import VARIABLE_COUNT, VARIABLES, TermTable, fill_values, pass_slopes

ALPHA, Q_HAT, V_HAT, ALPHA_DOT_HAT, C_T, MACH, BETA, P_HAT, R_HAT, PHI, P, R, THETA, C_L, C_Z = range(VARIABLE_COUNT)
"""Slots of `VARIABLES`."""

THRUST = VARIABLE_COUNT + 1
"""Slot of the thrust input among the values."""

if VARIABLES.index("r") != R or VARIABLES.index("C_Z") != C_Z:
    raise ImportError("the slots of the variables are not those of aerosid.flight_model.terms.VARIABLES")


class Reference(NamedTuple):
    """What turns coefficients into forces and moments, and rates into nondimensional ones, at one instant.

    `force` = q_bar S [N], `half_chord` and `half_span` c/(2 U0) and b/(2 U0) [s], `current`: whether U0 is the airspeed
    of the moment; thrust and mass that act.
    """

    force: float
    half_chord: float
    half_span: float
    current: bool
    thrust: float
    mass: float


class Forces(NamedTuple):
    """Specific forces [m/s^2] and moments about the declared centre of gravity [N m], body axes."""

    a_x: float
    a_y: float
    a_z: float
    L: float
    M: float
    N: float


class Centre(NamedTuple):
    """How far the centre of gravity lies ahead of, right of and below the declared one [m]."""

    shifted: bool
    ahead: float
    right: float
    below: float


@njit_inline
def reference_at(air: Air, u: NDArray[np.float64], constants: Constants) -> Reference:
    """Dynamic pressure, reference lengths and thrust from the inputs."""
    column = input_places(constants.layout)
    thrust = u[column.thrust]
    if constants.thrust_change >= 0:
        thrust += u[column.total + constants.thrust_change]
    speed = constants.airspeed_of_rates
    current = speed <= 0.0
    if current:
        speed = air.speed
    force = 0.5 * u[column.rho] * air.speed * air.speed * constants.wing_area
    half = 0.5 / speed
    return Reference(force, constants.mean_chord * half, constants.span * half, current, thrust, u[column.mass])


@njit_inline
def centre_at(u: NDArray[np.float64], constants: Constants) -> Centre:
    """Where the centre of gravity lies."""
    first = input_places(constants.layout).total
    ahead, right, below = 0.0, 0.0, 0.0
    if constants.cg_x >= 0:
        ahead = u[first + constants.cg_x]
    if constants.cg_y >= 0:
        right = u[first + constants.cg_y]
    if constants.cg_z >= 0:
        below = u[first + constants.cg_z]
    shifted = constants.cg_x >= 0 or constants.cg_y >= 0 or constants.cg_z >= 0
    return Centre(shifted, ahead, right, below)


@njit_inline
def fill_variables(
    motion: Motion,
    air: Air,
    reference: Reference,
    u: NDArray[np.float64],
    constants: Constants,
    values: NDArray[np.float64],
) -> None:
    """Write the variables that terms are made of; alpha_dot_hat is left zero."""
    there, column = constants.layout.motion, input_places(constants.layout)
    values[ALPHA] = air.alpha
    values[Q_HAT] = motion.q * reference.half_chord
    values[V_HAT] = air.speed / constants.airspeed_of_V_hat - 1.0
    values[ALPHA_DOT_HAT] = 0.0
    values[C_T] = reference.thrust / reference.force
    values[MACH] = air.speed / u[column.speed_of_sound]
    values[P_HAT] = motion.p * reference.half_span
    values[R_HAT] = motion.r * reference.half_span
    # What is measured is an input column, and terms take it from there.
    if len(there.v) > 0:
        values[BETA] = air.beta
    if len(there.phi) > 0:
        values[PHI] = motion.phi
    if len(there.p) > 0:
        values[P] = motion.p
    if len(there.r) > 0:
        values[R] = motion.r
    if len(there.theta) > 0:
        values[THETA] = motion.theta
    for j in range(u.shape[0]):
        values[VARIABLE_COUNT + j] = u[j]
    values[THRUST] = reference.thrust


@njit_inline
def sum_terms(
    parameters: NDArray[np.float64],
    table: TermTable,
    layout: Layout,
    values: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    slopes: NDArray[np.float64],
    differentiate: bool,
) -> None:
    """Sum value * term into the coefficients (K,), and their `slopes` (values, K) with respect to every variable."""
    count = load_places(layout).total
    acting = parameters.shape[0]
    while acting > 0 and parameters[acting - 1] == 0.0:
        acting -= 1  # candidates: only their derivative is wanted
    products = table.reach[acting - 1] if acting > 0 else 0
    wanted = table.left.shape[0] if differentiate else products
    fill_values(table, wanted, values)
    if table.lift_row >= 0:  # a polar: lift first, from terms that do not hold it
        values[table.lift_slot] = 0.0
        for t in range(acting):
            if table.coefficient[t] == table.lift_row and parameters[t] != 0.0:
                values[table.lift_slot] += parameters[t] * values[table.value[t]]
        fill_values(table, wanted, values)
    for row in range(count):
        coefficients[row] = 0.0
    for t in range(acting):
        if parameters[t] != 0.0:
            coefficients[table.coefficient[t]] += parameters[t] * values[table.value[t]]
    if differentiate:
        for slot in range(values.shape[0] - table.left.shape[0] + products):
            for row in range(count):
                slopes[slot, row] = 0.0
        for t in range(acting):
            slopes[table.value[t], table.coefficient[t]] += parameters[t]
        pass_slopes(table, products, values, slopes)
        if table.lift_row >= 0:  # through lift, which does not depend on itself
            for slot in range(values.shape[0] - table.left.shape[0] - table.shaped_variable.shape[0] - 1):
                by_lift = slopes[slot, table.lift_row]
                if by_lift != 0.0:
                    for row in range(count):
                        slopes[slot, row] += slopes[table.lift_slot, row] * by_lift


@njit_inline
def forces_at(c: NDArray[np.float64], air: Air, reference: Reference, constants: Constants) -> Forces:
    """Specific forces and moments of the coefficients and of the thrust; zero where the case does not model them."""
    there, at = constants.layout.coefficients, load_places(constants.layout)
    a_x, a_y, a_z, roll, pitch, yaw = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    per_mass = reference.force / reference.mass
    if len(there.X) > 0:
        c_x, c_z = c[at.X], c[at.Z]
        if len(there.L) > 0:
            c_x += c[at.L] * air.sin_alpha - c[at.D] * air.cos_alpha
            c_z -= c[at.L] * air.cos_alpha + c[at.D] * air.sin_alpha
        along, down = reference.thrust / reference.mass, 0.0
        if constants.thrust_incidence != 0.0:
            down = -along * np.sin(constants.thrust_incidence)
            along *= np.cos(constants.thrust_incidence)
        a_x, a_z = per_mass * c_x + along, per_mass * c_z + down
        pitch = reference.force * constants.mean_chord * c[at.m] + reference.thrust * constants.thrust_z_arm
    if len(there.Y) > 0:
        a_y = per_mass * c[at.Y]
        moment = reference.force * constants.span
        roll, yaw = moment * c[at.l], moment * c[at.n]
    return Forces(a_x, a_y, a_z, roll, pitch, yaw)


@njit_inline
def fold_slopes(
    air: Air,
    reference: Reference,
    constants: Constants,
    values: NDArray[np.float64],
    slopes: NDArray[np.float64],
    by_air: NDArray[np.float64],
) -> None:
    """Write how the coefficients move with airspeed, alpha, beta, p, q, r, phi, theta, the rows of `by_air` (8, K).

    Only those rows are written that a state of the case moves; airspeed is followed through V_hat, C_T, mach and the
    nondimensional rates.
    """
    there, count = constants.layout.motion, load_places(constants.layout).total
    inverse = 1.0 / air.speed
    reference_inverse = 1.0 / constants.airspeed_of_V_hat
    thrust, mach = -2.0 * values[C_T] * inverse, values[MACH] * inverse
    p_hat, q_hat, r_hat = 0.0, 0.0, 0.0
    if reference.current:
        p_hat, q_hat, r_hat = values[P_HAT] * inverse, values[Q_HAT] * inverse, values[R_HAT] * inverse
    for k in range(count):
        if len(there.u) > 0:
            by_air[0, k] = (
                slopes[V_HAT, k] * reference_inverse
                + slopes[C_T, k] * thrust
                + slopes[MACH, k] * mach
                - slopes[Q_HAT, k] * q_hat
                - slopes[P_HAT, k] * p_hat
                - slopes[R_HAT, k] * r_hat
            )
            by_air[1, k] = slopes[ALPHA, k]
        if len(there.v) > 0:
            by_air[2, k] = slopes[BETA, k]
        if len(there.p) > 0:
            by_air[3, k] = slopes[P_HAT, k] * reference.half_span + slopes[P, k]
        if len(there.q) > 0:
            by_air[4, k] = slopes[Q_HAT, k] * reference.half_chord
        if len(there.r) > 0:
            by_air[5, k] = slopes[R_HAT, k] * reference.half_span + slopes[R, k]
        if len(there.phi) > 0:
            by_air[6, k] = slopes[PHI, k]
        if len(there.theta) > 0:
            by_air[7, k] = slopes[THETA, k]


@njit_inline
def pressure_area(x: NDArray[np.float64], u: NDArray[np.float64], constants: Constants) -> float:
    """Dynamic pressure times wing area [N]: the force that a unit of a coefficient makes."""
    there, at, column = constants.layout.motion, state_places(constants.layout), input_places(constants.layout)
    if len(there.u) > 0:
        square = x[at.u] * x[at.u] + x[at.w] * x[at.w]
        if len(there.v) > 0:
            square += x[at.v] * x[at.v]
        elif u[column.beta] != 0.0:
            square /= np.cos(u[column.beta]) ** 2
    else:
        square = u[column.V] * u[column.V]
    force: float = 0.5 * u[column.rho] * square * constants.wing_area
    return force
