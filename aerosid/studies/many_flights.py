"""The equations of motion written out once more, on arrays of many flights at once, for bounds and their tests.

Nothing here is shared with the estimators.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, input_columns_of, loads_of
from aerosid.flight_model.terms import Term

FloatArray = NDArray[np.float64]

LONGEST_STEP = 0.01
"""s, of the fourth-order Runge-Kutta integration."""

_GRAVITY = 9.80665


def fly_many(
    model: AerodynamicModel, manoeuvre: Manoeuvre, values: FloatArray, states: FloatArray, extra: FloatArray
) -> FloatArray:
    """Outputs (N, m, K) of K flights at once, in the order of the longitudinal case's, open loop.

    Parameters
    ----------
    model : AerodynamicModel
        Terms and constants.
    manoeuvre : Manoeuvre
        Time, the fixed inputs and the sensors' positions.
    values : ndarray, shape (T, K)
        Of the terms in each flight.
    states : ndarray, shape (n, K)
        The initial ones.
    extra : ndarray, shape (N, E, K)
        The extra inputs of each flight, linear between samples.
    """
    return _flown(model, manoeuvre, values, states, extra)[0]


def fly_states(
    model: AerodynamicModel, manoeuvre: Manoeuvre, values: FloatArray, state: FloatArray, extra: FloatArray
) -> FloatArray:
    """States u, w, q, theta, h (n, N) of one flight: terms' values (T,), initial state (n,), extra inputs (N, E)."""
    return _flown(model, manoeuvre, values[:, None], state[:, None], extra[:, :, None])[1][:, :, 0].T


