"""Naive, dense, textbook solutions: no code of the package, no recursion where a matrix will do.

Everything here is slow on purpose and reads like the book. Terms are given as text, models as plain dictionaries.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from oracles.rigid_body import cross
from oracles.terms import term_by_tree

Array = NDArray[np.float64]
Terms = Mapping[tuple[str, str], float]
"""(coefficient, term as text) -> value."""

GRAVITY = 9.80665
INPUTS = ("rho", "thrust", "mass", "speed_of_sound", "phi", "p", "r", "beta")
QUIET = {"thrust": 0.0, "speed_of_sound": 340.0, "phi": 0.0, "p": 0.0, "r": 0.0, "beta": 0.0}
"""Inputs of symmetric flight without thrust."""


@dataclass(frozen=True)
class Airframe:
    """Geometry and inertia, SI; `rate_airspeed` is U0 of q_hat, None for the current airspeed."""

    wing_area: float
    mean_chord: float
    I_yy: float
    rate_airspeed: float | None
    reference_airspeed: float
    thrust_incidence: float = 0.0
    thrust_z_arm: float = 0.0


def state_rates(x: Sequence[float], inputs: Mapping[str, float], terms: Terms, frame: Airframe) -> Array:
    """Rates of u, w, q, theta, h: eqs. (33)-(36) with thrust and lateral motion.

    alpha_dot_hat, which makes the equations implicit, is found by repeating them until nothing moves.
    """
    hat = 0.0
    for _ in range(500):
        rates, alpha_dot_hat = _rates_at(x, inputs, terms, frame, hat)
        if abs(alpha_dot_hat - hat) <= 1e-16 * (1.0 + abs(hat)):
            return rates
        hat = alpha_dot_hat
    raise AssertionError("the fixed point of alpha_dot_hat was not reached")


def lift_first(terms: Terms) -> list[tuple[tuple[str, str], float]]:
    """The terms, those of lift before all that may hold it."""
    return sorted(terms.items(), key=lambda item: item[0][0] not in ("C_L", "C_Z"))


def _rates_at(
    x: Sequence[float], inputs: Mapping[str, float], terms: Terms, frame: Airframe, alpha_dot_hat: float
) -> tuple[Array, float]:
    u, w, q, theta, _ = x
    given = {**QUIET, **inputs}
    phi, p, r, beta = (given[name] for name in ("phi", "p", "r", "beta"))
    speed = math.hypot(u, w) / math.cos(beta)
    v = speed * math.sin(beta)
    alpha = math.atan2(w, u)
    pressure = 0.5 * given["rho"] * speed**2
    rate_speed = frame.rate_airspeed or speed
    variables = given | {
        "alpha": alpha,
        "q_hat": q * frame.mean_chord / (2.0 * rate_speed),
        "V_hat": speed / frame.reference_airspeed - 1.0,
        "alpha_dot_hat": alpha_dot_hat,
        "C_T": given["thrust"] / (pressure * frame.wing_area),
        "mach": speed / given["speed_of_sound"],
    }
    total = dict.fromkeys(("C_X", "C_Z", "C_m", "C_L", "C_D"), 0.0)
    for (coefficient, text), value in lift_first(terms):
        total[coefficient] += value * term_by_tree(text, variables | {"C_L": total["C_L"], "C_Z": total["C_Z"]})
    lift, drag = total["C_L"], total["C_D"]
    c_x = total["C_X"] + lift * math.sin(alpha) - drag * math.cos(alpha)
    c_z = total["C_Z"] - lift * math.cos(alpha) - drag * math.sin(alpha)
    thrust, mass = given["thrust"], given["mass"]
    force_x = pressure * frame.wing_area * c_x + thrust * math.cos(frame.thrust_incidence)
    force_z = pressure * frame.wing_area * c_z - thrust * math.sin(frame.thrust_incidence)
    moment = pressure * frame.wing_area * frame.mean_chord * total["C_m"] + thrust * frame.thrust_z_arm
    # Newton in rotating axes: force/mass + gravity = dv/dt + omega x v.
    omega, velocity = np.array([p, q, r]), np.array([u, v, w])
    gravity = GRAVITY * np.array([-math.sin(theta), math.sin(phi) * math.cos(theta), math.cos(phi) * math.cos(theta)])
    acceleration = np.array([force_x, 0.0, force_z]) / mass + gravity - cross(omega, velocity)
    u_dot, w_dot = acceleration[0], acceleration[2]
    alpha_dot = (u * w_dot - w * u_dot) / (u**2 + w**2)
    climb = -(body_to_earth(phi, theta) @ velocity)[2]
    rates = np.array([u_dot, w_dot, moment / frame.I_yy, q * math.cos(phi) - r * math.sin(phi), climb])
    return rates, alpha_dot * frame.mean_chord / (2.0 * rate_speed)


def body_to_earth(phi: float, theta: float) -> Array:
    """Rotation from body axes to north-east-down at zero heading."""
    roll = np.array([[1, 0, 0], [0, math.cos(phi), -math.sin(phi)], [0, math.sin(phi), math.cos(phi)]])
    pitch = np.array([[math.cos(theta), 0, math.sin(theta)], [0, 1, 0], [-math.sin(theta), 0, math.cos(theta)]])
    return pitch @ roll


def sensed(
    x: Sequence[float],
    inputs: Mapping[str, float],
    terms: Terms,
    frame: Airframe,
    positions: Mapping[str, Sequence[float]] | None = None,
) -> Array:
    """V, alpha, q, theta, a_x, a_z, q_dot, h as the sensors at their positions see them."""
    given = {**QUIET, **inputs}
    at = {name: np.array((positions or {}).get(name, (0.0, 0.0, 0.0))) for name in ("alpha", "a_x", "a_z")}
    u, w, q, theta, h = x
    phi = given["phi"]
    rates = state_rates(x, inputs, terms, frame)
    speed = math.hypot(u, w) / math.cos(given["beta"])
    velocity = np.array([u, speed * math.sin(given["beta"]), w])
    omega = np.array([given["p"], q, given["r"]])
    spin = np.array([0.0, rates[2], 0.0])
    vane = velocity + cross(omega, at["alpha"])
    gravity = body_to_earth(phi, theta).T @ np.array([0.0, 0.0, GRAVITY])
    centre = np.array([rates[0], 0.0, rates[1]]) + cross(omega, velocity) - gravity

    def specific_force(place: Array) -> Array:
        return centre + cross(spin, place) + cross(omega, cross(omega, place))

    return np.array(
        [
            speed,
            math.atan2(vane[2], vane[0]),
            q,
            theta,
            specific_force(at["a_x"])[0],
            specific_force(at["a_z"])[2],
            rates[2],
            h,
        ]
    )


def simulate(
    start: Sequence[float],
    time: Array,
    inputs: Mapping[str, Array | float],
    terms: Terms,
    frame: Airframe,
    positions: Mapping[str, Sequence[float]] | None = None,
) -> tuple[Array, Array]:
    """States (N, 5) and outputs (N, 8), inputs linear between samples, each interval solved to 1e-12."""
    held = {name: np.broadcast_to(np.asarray(value, dtype=float), time.shape) for name, value in inputs.items()}

    def at(t: float) -> dict[str, float]:
        return {name: float(np.interp(t, time, values)) for name, values in held.items()}

    states = [np.array(start, dtype=float)]
    for first, last in itertools.pairwise(time):
        # Corners of the input lie at the samples, so no step may cross one.
        solution = solve_ivp(
            lambda t, x: state_rates(x, at(t), terms, frame),
            (first, last),
            states[-1],
            method="DOP853",
            rtol=1e-12,
            atol=1e-12,
        )
        states.append(solution.y[:, -1])
    outputs = [sensed(x, at(t), terms, frame, positions) for t, x in zip(time, states, strict=True)]
    return np.array(states), np.array(outputs)


def central_difference(function: Callable[[Array], Array], at: Array, steps: Array) -> Array:
    """Slopes of a function, (outputs, arguments), fourth order in the steps."""
    columns = []
    for i, step in enumerate(steps):
        shift = np.zeros_like(at)
        shift[i] = step
        near = function(at + shift) - function(at - shift)
        far = function(at + 2.0 * shift) - function(at - 2.0 * shift)
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.array(columns).T


@dataclass(frozen=True)
class DenseGaussian:
    """-2 ln L without its constant of a Gaussian vector, and the Fisher information of the mean's parameters."""

    squares: float
    log_determinant: float
    information: Array
    gradient: Array


def dense_gaussian(residual: Array, covariance: Array, mean_columns: Array) -> DenseGaussian:
    """All samples stacked, one covariance matrix, one Cholesky factor."""
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, residual)
    columns = np.linalg.solve(factor, mean_columns)
    return DenseGaussian(
        float(white @ white), 2.0 * float(np.log(np.diag(factor)).sum()), columns.T @ columns, columns.T @ white
    )


def van_loan(F: Array, density: Array, step: float) -> tuple[Array, Array]:
    """Transition matrix over a step, and the covariance that white noise of a density adds in it."""
    n = F.shape[0]
    block = expm(np.block([[-F, density], [np.zeros((n, n)), F.T]]) * step)
    transition = block[n:, n:].T
    return transition, transition @ block[:n, n:]
