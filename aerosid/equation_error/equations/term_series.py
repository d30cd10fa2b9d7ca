"""Terms of a model along a record, compiled: their factors and products as rows, and their sums by coefficient.

Series of a record are rows (., N), so that one step runs along them. The eight coefficients have fixed indices, those
that a case does not model among them: C_X C_Y C_Z C_l C_m C_n C_L C_D.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.equation_error.equations.running_integral import derivative_of_linear
from aerosid.flight_model.axes import ATMOSPHERE_AND_BODY, COEFFICIENTS
from aerosid.flight_model.term_grammar import VARIABLE_COUNT
from aerosid.flight_model.terms import TermTable
from aerosid.signals.array_elements import copy_row

Array = NDArray[np.float64]
Places = NDArray[np.int64]

X, Y, Z, ROLL, PITCH, YAW, LIFT, DRAG = range(len(COEFFICIENTS))
"""Indices of the coefficients."""

RHO, THRUST, MASS, SOUND = range(len(ATMOSPHERE_AND_BODY))
"""Leading columns of the inputs."""

(ALPHA, Q_HAT, V_HAT, ALPHA_DOT, C_T, MACH, BETA, P_HAT, R_HAT, PHI, P, R, THETA) = range(13)
"""Indices of `VARIABLES`, without the coefficients among them."""

ALL, FORCES, MOMENTS, MOMENTS_OF_INPUTS, ALL_OTHERS = 0, 1, 2, 3, 4
"""Layout: which terms are summed: forces without those by alpha_dot, moments, those by inputs and all but those."""


class MotionSeries(NamedTuple):
    """The motion at every sample as used by terms and equations, (N,) each, SI.

    `airspeed` as measured, by which residuals are weighted; `sine` and `cosine` of alpha; `gravity` normal to the path,
    g cos(theta - alpha) cos phi.
    """

    V: Array
    airspeed: Array
    alpha: Array
    beta: Array
    p: Array
    q: Array
    r: Array
    p_dot: Array
    q_dot: Array
    r_dot: Array
    phi: Array
    theta: Array
    alpha_dot: Array
    sine: Array
    cosine: Array
    gravity: Array


class Terms(NamedTuple):
    """The terms of a model, T of them, with their values.

    Attributes
    ----------
    table : TermTable
    places : int64[L]
        Index of each of the model's coefficients among the eight.
    measured : int
        Columns of the inputs, after the leading four, that contain motion.
    values : float64[T]
        Of the model, for lift, levers and angular accelerations.
    known : float64[T]
        Of those that are not estimated; zero for the others.
    added : float64[S, N]
        Additional series per unit of some terms, as of flow separation.
    added_to : int64[S]
        Indices of those terms.
    """

    table: TermTable
    places: Places
    measured: int
    values: Array
    known: Array
    added: Array
    added_to: Places


class Body(NamedTuple):
    """Geometry, inertia and reference speeds of an aircraft, SI, as of `Constants`, whatever the case of the equations.

    `thrust_change`, `cg_x`, `cg_y`, `cg_z`: columns of the inputs with thrust beyond that of the thrust input and with
    the position of the centre of gravity ahead, right of and below the declared one; -1: none.
    """

    wing_area: float
    mean_chord: float
    span: float
    I_xx: float
    I_yy: float
    I_zz: float
    I_xz: float
    thrust_incidence: float
    thrust_z_arm: float
    airspeed_of_rates: float
    airspeed_of_V_hat: float
    thrust_change: int
    cg_x: int
    cg_y: int
    cg_z: int


@njit_inline
def fill_variables(course: MotionSeries, inputs: Array, body: Body, needed: NDArray[np.bool_], series: Array) -> None:
    """The variables contained in terms: `VARIABLES` in their order, then the columns of the inputs."""
    samples, columns = inputs.shape
    for c in range(columns):
        if needed[VARIABLE_COUNT + c]:
            for n in range(samples):
                series[VARIABLE_COUNT + c, n] = inputs[n, c]
    if body.airspeed_of_rates > 0.0:
        per_rate = 0.5 / body.airspeed_of_rates
        for n in range(samples):
            series[ALPHA_DOT, n] = per_rate
    else:
        for n in range(samples):
            series[ALPHA_DOT, n] = 0.5 / course.V[n]
    for index, rate, length in (
        (Q_HAT, course.q, body.mean_chord),
        (P_HAT, course.p, body.span),
        (R_HAT, course.r, body.span),
        (ALPHA_DOT, course.alpha_dot, body.mean_chord),  # last, since its row holds the factor until then
    ):
        if needed[index]:
            for n in range(samples):
                series[index, n] = rate[n] * length * series[ALPHA_DOT, n]
    for index, same in (
        (ALPHA, course.alpha),
        (BETA, course.beta),
        (PHI, course.phi),
        (THETA, course.theta),
        (P, course.p),
        (R, course.r),
    ):
        if needed[index]:
            for n in range(samples):
                series[index, n] = same[n]
    if needed[V_HAT]:
        for n in range(samples):
            series[V_HAT, n] = course.V[n] / body.airspeed_of_V_hat - 1.0
    if needed[MACH]:
        for n in range(samples):
            series[MACH, n] = course.V[n] / inputs[n, SOUND]


@njit_inline
def fill_products(terms: Terms, series: Array) -> None:
    """All products of the variables; where terms contain lift, with the lift of the model's own terms."""
    table = terms.table
    _multiply(table, series)
    if table.lift_row >= 0:
        # As measured it would contain the gusts to which drag responds.
        lift = series[table.lift_slot]
        for n in range(lift.shape[0]):
            lift[n] = 0.0
        for entry in range(terms.values.size):
            if table.coefficient[entry] == table.lift_row:
                _add_term(terms, entry, terms.values[entry], series, lift)
        _multiply(table, series)


