"""Evaluate the longitudinal equations of motion (33)-(36) and what the sensors see, with exact partial derivatives.

The aircraft is data: a `TermTable` (which terms stand in which coefficient), the vector of their values and a
`Constants` tuple. One compiled kernel serves every aircraft and every set of terms.

States are u, w, q, theta, h; the lateral motion (phi, p, r, beta) enters as measured input.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.terms import TermTable, factor_slope, term_value

GRAVITY = 9.80665
STATES = ("u", "w", "q", "theta", "h")
OUTPUTS = ("V", "alpha", "q", "theta", "a_x", "a_z", "q_dot", "h")
STATE_COUNT = 5
OUTPUT_COUNT = 8
FIXED_VARIABLES = 6
FIXED_INPUTS = 8


class Constants(NamedTuple):
    """Geometry, inertia and reference speeds of one aircraft, as the kernel takes them (SI)."""

    wing_area: float
    mean_chord: float
    I_yy: float
    thrust_incidence: float
    thrust_z_arm: float
    airspeed_of_rates: float
    """U0 of q_hat and alpha_dot_hat [m/s]; 0 where the current airspeed is meant."""
    airspeed_of_V_hat: float
    """U0 of V_hat [m/s]."""
    gust: int = -1
    """Which of the extra inputs is the vertical gust velocity [m/s], positive down; -1: none."""
    thrust_change: int = -1
    """Which of them is thrust [N] beyond the thrust input; -1: none."""
    cg_x: int = -1
    """Which of them is the centre of gravity's position ahead of the declared one [m]; -1: none."""
    cg_z: int = -1
    """Which of them is its position below the declared one [m]; -1: none."""


class Workspace(NamedTuple):
    """Arrays that one evaluation writes: rates f, outputs y and their partial derivatives.

    Shapes, with E extra inputs (those past the fixed columns) and T terms: `rates` (5), `rates_x` (5, 5), `rates_u`
    (5, E), `rates_p` (5, T), `outputs` (8), `outputs_x` (8, 5), `outputs_u` (8, E), `outputs_p` (8, T).
    """

    rates: NDArray[np.float64]
    rates_x: NDArray[np.float64]
    rates_u: NDArray[np.float64]
    rates_p: NDArray[np.float64]
    outputs: NDArray[np.float64]
    outputs_x: NDArray[np.float64]
    outputs_u: NDArray[np.float64]
    outputs_p: NDArray[np.float64]
    variables: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    coefficients_v: NDArray[np.float64]
    term_values: NDArray[np.float64]


@njit
def make_workspace(extra_inputs: int, terms: int) -> Workspace:
    """A `Workspace` for `extra_inputs` inputs past the fixed ones and `terms` terms."""
    slots = FIXED_VARIABLES + FIXED_INPUTS + extra_inputs
    return Workspace(
        np.zeros(5),
        np.zeros((5, 5)),
        np.zeros((5, extra_inputs)),
        np.zeros((5, terms)),
        np.zeros(8),
        np.zeros((8, 5)),
        np.zeros((8, extra_inputs)),
        np.zeros((8, terms)),
        np.zeros(slots),
        np.zeros(5),
        np.zeros((5, slots)),
        np.zeros(terms),
    )


@njit_inline
def _sum_coefficients(theta: NDArray[np.float64], table: TermTable, work: Workspace, differentiate: bool) -> None:
    """Sum value * term into the five coefficients, and their partials with respect to every variable."""
    c, c_v, values, variables = work.coefficients, work.coefficients_v, work.term_values, work.variables
    for row in range(5):
        c[row] = 0.0
        if differentiate:
            for slot in range(c_v.shape[1]):
                c_v[row, slot] = 0.0
    for t in range(theta.shape[0]):
        factor = theta[t]
        if factor == 0.0 and not differentiate:
            continue  # a candidate: only its derivative is wanted
        value = term_value(table, t, variables)
        values[t] = value
        if factor != 0.0:
            row = table.coefficient[t]
            c[row] += factor * value
            if differentiate:
                for f in range(table.first[t], table.first[t + 1]):
                    c_v[row, table.variable[f]] += factor * factor_slope(table, t, f, variables)


