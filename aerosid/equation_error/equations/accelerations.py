"""Accelerations by a model, thrust, lever arms and inertial coupling, in a few compiled passes over the samples.

    q_bar S C_X/m + T cos(incidence)/m + arms,  q_bar S C_Y/m + arms,  q_bar S C_Z/m - T sin(incidence)/m + arms,
    (q_bar S b C_l + I_xz (r' + p q) - (I_zz - I_yy) q r)/I_xx,
    (q_bar S c C_m - (I_xx - I_zz) p r - I_xz (p^2 - r^2) + T z_arm)/I_yy,
    (q_bar S b C_n + I_xz (p' - q r) - (I_yy - I_xx) p q)/I_zz

at the accelerometers and gyros: the equations of `coefficient.py`, each solved for the output of its sensor. A search
evaluates them thousands of times, and hundreds of short steps over a record of a thousand samples each would cost more
in calls than in work. Klein & Morelli, Aircraft System Identification, section 5.1.

Series of a record are rows (., N) here, so that one step runs along them. The eight coefficients have fixed indices,
those that a case does not model among them: C_X C_Y C_Z C_l C_m C_n C_L C_D.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.equation_error.equations.inertial_coupling import (
    Aircraft,
    add_further_arms,
    add_levers,
    add_moments,
    add_thrust_and_arms,
    are_others,
    is_moved,
)
from aerosid.equation_error.equations.running_integral import derivative_of_linear
from aerosid.equation_error.equations.term_series import (
    ALPHA_DOT,
    C_T,
    DRAG,
    FORCES,
    LIFT,
    MASS,
    MOMENTS,
    PITCH,
    RHO,
    ROLL,
    THRUST,
    YAW,
    Body,
    MotionSeries,
    Terms,
    X,
    Y,
    Z,
    fill_products,
    fill_variables,
    moves_with_inputs,
    shown_terms,
    sum_terms,
)
from aerosid.flight_model.axes import COEFFICIENTS
from aerosid.flight_model.term_grammar import VARIABLE_COUNT
from aerosid.flight_model.terms import value_count
from aerosid.signals.array_elements import copy_row

Array = NDArray[np.float64]
Places = NDArray[np.int64]


class Accelerations(NamedTuple):
    """The equations' accelerations, m/s^2 or rad/s^2.

    Attributes
    ----------
    known : float64[6, N]
        The known part.
    per_unit : float64[6, N]
        Of one unit of each coefficient.
    in_units : float64[6, N]
        One m/s^2 or rad/s^2 in units of the coefficient, by airspeed as measured and inertia as declared: others would
        make residuals look small.
    series : float64[V + 1 + B + P, N]
        All variables and products of the terms, as `fill_values` has it.
    """

    known: Array
    per_unit: Array
    in_units: Array
    series: Array


@njit
def accelerations(
    course: MotionSeries, inputs: Array, terms: Terms, aircraft: Aircraft, linear_inputs: bool
) -> Accelerations:
    """The known accelerations, and those by one unit of each coefficient.

    Parameters
    ----------
    inputs : float64[N, C]
        Including the contributions of effects.
    linear_inputs : bool
        Whether inputs are linear between samples: the derivatives of rates then show less of them.
    """
    acting, declared, table = aircraft.acting, aircraft.declared, terms.table
    samples, columns = inputs.shape
    series = np.empty((value_count(table, columns), samples))
    needed = np.zeros(VARIABLE_COUNT + columns, dtype=np.bool_)
    for variable in table.variable:
        needed[variable] = True
    fill_variables(course, inputs, acting, needed, series)
    thrust = _thrust(inputs, acting)
    if needed[C_T]:
        for n in range(samples):
            series[C_T, n] = thrust[n] / (0.5 * inputs[n, RHO] * course.V[n] ** 2 * acting.wing_area)
    if needed[VARIABLE_COUNT + THRUST]:
        copy_row(series[VARIABLE_COUNT + THRUST], thrust)
    fill_products(terms, series)
    shape = LIFT, samples  # body-axis coefficients precede lift
    result = Accelerations(np.zeros(shape), np.empty(shape), np.empty(shape), series)
    _weigh(course, inputs, aircraft, result)
    thrust_shown = derivative_of_linear(thrust) if linear_inputs else thrust

    # Specific forces by the model, m/s^2: measured ones contain the gusts to which the moment responds, and a term or a
    # lever arm computed from them would explain those.
    elsewhere = is_moved(inputs, acting)
    forces = np.zeros((len(COEFFICIENTS), samples))
    if table.uses_alpha_dot or elsewhere:
        sum_terms(terms, terms.values, series, forces, FORCES)
        _to_body_axes(course, forces)
        _to_specific_forces(thrust, inputs, acting, result.per_unit, forces)
    if table.uses_alpha_dot:
        _fill_modelled_alpha_dot(course, acting, forces, series)
        fill_products(terms, series)

    add_thrust_and_arms(course, thrust, inputs, aircraft, result.known)
    add_moments(course, thrust_shown, declared, aircraft.modelled, 1.0, course.p_dot, course.r_dot, result.known)
    if elsewhere:
        add_levers(inputs, aircraft, forces, result.known)
    if elsewhere or np.any(aircraft.further != 0.0):
        totals = np.zeros((len(COEFFICIENTS), samples))
        sum_terms(terms, terms.values, series, totals, MOMENTS)
        _to_angular_accelerations(course, aircraft, result, totals)
        add_further_arms(course, inputs, aircraft, totals, result.known)
    if are_others(acting, declared):
        totals = shown_terms(terms, terms.values, series, linear_inputs)
        # The model's angular accelerations: rolling and yawing by gusts would look like I_xz.
        _to_angular_accelerations(course, aircraft, result, totals)
        p_dot, r_dot = totals[ROLL], totals[YAW]
        add_moments(course, thrust_shown, acting, aircraft.modelled, 1.0, p_dot, r_dot, result.known)
        add_moments(course, thrust_shown, declared, aircraft.modelled, -1.0, p_dot, r_dot, result.known)

    totals = shown_terms(terms, terms.known, series, linear_inputs)
    _to_body_axes(course, totals)
    _push(totals, aircraft, result.per_unit, result.known)
    return result


@njit
def stacked(
    course: MotionSeries,
    terms: Terms,
    found: Accelerations,
    term_indices: Places,
    equations: Places,
    linear_inputs: bool,
) -> Array:
    """Known part of some equations and contribution of one unit of some terms to them, (N, M), m/s^2 or rad/s^2.

    Parameters
    ----------
    term_indices : int64[M]
        Terms; -1 for the known part.
    equations : int64[M]
        Indices of the equations.
    """
    samples = found.known.shape[1]
    out = np.empty((samples, term_indices.size))
    for m in range(term_indices.size):
        entry, index = term_indices[m], equations[m]
        if entry < 0:
            copy_row(out[:, m], found.known[index])
            continue
        coefficient = terms.places[terms.table.coefficient[entry]]
        along = found.series[terms.table.value[entry]].copy()
        if linear_inputs and coefficient >= ROLL and coefficient <= YAW and moves_with_inputs(terms, entry):
            along = derivative_of_linear(along)
        for s in range(terms.added_to.size):
            if terms.added_to[s] == entry:
                along += terms.added[s]
        per_unit = found.per_unit[index]
        if coefficient == index:
            for n in range(samples):
                out[n, m] = along[n] * per_unit[n]
        elif (coefficient == LIFT) == (index == X):  # C_L in C_X and C_D in C_Z act by the sine
            sign = 1.0 if coefficient == LIFT else -1.0
            for n in range(samples):
                out[n, m] = sign * along[n] * course.sine[n] * per_unit[n]
        else:
            for n in range(samples):
                out[n, m] = -along[n] * course.cosine[n] * per_unit[n]
    return out


@njit
def subtract_from_measured(
    columns: Array, measured: Array, in_units: Array, term_indices: Places, equations: Places
) -> None:
    """Measured signals (6, N) less the known part, and the other columns (N, M) of `stacked`, in units, in place."""
    for m in range(term_indices.size):
        index = equations[m]
        for n in range(columns.shape[0]):
            shown = measured[index, n] - columns[n, m] if term_indices[m] < 0 else columns[n, m]
            columns[n, m] = shown * in_units[index, n]


@njit
def _thrust(inputs: Array, body: Body) -> Array:
    """The thrust, N, (N,), including the contributions of effects."""
    thrust = inputs[:, THRUST].copy()
    if body.thrust_change >= 0:
        thrust += inputs[:, body.thrust_change]
    return thrust


@njit_inline
def _weigh(course: MotionSeries, inputs: Array, aircraft: Aircraft, result: Accelerations) -> None:
    """Accelerations by one unit of each coefficient, and the unit of its equation."""
    acting, declared = aircraft.acting, aircraft.declared
    samples, per_unit, in_units = inputs.shape[0], result.per_unit, result.in_units
    for n in range(samples):
        pressed = 0.5 * inputs[n, RHO] * acting.wing_area  # q_bar S over the square of the speed
        force, mass = pressed * course.V[n] ** 2, inputs[n, MASS]
        reference = 1.0 / (pressed * course.airspeed[n] ** 2)
        per_force, of_force = force / mass, mass * reference
        for index in range(3):
            per_unit[index, n], in_units[index, n] = per_force, of_force
        per_unit[PITCH, n], in_units[PITCH, n] = force, reference
    for index, length, inertia, usual in (
        (ROLL, acting.span, acting.I_xx, declared.I_xx),
        (YAW, acting.span, acting.I_zz, declared.I_zz),
        (PITCH, acting.mean_chord, acting.I_yy, declared.I_yy),
    ):
        if aircraft.modelled[index]:
            for n in range(samples):
                per_unit[index, n] = per_unit[PITCH, n] * (length / inertia)
                in_units[index, n] = in_units[PITCH, n] * (usual / length)


@njit_inline
def _to_body_axes(course: MotionSeries, totals: Array) -> None:
    """Lift and drag, (8, N), added to the coefficients about body axes."""
    for n in range(totals.shape[1]):
        sine, cosine = course.sine[n], course.cosine[n]
        lift, drag = totals[LIFT, n], totals[DRAG, n]
        totals[X, n] += lift * sine - drag * cosine
        totals[Z, n] -= lift * cosine + drag * sine


@njit_inline
def _push(totals: Array, aircraft: Aircraft, per_unit: Array, known: Array) -> None:
    """Add the accelerations (6, N) by coefficients (8, N) in body axes."""
    for index in range(known.shape[0]):
        if aircraft.modelled[index]:
            for n in range(known.shape[1]):
                known[index, n] += totals[index, n] * per_unit[index, n]


@njit_inline
def _to_specific_forces(thrust: Array, inputs: Array, body: Body, per_unit: Array, forces: Array) -> None:
    """Coefficients about body axes, the first of (8, N), to specific forces, m/s^2, with the thrust's."""
    ahead, below = np.cos(body.thrust_incidence), -np.sin(body.thrust_incidence)
    for n in range(thrust.shape[0]):
        pushed = thrust[n] / inputs[n, MASS]
        forces[X, n] = forces[X, n] * per_unit[X, n] + pushed * ahead
        forces[Y, n] = forces[Y, n] * per_unit[Y, n]
        forces[Z, n] = forces[Z, n] * per_unit[Z, n] + pushed * below


@njit_inline
def _fill_modelled_alpha_dot(course: MotionSeries, body: Body, forces: Array, series: Array) -> None:
    """The rate of alpha by the model's forces, m/s^2, times c/(2 U0)."""
    for n in range(forces.shape[1]):
        V = course.V[n]
        rate_speed = body.airspeed_of_rates if body.airspeed_of_rates > 0.0 else V
        normal = forces[Z, n] * course.cosine[n] - forces[X, n] * course.sine[n]
        rate = course.q[n] + (normal + course.gravity[n]) / V
        series[ALPHA_DOT, n] = rate * body.mean_chord / (2.0 * rate_speed)


@njit_inline
def _to_angular_accelerations(course: MotionSeries, aircraft: Aircraft, result: Accelerations, totals: Array) -> None:
    """Coefficients (8, N) of the moments to angular accelerations, those that are not modelled as measured."""
    measured = (course.p_dot, course.q_dot, course.r_dot)
    for axis in range(3):
        index = ROLL + axis
        for n in range(totals.shape[1]):
            if aircraft.modelled[index]:
                totals[index, n] = result.known[index, n] + totals[index, n] * result.per_unit[index, n]
            else:
                totals[index, n] = measured[axis][n]