@njit_inline
def _multiply(table: TermTable, series: Array) -> None:
    """As `fill_values`, along rows."""
    shaped, samples = table.shaped_variable.shape[0], series.shape[1]
    one = series.shape[0] - table.left.shape[0] - shaped - 1
    for n in range(samples):
        series[one, n] = 1.0
    for b in range(shaped):
        offset, variable = table.shaped_offset[b], table.shaped_variable[b]
        if table.shaped_kind[b] == 1:
            for n in range(samples):
                series[one + 1 + b, n] = abs(series[variable, n])
        else:
            for n in range(samples):
                series[one + 1 + b, n] = max(series[variable, n] - offset, 0.0)
    index = one + 1 + shaped
    for p in range(table.left.shape[0]):
        left, right = table.left[p], table.right[p]
        for n in range(samples):
            series[index + p, n] = series[left, n] * series[right, n]


@njit_inline
def _add_term(terms: Terms, entry: int, value: float, series: Array, total: Array) -> None:
    """Add a term of a value to a row, with its additional series."""
    along = terms.table.value[entry]
    for n in range(total.shape[0]):
        total[n] += value * series[along, n]
    for s in range(terms.added_to.shape[0]):
        if terms.added_to[s] == entry:
            for n in range(total.shape[0]):
                total[n] += value * terms.added[s, n]


@njit_inline
def moves_with_inputs(terms: Terms, entry: int) -> bool:
    """Whether a term contains an input, thrust included; measured motion is none."""
    table = terms.table
    first, last = VARIABLE_COUNT + len(ATMOSPHERE_AND_BODY), VARIABLE_COUNT + len(ATMOSPHERE_AND_BODY) + terms.measured
    for f in range(table.first[entry], table.first[entry + 1]):
        variable = table.variable[f]
        if variable == C_T or (variable >= VARIABLE_COUNT and not (first <= variable < last)):
            return True
    return False


@njit_inline
def _contains_alpha_dot(table: TermTable, entry: int) -> bool:
    held: bool = False
    for f in range(table.first[entry], table.first[entry + 1]):
        held = held or table.variable[f] == ALPHA_DOT
    return held


@njit_inline
def _is_summed(terms: Terms, entry: int, which: int) -> bool:
    index = terms.places[terms.table.coefficient[entry]]
    is_moment = bool(ROLL <= index <= YAW)
    if which == ALL:
        return True
    if which == FORCES:
        return not is_moment and not _contains_alpha_dot(terms.table, entry)
    if which == MOMENTS:
        return is_moment
    by_inputs = is_moment and moves_with_inputs(terms, entry)
    return bool(by_inputs == (which == MOMENTS_OF_INPUTS))


@njit_inline
def sum_terms(terms: Terms, values: Array, series: Array, totals: Array, which: int) -> None:
    """Add terms of some values to their coefficients, (8, N), before the transformation to body axes."""
    for entry in range(values.shape[0]):
        if values[entry] != 0.0 and _is_summed(terms, entry, which):
            _add_term(terms, entry, values[entry], series, totals[terms.places[terms.table.coefficient[entry]]])


@njit
def shown_terms(terms: Terms, values: Array, series: Array, linear_inputs: bool) -> Array:
    """Terms of some values summed, (8, N), moments as the derivatives of sampled rates show them."""
    totals = np.zeros((len(COEFFICIENTS), series.shape[1]))
    if not linear_inputs:
        sum_terms(terms, values, series, totals, ALL)
        return totals
    sum_terms(terms, values, series, totals, MOMENTS_OF_INPUTS)
    for index in range(ROLL, YAW + 1):
        if np.any(totals[index] != 0.0):
            copy_row(totals[index], derivative_of_linear(totals[index]))
    sum_terms(terms, values, series, totals, ALL_OTHERS)
    return totals