@njit_inline
def _lateral(phi: float, beta: float) -> tuple[float, float, float, float]:
    """Cosine and tangent of beta, sine and cosine of phi; most flights hold neither, and a sine costs like a term."""
    cos_beta, tan_beta, sin_phi, cos_phi = 1.0, 0.0, 0.0, 1.0
    if beta != 0.0:
        cos_beta, tan_beta = np.cos(beta), np.tan(beta)
    if phi != 0.0:
        sin_phi, cos_phi = np.sin(phi), np.cos(phi)
    return cos_beta, tan_beta, sin_phi, cos_phi


@njit_inline
def _centre(u: NDArray[np.float64], constants: Constants) -> tuple[float, float]:
    """How far the centre of gravity lies ahead of and below the declared one, m."""
    ahead, below = 0.0, 0.0
    if constants.cg_x >= 0:
        ahead = u[FIXED_INPUTS + constants.cg_x]
    if constants.cg_z >= 0:
        below = u[FIXED_INPUTS + constants.cg_z]
    return ahead, below


@njit_inline
def pressure_area(x: NDArray[np.float64], u: NDArray[np.float64], constants: Constants) -> float:
    """Dynamic pressure times wing area [N]: the force that a unit of a coefficient makes."""
    cos_beta, _, _, _ = _lateral(u[4], u[7])
    force: float = 0.5 * u[0] * (x[0] * x[0] + x[1] * x[1]) / (cos_beta * cos_beta) * constants.wing_area
    return force


