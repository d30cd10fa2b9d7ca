"""Independent equations of motion on arrays of many flights at once, for bounds and their tests.

No code is shared with the estimators.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import COEFFICIENTS, Axes, input_columns_of
from aerosid.flight_model.terms import LIFT, Term

FloatArray = NDArray[np.float64]

LONGEST_STEP = 0.01
"""Numerical: s, maximum step of the fourth-order Runge-Kutta integration."""

_GRAVITY = 9.80665
"""Standard: acceleration of free fall, m/s^2, ISO 80000-3; defined again, since these equations share no code with the
flight model."""


_STEP = {"u": 1e-3, "v": 1e-3, "w": 1e-3, "h": 1e-2}
"""Numerical: m/s and m, steps of differences by a state; of rates and angles 1e-6 rad/s and rad."""


def state_steps(axes: Axes) -> tuple[float, ...]:
    """Steps of the states of a case for central differences, SI."""
    return tuple(_STEP.get(name, 1e-6) for name in axes.integrated)


def fly_many(
    model: AerodynamicModel, manoeuvre: Manoeuvre, values: FloatArray, states: FloatArray, extra: FloatArray
) -> FloatArray:
    """Outputs (N, m, K) of K simultaneous flights, in the order of the case's outputs, open loop.

    Parameters
    ----------
    model : AerodynamicModel
        Terms and constants.
    manoeuvre : Manoeuvre
        Time, the fixed inputs and the sensors' positions.
    values : ndarray, shape (T, K)
        Values of the terms in each flight.
    states : ndarray, shape (n, K)
        Initial states.
    extra : ndarray, shape (N, E, K)
        The extra inputs of each flight, linear between samples.
    """
    return _flown(model, manoeuvre, values, states, extra)[0]


def fly_states(
    model: AerodynamicModel, manoeuvre: Manoeuvre, values: FloatArray, state: FloatArray, extra: FloatArray
) -> FloatArray:
    """States (n, N) of one flight: terms' values (T,), initial state (n,), extra inputs (N, E)."""
    return _flown(model, manoeuvre, values[:, None], state[:, None], extra[:, :, None])[1][:, :, 0].T


