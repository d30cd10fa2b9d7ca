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
from aerosid.flight_model.terms import VARIABLE_COUNT, TermTable, fill_values, pass_slopes, value_count

GRAVITY = 9.80665
STATES = ("u", "w", "q", "theta", "h")
OUTPUTS = ("V", "alpha", "q", "theta", "a_x", "a_z", "q_dot", "h")
STATE_COUNT = 5
OUTPUT_COUNT = 8
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
    `values` as `TermTable` orders them, the variables first; `coefficients` (5); `slopes` (values, 5) of the
    coefficients with respect to the variables.
    """

    rates: NDArray[np.float64]
    rates_x: NDArray[np.float64]
    rates_u: NDArray[np.float64]
    rates_p: NDArray[np.float64]
    outputs: NDArray[np.float64]
    outputs_x: NDArray[np.float64]
    outputs_u: NDArray[np.float64]
    outputs_p: NDArray[np.float64]
    values: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    slopes: NDArray[np.float64]


@njit
def make_workspace(extra_inputs: int, table: TermTable) -> Workspace:
    """A `Workspace` for `extra_inputs` inputs past the fixed ones and the terms of `table`."""
    values, terms = value_count(table, FIXED_INPUTS + extra_inputs), table.coefficient.shape[0]
    return Workspace(
        np.zeros(5),
        np.zeros((5, 5)),
        np.zeros((5, extra_inputs)),
        np.zeros((5, terms)),
        np.zeros(8),
        np.zeros((8, 5)),
        np.zeros((8, extra_inputs)),
        np.zeros((8, terms)),
        np.zeros(values),
        np.zeros(5),
        np.zeros((values, 5)),
    )


@njit_inline
def _sum_coefficients(theta: NDArray[np.float64], table: TermTable, work: Workspace, differentiate: bool) -> None:
    """Sum value * term into the five coefficients, and their slopes with respect to every variable."""
    c, slopes, values = work.coefficients, work.slopes, work.values
    acting = theta.shape[0]
    while acting > 0 and theta[acting - 1] == 0.0:
        acting -= 1  # candidates: only their derivative is wanted
    products = table.reach[acting - 1] if acting > 0 else 0
    fill_values(table, table.left.shape[0] if differentiate else products, values)
    for row in range(5):
        c[row] = 0.0
    for t in range(acting):
        if theta[t] != 0.0:
            c[table.coefficient[t]] += theta[t] * values[table.value[t]]
    if differentiate:
        for slot in range(values.shape[0] - table.left.shape[0] + products):
            for row in range(5):
                slopes[slot, row] = 0.0
        for t in range(acting):
            slopes[table.value[t], table.coefficient[t]] += theta[t]
        pass_slopes(table, products, values, slopes)


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
    alpha_dot_used = table.uses_alpha_dot > 0
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

    variables = work.values
    variables[0] = np.arctan2(w_b, u_b)
    variables[1] = q * half_chord
    variables[2] = speed / constants.airspeed_of_V_hat - 1.0
    variables[3] = 0.0
    variables[4] = thrust / reference_force
    variables[5] = speed / sound
    for j in range(u.shape[0]):
        variables[VARIABLE_COUNT + j] = u[j]
    variables[VARIABLE_COUNT + 1] = thrust

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
    c_v = work.slopes
    slope = 0.0
    passes = 3 if alpha_dot_used else 1
    f_u = 0.0
    f_w = 0.0
    for i in range(passes):
        _sum_coefficients(theta, table, work, differentiate or alpha_dot_used)
        f_u = force * (c[0] + c[3] * sin_alpha - c[4] * cos_alpha) + thrust_x + inertial_u
        f_w = force * (c[1] - c[3] * cos_alpha - c[4] * sin_alpha) + thrust_z + inertial_w
        if alpha_dot_used:
            a_u = force * (c_v[3, 0] + c_v[3, 3] * sin_alpha - c_v[3, 4] * cos_alpha)
            a_w = force * (c_v[3, 1] - c_v[3, 3] * cos_alpha - c_v[3, 4] * sin_alpha)
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
    c, c_v = work.coefficients, work.slopes
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
            d_q_hat -= work.values[1] * d_speed / speed
        d_v_hat = d_speed / constants.airspeed_of_V_hat
        d_c_t = -2.0 * work.values[4] * d_speed / speed
        d_mach = work.values[5] * d_speed / speed
        d_x = c_x_alpha * d_alpha
        d_z = c_z_alpha * d_alpha
        d_m = 0.0
        for row in range(5):
            d_c = (
                c_v[0, row] * d_alpha
                + c_v[1, row] * d_q_hat
                + c_v[2, row] * d_v_hat
                + c_v[4, row] * d_c_t
                + c_v[5, row] * d_mach
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
        slot = VARIABLE_COUNT + FIXED_INPUTS + j
        f_e[0, j] = force * (c_v[slot, 0] + c_v[slot, 3] * sin_alpha - c_v[slot, 4] * cos_alpha)
        f_e[1, j] = force * (c_v[slot, 1] - c_v[slot, 3] * cos_alpha - c_v[slot, 4] * sin_alpha)
        f_e[2, j] = moment * c_v[slot, 2]
    if constants.thrust_change >= 0:
        j, slot = constants.thrust_change, VARIABLE_COUNT + 1
        by_x = c_v[4, 0] + c_v[4, 3] * sin_alpha - c_v[4, 4] * cos_alpha
        by_z = c_v[4, 1] - c_v[4, 3] * cos_alpha - c_v[4, 4] * sin_alpha
        f_e[0, j] = (by_x + np.cos(constants.thrust_incidence)) / mass
        f_e[0, j] += force * (c_v[slot, 0] + c_v[slot, 3] * sin_alpha - c_v[slot, 4] * cos_alpha)
        f_e[1, j] = (by_z - np.sin(constants.thrust_incidence)) / mass
        f_e[1, j] += force * (c_v[slot, 1] - c_v[slot, 3] * cos_alpha - c_v[slot, 4] * sin_alpha)
        f_e[2, j] = (constants.mean_chord * c_v[4, 2] + constants.thrust_z_arm) / constants.I_yy
        f_e[2, j] += moment * c_v[slot, 2]
    if shifted:
        for j in range(f_e.shape[1]):
            f_e[2, j] += ahead * f_e[1, j] - below * f_e[0, j]
        if constants.cg_x >= 0:
            f_e[2, constants.cg_x] += mass / constants.I_yy * specific_z
        if constants.cg_z >= 0:
            f_e[2, constants.cg_z] -= mass / constants.I_yy * specific_x
    for t in range(f_p.shape[1]):
        row, value = table.coefficient[t], work.values[table.value[t]]
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
        a_u = force * (c_v[3, 0] + c_v[3, 3] * sin_alpha - c_v[3, 4] * cos_alpha)
        a_w = force * (c_v[3, 1] - c_v[3, 3] * cos_alpha - c_v[3, 4] * sin_alpha)
        a_q = moment * c_v[3, 2] + ahead * a_w - below * a_u
        by_f_u, by_f_w = -w_b / square * half_chord, u_b / square * half_chord
        inverse = 1.0 / (1.0 - slope)
        hat = work.values[3]
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