def _flown(
    model: AerodynamicModel, manoeuvre: Manoeuvre, values: FloatArray, states: FloatArray, extra: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Outputs (N, m, K) and states (N, n, K)."""
    flight = manoeuvre.flight
    time, fixed = flight.time, flight.inputs[:, : len(input_columns_of(LONGITUDINAL))]
    x = np.array(states, dtype=np.float64)
    outputs = np.empty((time.size, len(LONGITUDINAL.outputs), x.shape[1]))
    passed = np.empty((time.size, *x.shape))
    for n in range(time.size):
        passed[n] = x
        outputs[n] = observed(model, x, values, fixed[n], extra[n], flight.positions)
        if n + 1 < time.size:
            x = stepped(model, x, values, (fixed[n], fixed[n + 1]), (extra[n], extra[n + 1]), time[n + 1] - time[n])
    return outputs, passed


def steps_in(interval: FloatArray | float) -> NDArray[np.int64]:
    """Integration steps in an interval between samples [s], or in each of several."""
    return np.asarray(np.ceil(np.asarray(interval) / LONGEST_STEP - 1e-9), dtype=np.int64)


def stepped(
    model: AerodynamicModel,
    x: FloatArray,
    values: FloatArray,
    fixed: tuple[FloatArray, FloatArray],
    extra: tuple[FloatArray, FloatArray],
    interval: FloatArray | float,
) -> FloatArray:
    """States (n, K) one sample later.

    Parameters
    ----------
    x : ndarray, shape (n, K)
    values : ndarray, shape (T, K) or (T, 1)
    fixed : pair of ndarray, shape (f,) or (f, K)
        The f leading inputs at both samples.
    extra : pair of ndarray, shape (E, K)
        The extra inputs at both.
    interval : float, or ndarray of shape (K,)
        s.
    """
    steps = int(np.max(steps_in(interval)))
    h = interval / steps
    names = model.extra_columns

    def rates(at: float, x: FloatArray) -> FloatArray:
        held = (1.0 - at) * fixed[0] + at * fixed[1]
        moved = (1.0 - at) * extra[0] + at * extra[1]
        return _rates(model, x, values, held, dict(zip(names, moved, strict=True)))[0]

    for s in range(steps):
        k1 = rates(s / steps, x)
        k2 = rates((s + 0.5) / steps, x + 0.5 * h * k1)
        k3 = rates((s + 0.5) / steps, x + 0.5 * h * k2)
        k4 = rates((s + 1.0) / steps, x + h * k3)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return x


def _rates(
    model: AerodynamicModel, x: FloatArray, values: FloatArray, fixed: FloatArray, extra: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """State rates (n, K) and specific force along x and z (2, K): (33)-(36) with the measured lateral motion."""
    u, w, q, theta = x[0], x[1], x[2], x[3]
    rho, thrust, mass, sound, phi, p, r, beta = fixed
    constants = model.constants
    v = np.hypot(u, w) * np.tan(beta)
    speed = np.sqrt(u**2 + v**2 + w**2)
    alpha = np.arctan2(w, u)
    force = 0.5 * rho * speed**2 * constants.wing_area
    half_chord = constants.mean_chord / (2.0 * (constants.airspeed_of_rates or speed))
    variables = {
        "alpha": alpha,
        "q_hat": q * half_chord,
        "V_hat": speed / constants.airspeed_of_V_hat - 1.0,
        "alpha_dot_hat": np.zeros_like(u),
        "C_T": thrust / force,
        "mach": speed / sound,
        "rho": rho, "thrust": thrust, "mass": mass, "phi": phi, "p": p, "r": r, "beta": beta,
        **extra,
    }  # fmt: skip
    along, down = np.cos(constants.thrust_incidence), -np.sin(constants.thrust_incidence)
    implicit = any("alpha_dot_hat" in term.variables for _, term in model.entries)
    # alpha_dot acts through terms that are small beside inertia: each pass gains two digits or more.
    for _ in range(12 if implicit else 1):
        c_x, c_z, c_m = _coefficients(model, values, variables, alpha)
        a_x = (force * c_x + thrust * along) / mass
        a_z = (force * c_z + thrust * down) / mass
        du = a_x - _GRAVITY * np.sin(theta) - q * w + r * v
        dw = a_z + _GRAVITY * np.cos(theta) * np.cos(phi) + q * u - p * v
        variables["alpha_dot_hat"] = (u * dw - w * du) / (u**2 + w**2) * half_chord
    dq = (force * constants.mean_chord * c_m + thrust * constants.thrust_z_arm) / constants.I_yy
    dtheta = q * np.cos(phi) - r * np.sin(phi)
    dh = u * np.sin(theta) - v * np.sin(phi) * np.cos(theta) - w * np.cos(phi) * np.cos(theta)
    return np.stack([du, dw, dq, dtheta, dh]), np.stack([a_x, a_z])


def _coefficients(
    model: AerodynamicModel, values: FloatArray, variables: Mapping[str, FloatArray | float], alpha: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """C_X, C_Z, C_m (K,), lift and drag turned into body axes."""
    total = {name: np.zeros(alpha.size) for name in loads_of(LONGITUDINAL)}
    for (coefficient, term), value in zip(model.entries, values, strict=True):
        total[coefficient] += value * _term(term, variables)
    sin, cos = np.sin(alpha), np.cos(alpha)
    c_x = total["C_X"] + total["C_L"] * sin - total["C_D"] * cos
    c_z = total["C_Z"] - total["C_L"] * cos - total["C_D"] * sin
    return c_x, c_z, total["C_m"]


def _term(term: Term, variables: Mapping[str, FloatArray | float]) -> FloatArray | float:
    product: FloatArray | float = 1.0
    for factor in term.factors:
        x = variables[factor.variable]
        if factor.shape == "abs":
            x = np.abs(x)
        elif factor.shape == "pos":
            x = np.maximum(x - factor.offset, 0.0)
        product = product * x**factor.power
    return product


def observed(
    model: AerodynamicModel,
    x: FloatArray,
    values: FloatArray,
    fixed: FloatArray,
    extra: FloatArray,
    positions: FloatArray,
) -> FloatArray:
    """What the sensors at their positions see of states (n, K), (m, K); arguments as those of `stepped`."""
    rates, (a_x, a_z) = _rates(model, x, values, fixed, dict(zip(model.extra_columns, extra, strict=True)))
    u, w, q, theta, h = x
    lateral = dict(zip(input_columns_of(LONGITUDINAL), fixed, strict=True))
    p, r, beta = lateral["p"], lateral["r"], lateral["beta"]
    v = np.hypot(u, w) * np.tan(beta)
    vane, axial, normal = (positions[LONGITUDINAL.outputs.index(name)] for name in ("alpha", "a_x", "a_z"))
    wind_u = u + q * vane[2] - r * vane[1]
    wind_w = w + p * vane[1] - q * vane[0]
    # Specific force at a place: that of the centre of gravity, and omega' x place + omega x (omega x place).
    f_x = a_x + rates[2] * axial[2] + q * (p * axial[1] - q * axial[0]) - r * (r * axial[0] - p * axial[2])
    f_z = a_z - rates[2] * normal[0] + p * (r * normal[0] - p * normal[2]) - q * (q * normal[2] - r * normal[1])
    return np.stack([np.sqrt(u**2 + v**2 + w**2), np.arctan2(wind_w, wind_u), q, theta, f_x, f_z, rates[2], h])