@njit_inline
def evaluate(
    x: NDArray[np.float64],
    u: NDArray[np.float64],
    theta: NDArray[np.float64],
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
    x : (5,) u [m/s], w [m/s], q [rad/s], theta [rad], h [m].
    u : (8 + E,) inputs in the order of `INPUT_COLUMNS`, then the extra ones.
    theta : (T,) values of the terms of `table`.
    positions : (8, 3) sensor positions from the centre of gravity, body axes [m], in the order of `OUTPUTS`.
    differentiate : whether the partial derivatives are wanted.
    observe : whether the outputs are wanted.

    Notes
    -----
    Parameswaran & Raol 1994, eqs. (33)-(36), with thrust, and with the measured lateral motion in the inertial terms
    (phi, p, r, beta zero: the paper's equations). Where alpha_dot_hat stands in a term the equations are implicit in
    alphadot; it is solved by Newton's method, which is exact in one step where the term is linear in it.

    A centre of gravity that is not the declared one: forces keep their lines of action and sensors their places, and
    u, w, h are those of the true centre; I_yy is left as it is.
    """
    alpha_dot_used = False
    for k in range(table.variable.shape[0]):
        if table.variable[k] == 3:
            alpha_dot_used = True
    u_b, w_b, q, pitch = x[0], x[1], x[2], x[3]
    density, thrust, mass, sound = u[0], u[1], u[2], u[3]
    if constants.thrust_change >= 0:
        thrust += u[FIXED_INPUTS + constants.thrust_change]
    phi, p, r, beta = u[4], u[5], u[6], u[7]
    square = u_b * u_b + w_b * w_b
    plane = np.sqrt(square)
    cos_beta, tan_beta, sin_phi, cos_phi = _lateral(phi, beta)
    speed = plane / cos_beta
    v_b = plane * tan_beta
    sin_alpha, cos_alpha = w_b / plane, u_b / plane
    chord = constants.mean_chord
    rate_speed = constants.airspeed_of_rates
    current = rate_speed <= 0.0
    if current:
        rate_speed = speed
    half_chord = chord / (2.0 * rate_speed)
    reference_force = 0.5 * density * speed * speed * constants.wing_area

    variables = work.variables
    variables[0] = np.arctan2(w_b, u_b)
    variables[1] = q * half_chord
    variables[2] = speed / constants.airspeed_of_V_hat - 1.0
    variables[3] = 0.0
    variables[4] = thrust / reference_force
    variables[5] = speed / sound
    for j in range(u.shape[0]):
        variables[FIXED_VARIABLES + j] = u[j]
    variables[FIXED_VARIABLES + 1] = thrust

    sin_pitch, cos_pitch = np.sin(pitch), np.cos(pitch)
    force = reference_force / mass
    moment = reference_force * chord / constants.I_yy
    inertial_u = -GRAVITY * sin_pitch - q * w_b + r * v_b
    inertial_w = GRAVITY * cos_pitch * cos_phi + q * u_b - p * v_b
    thrust_x, thrust_z = thrust / mass, 0.0
    if constants.thrust_incidence != 0.0:
        thrust_z = -thrust_x * np.sin(constants.thrust_incidence)
        thrust_x *= np.cos(constants.thrust_incidence)
    thrust_q = thrust * constants.thrust_z_arm / constants.I_yy
    c = work.coefficients
    c_v = work.coefficients_v
    slope = 0.0
    passes = 3 if alpha_dot_used else 1
    f_u = 0.0
    f_w = 0.0
    for i in range(passes):
        _sum_coefficients(theta, table, work, differentiate or alpha_dot_used)
        f_u = force * (c[0] + c[3] * sin_alpha - c[4] * cos_alpha) + thrust_x + inertial_u
        f_w = force * (c[1] - c[3] * cos_alpha - c[4] * sin_alpha) + thrust_z + inertial_w
        if alpha_dot_used:
            a_u = force * (c_v[0, 3] + c_v[3, 3] * sin_alpha - c_v[4, 3] * cos_alpha)
            a_w = force * (c_v[1, 3] - c_v[3, 3] * cos_alpha - c_v[4, 3] * sin_alpha)
            slope = (u_b * a_w - w_b * a_u) / square * half_chord
            if i < passes - 1:
                target = (u_b * f_w - w_b * f_u) / square * half_chord
                variables[3] += (target - variables[3]) / (1.0 - slope)
                if i == 1 and slope == 0.0:
                    break  # candidates alone name it: nothing moves any more
    rates = work.rates
    rates[0] = f_u
    rates[1] = f_w
    rates[2] = moment * c[2] + thrust_q
    if constants.cg_x >= 0 or constants.cg_z >= 0:
        ahead, below = _centre(u, constants)
        rates[2] += mass / constants.I_yy * (ahead * (f_w - inertial_w) - below * (f_u - inertial_u))
    rates[3] = q * cos_phi - r * sin_phi
    rates[4] = u_b * sin_pitch - v_b * sin_phi * cos_pitch - w_b * cos_phi * cos_pitch

    if differentiate:
        _differentiate_rates(
            x, u, table, constants, work, speed, plane, half_chord, current, reference_force, slope, alpha_dot_used,
            sin_pitch, cos_pitch, f_u - inertial_u, f_w - inertial_w,
        )  # fmt: skip
    if observe:
        _observe(x, u, positions, constants, work, speed, plane, differentiate)


@njit_inline
def _differentiate_rates(
    x: NDArray[np.float64],
    u: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    work: Workspace,
    speed: float,
    plane: float,
    half_chord: float,
    current: bool,
    reference_force: float,
    slope: float,
    alpha_dot_used: bool,
    sin_pitch: float,
    cos_pitch: float,
    specific_x: float,
    specific_z: float,
) -> None:
    """Partial derivatives of the rates with respect to states, extra inputs and term values, by the chain rule.

    Only those are written that are ever other than zero.
    """
    u_b, w_b, q = x[0], x[1], x[2]
    mass = u[2]
    phi, p, r, beta = u[4], u[5], u[6], u[7]
    square = plane * plane
    cos_alpha, sin_alpha = u_b / plane, w_b / plane
    cos_beta, tan_beta, sin_phi, cos_phi = _lateral(phi, beta)
    c, c_v = work.coefficients, work.coefficients_v
    f_x, f_e, f_p = work.rates_x, work.rates_u, work.rates_p
    force = reference_force / mass
    moment = reference_force * constants.mean_chord / constants.I_yy
    c_x = c[0] + c[3] * sin_alpha - c[4] * cos_alpha
    c_z = c[1] - c[3] * cos_alpha - c[4] * sin_alpha
    c_x_alpha = c[3] * cos_alpha + c[4] * sin_alpha
    c_z_alpha = c[3] * sin_alpha - c[4] * cos_alpha

    for k in range(3):  # theta acts through gravity alone, h not at all
        # How the variables move with this state: alpha, q_hat, V_hat, C_T and mach.
        d_alpha, d_speed, d_q = 0.0, 0.0, 0.0
        if k == 0:
            d_alpha, d_speed = -w_b / square, cos_alpha / cos_beta
        elif k == 1:
            d_alpha, d_speed = u_b / square, sin_alpha / cos_beta
        elif k == 2:
            d_q = 1.0
        d_q_hat = d_q * half_chord
        if current:
            d_q_hat -= work.variables[1] * d_speed / speed
        d_v_hat = d_speed / constants.airspeed_of_V_hat
        d_c_t = -2.0 * work.variables[4] * d_speed / speed
        d_mach = work.variables[5] * d_speed / speed
        d_x = c_x_alpha * d_alpha
        d_z = c_z_alpha * d_alpha
        d_m = 0.0
        for row in range(5):
            d_c = (
                c_v[row, 0] * d_alpha
                + c_v[row, 1] * d_q_hat
                + c_v[row, 2] * d_v_hat
                + c_v[row, 4] * d_c_t
                + c_v[row, 5] * d_mach
            )
            if row == 0:
                d_x += d_c
            elif row == 1:
                d_z += d_c
            elif row == 2:
                d_m += d_c
            elif row == 3:
                d_x += d_c * sin_alpha
                d_z -= d_c * cos_alpha
            else:
                d_x -= d_c * cos_alpha
                d_z -= d_c * sin_alpha
        d_pressure = 2.0 * d_speed / speed
        f_x[0, k] = force * (d_x + c_x * d_pressure)
        f_x[1, k] = force * (d_z + c_z * d_pressure)
        f_x[2, k] = moment * (d_m + c[2] * d_pressure)
    shifted = constants.cg_x >= 0 or constants.cg_z >= 0
    ahead, below = _centre(u, constants)
    ahead, below = mass / constants.I_yy * ahead, mass / constants.I_yy * below
    if shifted:
        for k in range(3):
            f_x[2, k] += ahead * f_x[1, k] - below * f_x[0, k]
    d_v_u, d_v_w = cos_alpha * tan_beta, sin_alpha * tan_beta
    f_x[0, 0] += r * d_v_u
    f_x[0, 1] += -q + r * d_v_w
    f_x[0, 2] += -w_b
    f_x[0, 3] = -GRAVITY * cos_pitch
    f_x[1, 0] += q - p * d_v_u
    f_x[1, 1] += -p * d_v_w
    f_x[1, 2] += u_b
    f_x[1, 3] = -GRAVITY * sin_pitch * cos_phi
    f_x[2, 3] = 0.0
    f_x[3, 2] = cos_phi
    v_b = plane * tan_beta
    f_x[4, 0] = sin_pitch - d_v_u * sin_phi * cos_pitch
    f_x[4, 1] = -cos_phi * cos_pitch - d_v_w * sin_phi * cos_pitch
    f_x[4, 3] = u_b * cos_pitch + v_b * sin_phi * sin_pitch + w_b * cos_phi * sin_pitch

    for j in range(f_e.shape[1]):
        slot = FIXED_VARIABLES + FIXED_INPUTS + j
        f_e[0, j] = force * (c_v[0, slot] + c_v[3, slot] * sin_alpha - c_v[4, slot] * cos_alpha)
        f_e[1, j] = force * (c_v[1, slot] - c_v[3, slot] * cos_alpha - c_v[4, slot] * sin_alpha)
        f_e[2, j] = moment * c_v[2, slot]
    if constants.thrust_change >= 0:
        j, slot = constants.thrust_change, FIXED_VARIABLES + 1
        by_x = c_v[0, 4] + c_v[3, 4] * sin_alpha - c_v[4, 4] * cos_alpha
        by_z = c_v[1, 4] - c_v[3, 4] * cos_alpha - c_v[4, 4] * sin_alpha
        f_e[0, j] = (by_x + np.cos(constants.thrust_incidence)) / mass
        f_e[0, j] += force * (c_v[0, slot] + c_v[3, slot] * sin_alpha - c_v[4, slot] * cos_alpha)
        f_e[1, j] = (by_z - np.sin(constants.thrust_incidence)) / mass
        f_e[1, j] += force * (c_v[1, slot] - c_v[3, slot] * cos_alpha - c_v[4, slot] * sin_alpha)
        f_e[2, j] = (constants.mean_chord * c_v[2, 4] + constants.thrust_z_arm) / constants.I_yy
        f_e[2, j] += moment * c_v[2, slot]
    if shifted:
        for j in range(f_e.shape[1]):
            f_e[2, j] += ahead * f_e[1, j] - below * f_e[0, j]
        if constants.cg_x >= 0:
            f_e[2, constants.cg_x] += mass / constants.I_yy * specific_z
        if constants.cg_z >= 0:
            f_e[2, constants.cg_z] -= mass / constants.I_yy * specific_x
    for t in range(f_p.shape[1]):
        row, value = table.coefficient[t], work.term_values[t]
        along, down = 0.0, 0.0
        if row == 0:
            along = force * value
        elif row == 1:
            down = force * value
        elif row == 3:
            along, down = force * value * sin_alpha, -force * value * cos_alpha
        elif row == 4:
            along, down = -force * value * cos_alpha, -force * value * sin_alpha
        f_p[0, t], f_p[1, t] = along, down
        f_p[2, t] = moment * value if row == 2 else 0.0
        if shifted:
            f_p[2, t] += ahead * down - below * along

    if alpha_dot_used:
        a_u = force * (c_v[0, 3] + c_v[3, 3] * sin_alpha - c_v[4, 3] * cos_alpha)
        a_w = force * (c_v[1, 3] - c_v[3, 3] * cos_alpha - c_v[4, 3] * sin_alpha)
        a_q = moment * c_v[2, 3] + ahead * a_w - below * a_u
        by_f_u, by_f_w = -w_b / square * half_chord, u_b / square * half_chord
        inverse = 1.0 / (1.0 - slope)
        hat = work.variables[3]
        for k in range(5):
            d_hat = by_f_u * f_x[0, k] + by_f_w * f_x[1, k]
            if k == 0:
                d_hat += work.rates[1] / square * half_chord - 2.0 * u_b / square * hat
            elif k == 1:
                d_hat += -work.rates[0] / square * half_chord - 2.0 * w_b / square * hat
            if current and k == 0:
                d_hat -= hat * u_b / square
            elif current and k == 1:
                d_hat -= hat * w_b / square
            d_hat *= inverse
            f_x[0, k] += a_u * d_hat
            f_x[1, k] += a_w * d_hat
            f_x[2, k] += a_q * d_hat
        for j in range(f_e.shape[1]):
            d_hat = (by_f_u * f_e[0, j] + by_f_w * f_e[1, j]) * inverse
            f_e[0, j] += a_u * d_hat
            f_e[1, j] += a_w * d_hat
            f_e[2, j] += a_q * d_hat
        for t in range(f_p.shape[1]):
            d_hat = (by_f_u * f_p[0, t] + by_f_w * f_p[1, t]) * inverse
            f_p[0, t] += a_u * d_hat
            f_p[1, t] += a_w * d_hat
            f_p[2, t] += a_q * d_hat
    if constants.gust >= 0:
        # Air that moves down lowers alpha as if the aircraft rose; the inertial terms do not see it.
        j = constants.gust
        f_e[0, j] = -(f_x[0, 1] + q - r * d_v_w)
        f_e[1, j] = -(f_x[1, 1] + p * d_v_w)
        f_e[2, j] = -f_x[2, 1]


@njit_inline
def _observe(
    x: NDArray[np.float64],
    u: NDArray[np.float64],
    positions: NDArray[np.float64],
    constants: Constants,
    work: Workspace,
    speed: float,
    plane: float,
    differentiate: bool,
) -> None:
    """Sensor outputs at their positions; angular accelerations other than q_dot are taken as zero."""
    u_b, w_b, q, pitch = x[0], x[1], x[2], x[3]
    phi, p, r, beta = u[4], u[5], u[6], u[7]
    v_b = plane * np.tan(beta)
    y, rates = work.outputs, work.rates
    sin_pitch, cos_pitch, cos_phi = np.sin(pitch), np.cos(pitch), np.cos(phi)
    ahead, below = _centre(u, constants)
    vane_x, vane_y, vane_z = positions[1, 0] - ahead, positions[1, 1], positions[1, 2] - below
    vane_u = u_b + q * vane_z - r * vane_y
    vane_w = w_b + p * vane_y - q * vane_x
    force_x = rates[0] + GRAVITY * sin_pitch + q * w_b - r * v_b
    force_z = rates[1] - GRAVITY * cos_pitch * cos_phi - q * u_b + p * v_b
    x_x, x_y, x_z = positions[4, 0] - ahead, positions[4, 1], positions[4, 2] - below
    z_x, z_y, z_z = positions[5, 0] - ahead, positions[5, 1], positions[5, 2] - below
    y[0] = speed
    y[1] = np.arctan2(vane_w, vane_u)
    y[2] = q
    y[3] = pitch
    y[4] = force_x - (q * q + r * r) * x_x + p * q * x_y + (rates[2] + p * r) * x_z
    y[5] = force_z + (p * r - rates[2]) * z_x + q * r * z_y - (p * p + q * q) * z_z
    y[6] = rates[2]
    y[7] = x[4]
    if not differentiate:
        return
    y_x, y_e, y_p = work.outputs_x, work.outputs_u, work.outputs_p
    f_x, f_e, f_p = work.rates_x, work.rates_u, work.rates_p
    cos_beta, tan_beta = np.cos(beta), np.tan(beta)
    for k in range(5):
        for i in range(4):
            y_x[i, k] = 0.0
        y_x[4, k] = f_x[0, k] + f_x[2, k] * x_z
        y_x[5, k] = f_x[1, k] - f_x[2, k] * z_x
        y_x[6, k] = f_x[2, k]
        y_x[7, k] = 0.0
    y_x[0, 0], y_x[0, 1] = u_b / plane / cos_beta, w_b / plane / cos_beta
    vane_square = vane_u * vane_u + vane_w * vane_w
    y_x[1, 0] = -vane_w / vane_square
    y_x[1, 1] = vane_u / vane_square
    y_x[1, 2] = (-vane_x * vane_u - vane_z * vane_w) / vane_square
    y_x[2, 2] = 1.0
    y_x[3, 3] = 1.0
    y_x[7, 4] = 1.0
    d_v_u, d_v_w = u_b / plane * tan_beta, w_b / plane * tan_beta
    y_x[4, 0] += -r * d_v_u
    y_x[4, 1] += q - r * d_v_w
    y_x[4, 2] += w_b - 2.0 * q * x_x + p * x_y
    y_x[4, 3] += GRAVITY * cos_pitch
    y_x[5, 0] += -q + p * d_v_u
    y_x[5, 1] += p * d_v_w
    y_x[5, 2] += -u_b + r * z_y - 2.0 * q * z_z
    y_x[5, 3] += GRAVITY * sin_pitch * cos_phi
    for j in range(f_e.shape[1]):
        y_e[4, j] = f_e[0, j] + f_e[2, j] * x_z
        y_e[5, j] = f_e[1, j] - f_e[2, j] * z_x
        y_e[6, j] = f_e[2, j]
    if constants.gust >= 0:
        y_e[0, constants.gust] = -y_x[0, 1]
        y_e[1, constants.gust] = -y_x[1, 1]
    if constants.cg_x >= 0:
        y_e[1, constants.cg_x] = q * vane_u / vane_square
        y_e[4, constants.cg_x] += q * q + r * r
        y_e[5, constants.cg_x] += rates[2] - p * r
    if constants.cg_z >= 0:
        y_e[1, constants.cg_z] = q * vane_w / vane_square
        y_e[4, constants.cg_z] -= rates[2] + p * r
        y_e[5, constants.cg_z] += p * p + q * q
    for t in range(f_p.shape[1]):
        y_p[4, t] = f_p[0, t] + f_p[2, t] * x_z
        y_p[5, t] = f_p[1, t] - f_p[2, t] * z_x
        y_p[6, t] = f_p[2, t]


class Step(NamedTuple):
    """The response over one sampling interval: end state and its partial derivatives.

    `state` (5); `transition` (5, 5) d x1/d x0; `start` and `end` (5, E) d x1/d extra input at the start and at the end
    (inputs are linear in between); `terms` (5, T) d x1/d term values. The rest is room to work: what each of the four
    Runge-Kutta stages saw (`rates_x`, `rates_u`, `rates_p`, rows u, w, q of the last two), and how a rate added at a
    stage moves the end of the step (`passed_on`).
    """

    state: NDArray[np.float64]
    transition: NDArray[np.float64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    terms: NDArray[np.float64]
    stage_state: NDArray[np.float64]
    stage_input: NDArray[np.float64]
    state_total: NDArray[np.float64]
    rates_x: NDArray[np.float64]
    rates_u: NDArray[np.float64]
    rates_p: NDArray[np.float64]
    passed_on: NDArray[np.float64]
    substep: NDArray[np.float64]
    moved: NDArray[np.float64]


@njit
def make_step(extra_inputs: int, terms: int) -> Step:
    """A `Step` for `extra_inputs` inputs past the fixed ones and `terms` terms."""
    return Step(
        np.zeros(5),
        np.zeros((5, 5)),
        np.zeros((5, extra_inputs)),
        np.zeros((5, extra_inputs)),
        np.zeros((5, terms)),
        np.zeros(5),
        np.zeros(FIXED_INPUTS + extra_inputs),
        np.zeros(5),
        np.zeros((4, 5, 5)),
        np.zeros((4, 3, extra_inputs)),
        np.zeros((4, 3, terms)),
        np.zeros((4, 5, 5)),
        np.zeros((5, 5)),
        np.zeros(5),
    )


@njit
def advance(
    x: NDArray[np.float64],
    u0: NDArray[np.float64],
    u1: NDArray[np.float64],
    interval: float,
    substeps: int,
    theta: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    positions: NDArray[np.float64],
    work: Workspace,
    step: Step,
    differentiate: bool,
) -> None:
    """Write the state after one sampling interval, and its sensitivities, into `step`.

    Classical fourth-order Runge-Kutta with `substeps` equal steps; the sensitivities are those of the discrete
    solution itself. Inputs are linear in time.
    """
    extra, terms = work.rates_u.shape[1], work.rates_p.shape[1]
    step.state[:] = x
    h = interval / substeps
    for s in range(substeps):
        for n in range(4):
            fraction = (s + (0.0 if n == 0 else 1.0 if n == 3 else 0.5)) / substeps
            for j in range(u0.shape[0]):
                step.stage_input[j] = (1.0 - fraction) * u0[j] + fraction * u1[j]
            reach = 0.0 if n == 0 else h if n == 3 else 0.5 * h
            weight = h / 6.0 if n == 0 or n == 3 else h / 3.0
            for i in range(5):
                step.stage_state[i] = step.state[i] + (reach * work.rates[i] if n > 0 else 0.0)
            evaluate(step.stage_state, step.stage_input, theta, table, constants, positions, work, differentiate, False)
            for i in range(5):
                step.state_total[i] = (0.0 if n == 0 else step.state_total[i]) + weight * work.rates[i]
            if differentiate:
                for i in range(5):
                    for k in range(5):
                        step.rates_x[n, i, k] = work.rates_x[i, k]
                for i in range(3):  # neither inputs nor terms act on theta and h directly
                    for j in range(extra):
                        step.rates_u[n, i, j] = work.rates_u[i, j]
                    for t in range(terms):
                        step.rates_p[n, i, t] = work.rates_p[i, t]
        for i in range(5):
            step.state[i] += step.state_total[i]
        if differentiate:
            _pass_on(step, h)
            _sensitivities(step, s, substeps)


@njit_inline
def _pass_on(step: Step, h: float) -> None:
    """How a rate added at each stage moves the end of a Runge-Kutta step, and the step's own transition.

    Backwards from the last stage: W_3 = h/6 I, W_n = b_n I + c_(n+1) W_(n+1) F_(n+1), with F the Jacobians of the
    stages, b = h/6, h/3, h/3, h/6 their weights and c = 0, h/2, h/2, h how far each reaches along the one before it.
    Then Phi = I + sum W_n F_n, and a forcing f_n of the stages moves the end by sum W_n f_n: linear in the number of
    forcings, where carrying each through the stages costs the Jacobians' product for every one of them.
    """
    passed, transition = step.passed_on, step.substep
    for i in range(5):
        for k in range(5):
            transition[i, k] = 1.0 if i == k else 0.0
            passed[3, i, k] = h / 6.0 if i == k else 0.0
    for back in range(4):
        n = 3 - back
        F = step.rates_x[n]
        reach = h if n == 3 else 0.5 * h
        weight = h / 6.0 if n == 1 else h / 3.0
        for i in range(5):
            u, w, q, theta, height = passed[n, i, 0], passed[n, i, 1], passed[n, i, 2], passed[n, i, 3], passed[n, i, 4]
            # Row theta of a Jacobian holds q alone, row h all but q; nothing depends on h.
            by_u = u * F[0, 0] + w * F[1, 0] + q * F[2, 0] + height * F[4, 0]
            by_w = u * F[0, 1] + w * F[1, 1] + q * F[2, 1] + height * F[4, 1]
            by_q = u * F[0, 2] + w * F[1, 2] + q * F[2, 2] + theta * F[3, 2]
            by_theta = u * F[0, 3] + w * F[1, 3] + q * F[2, 3] + height * F[4, 3]
            transition[i, 0] += by_u
            transition[i, 1] += by_w
            transition[i, 2] += by_q
            transition[i, 3] += by_theta
            if n > 0:
                passed[n - 1, i, 0] = reach * by_u
                passed[n - 1, i, 1] = reach * by_w
                passed[n - 1, i, 2] = reach * by_q
                passed[n - 1, i, 3] = reach * by_theta
                passed[n - 1, i, 4] = 0.0
                passed[n - 1, i, i] += weight


@njit_inline
def _sensitivities(step: Step, s: int, substeps: int) -> None:
    """Carry the sensitivities over substep `s`: those so far through its transition, and what its stages add."""
    extra, terms = step.start.shape[1], step.terms.shape[1]
    if s == 0:
        for i in range(5):
            for k in range(5):
                step.transition[i, k] = step.substep[i, k]
            for j in range(extra):
                step.start[i, j] = 0.0
                step.end[i, j] = 0.0
            for t in range(terms):
                step.terms[i, t] = 0.0
    else:
        _carried(step.substep, step.transition, step.moved)
        _carried(step.substep, step.start, step.moved)
        _carried(step.substep, step.end, step.moved)
        _carried(step.substep, step.terms, step.moved)
    for n in range(4):
        fraction = (s + (0.0 if n == 0 else 1.0 if n == 3 else 0.5)) / substeps
        for i in range(5):
            for r in range(3):
                passed = step.passed_on[n, i, r]
                for j in range(extra):
                    step.start[i, j] += passed * (1.0 - fraction) * step.rates_u[n, r, j]
                    step.end[i, j] += passed * fraction * step.rates_u[n, r, j]
                for t in range(terms):
                    step.terms[i, t] += passed * step.rates_p[n, r, t]


@njit_inline
def _carried(transition: NDArray[np.float64], columns: NDArray[np.float64], moved: NDArray[np.float64]) -> None:
    """The columns (5, K) after a step with `transition` (5, 5), in place."""
    for k in range(columns.shape[1]):
        for i in range(5):
            moved[i] = 0.0
            for m in range(5):
                moved[i] += transition[i, m] * columns[m, k]
        for i in range(5):
            columns[i, k] = moved[i]