def _flown(
    model: AerodynamicModel, manoeuvre: Manoeuvre, values: FloatArray, states: FloatArray, extra: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Outputs (N, m, K) and states (N, n, K)."""
    flight = manoeuvre.flight
    time, fixed = flight.time, flight.inputs[:, : len(input_columns_of(model.axes))]
    x = np.array(states, dtype=np.float64)
    outputs = np.empty((time.size, len(model.axes.outputs), x.shape[1]))
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


Vector = tuple[FloatArray | float, FloatArray | float, FloatArray | float]


@dataclass(frozen=True)
class _Instant:
    """Motion and loads, each (K,) or one number for all flights; SI, body axes.

    `velocity` u, v, w; `omega` p, q, r; `speed`, `alpha`, `beta` of the air; `felt` specific force at the centre of
    gravity, of the coefficients that are modelled; `spin` angular acceleration of the rates that are integrated.
    """

    velocity: Vector
    omega: Vector
    speed: FloatArray | float
    alpha: FloatArray | float
    beta: FloatArray | float
    felt: Vector
    spin: Vector


def _rates(
    model: AerodynamicModel, x: FloatArray, values: FloatArray, fixed: FloatArray, extra: Mapping[str, FloatArray]
) -> tuple[FloatArray, _Instant]:
    """State rates (n, K) of the model's case, and the loads; motion that is not integrated is measured."""
    given = dict(zip(input_columns_of(model.axes), fixed, strict=True))
    z = dict(zip(model.axes.integrated, x, strict=True))
    p, q, r, phi, theta = (z.get(name, given.get(name, 0.0)) for name in ("p", "q", "r", "phi", "theta"))
    (u, v, w), speed, alpha, beta = _air(z, given)
    rho, thrust, mass = given["rho"], given["thrust"], given["mass"]
    constants = model.constants
    force = 0.5 * rho * speed**2 * constants.wing_area
    half = 0.5 / (constants.airspeed_of_rates or speed)
    variables = {
        **given,
        **z,
        "alpha": alpha,
        "beta": beta,
        "p_hat": p * constants.span * half,
        "q_hat": q * constants.mean_chord * half,
        "r_hat": r * constants.span * half,
        "V_hat": speed / constants.airspeed_of_V_hat - 1.0,
        "alpha_dot_hat": np.zeros(x.shape[1]),
        "C_T": thrust / force,
        "mach": speed / given["speed_of_sound"],
        **extra,
    }
    pitching, rolling = "u" in z, "v" in z
    along, down = np.cos(constants.thrust_incidence), -np.sin(constants.thrust_incidence)
    implicit = pitching and any("alpha_dot_hat" in term.variables for _, term in model.entries)
    # alpha_dot acts through terms that are small compared with inertia: each pass gains two digits or more.
    for _ in range(12 if implicit else 1):
        c = _coefficients(model, values, variables, alpha)
        a_x = (force * c["C_X"] + thrust * along) / mass if pitching else 0.0
        a_y = force * c["C_Y"] / mass if rolling else 0.0
        a_z = (force * c["C_Z"] + thrust * down) / mass if pitching else 0.0
        du = a_x - _GRAVITY * np.sin(theta) - q * w + r * v
        dw = a_z + _GRAVITY * np.cos(theta) * np.cos(phi) + q * u - p * v
        variables["alpha_dot_hat"] = (u * dw - w * du) / (u**2 + w**2) * constants.mean_chord * half
    dv = a_y + _GRAVITY * np.sin(phi) * np.cos(theta) + p * w - r * u
    i_xx, i_yy, i_zz, i_xz = constants.I_xx, constants.I_yy, constants.I_zz, constants.I_xz
    dp, dr, dq = 0.0, 0.0, 0.0
    if rolling:
        roll = force * constants.span * c["C_l"] + i_xz * p * q - (i_zz - i_yy) * q * r
        yaw = force * constants.span * c["C_n"] - i_xz * q * r - (i_yy - i_xx) * p * q
        tensor = i_xx * i_zz - i_xz**2
        dp, dr = (i_zz * roll + i_xz * yaw) / tensor, (i_xz * roll + i_xx * yaw) / tensor
    if pitching:
        moment = force * constants.mean_chord * c["C_m"] + thrust * constants.thrust_z_arm
        dq = (moment - (i_xx - i_zz) * p * r - i_xz * (p**2 - r**2)) / i_yy
    turn = q * np.sin(phi) + r * np.cos(phi)
    whole = {
        "u": du, "v": dv, "w": dw, "p": dp, "q": dq, "r": dr,
        "phi": p + turn * np.tan(theta),
        "theta": q * np.cos(phi) - r * np.sin(phi),
        "psi": turn / np.cos(theta),
        "h": u * np.sin(theta) - v * np.sin(phi) * np.cos(theta) - w * np.cos(phi) * np.cos(theta),
    }  # fmt: skip
    rates = np.stack([np.broadcast_to(whole[name], x.shape[1:]) for name in model.axes.integrated])
    return rates, _Instant((u, v, w), (p, q, r), speed, alpha, beta, (a_x, a_y, a_z), (dp, dq, dr))


def _air(
    z: Mapping[str, FloatArray], given: Mapping[str, FloatArray]
) -> tuple[Vector, FloatArray | float, FloatArray | float, FloatArray | float]:
    """u, v, w, airspeed, angle of attack and sideslip from those of them that are integrated and those measured."""
    if "u" not in z:
        speed, alpha, v = given["V"], given["alpha"], z["v"]
        plane = np.sqrt(speed**2 - v**2)
        return (plane * np.cos(alpha), v, plane * np.sin(alpha)), speed, alpha, np.arctan2(v, plane)
    u, w = z["u"], z["w"]
    plane = np.hypot(u, w)
    v = z["v"] if "v" in z else plane * np.tan(given["beta"])
    beta = np.arctan2(v, plane) if "v" in z else given["beta"]
    return (u, v, w), np.sqrt(u**2 + v**2 + w**2), np.arctan2(w, u), beta


def _coefficients(
    model: AerodynamicModel,
    values: FloatArray,
    variables: Mapping[str, FloatArray | float],
    alpha: FloatArray | float,
) -> dict[str, FloatArray | float]:
    """The coefficients (K,) in body axes, lift and drag converted; zero where they are not modelled."""
    total: dict[str, FloatArray | float] = dict.fromkeys(COEFFICIENTS, 0.0)
    known = {**variables, **{name: total[name] for name in LIFT}}
    for lift in (True, False):
        for (coefficient, term), value in zip(model.entries, values, strict=True):
            if (coefficient in LIFT) is lift:
                total[coefficient] = total[coefficient] + value * _term(term, known)
        known |= {name: total[name] for name in LIFT}
    sin, cos = np.sin(alpha), np.cos(alpha)
    total["C_X"] = total["C_X"] + total["C_L"] * sin - total["C_D"] * cos
    total["C_Z"] = total["C_Z"] - total["C_L"] * cos - total["C_D"] * sin
    return total


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
    """The readings (m, K) of the sensors at their positions for states (n, K); arguments as for `stepped`."""
    _, now = _rates(model, x, values, fixed, dict(zip(model.extra_columns, extra, strict=True)))
    place = dict(zip(model.axes.outputs, positions, strict=True))
    z = dict(zip(model.axes.integrated, x, strict=True))
    p, _, r = now.omega
    seen = {**z, "V": now.speed, **{f"{name}_dot": rate for name, rate in zip("pqr", now.spin, strict=True)}}
    if "alpha" in place:
        wind = [a + b for a, b in zip(now.velocity, _cross(now.omega, place["alpha"]), strict=True)]
        seen["alpha"] = np.arctan2(wind[2], wind[0])
    if "beta" in place:
        seen["beta"] = now.beta + (place["beta"][0] * r - place["beta"][2] * p) / now.speed
    for axis, name in enumerate(("a_x", "a_y", "a_z")):
        if name in place:
            # At the centre of gravity, and omega' x place + omega x (omega x place).
            turned = _cross(now.omega, _cross(now.omega, place[name]))
            seen[name] = now.felt[axis] + _cross(now.spin, place[name])[axis] + turned[axis]
    return np.stack([np.broadcast_to(seen[name], x.shape[1:]) for name in model.axes.outputs])


def _cross(a: Sequence[FloatArray | float], b: Sequence[FloatArray | float]) -> Vector:
    """The vector product of two triples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
