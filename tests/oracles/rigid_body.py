"""A rigid body's equations by vectors and matrices, in any of the package's cases: plain numpy, no code of the package.

Every function is analytic in states, inputs and values as long as terms are plain products, so that the imaginary part
of an answer at x + i h is its derivative times h, to rounding: no difference is taken (complex step).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from oracles.terms import term_by_tree

Numbers = Mapping[str, complex]
Terms = Mapping[tuple[str, str], complex]

GRAVITY = 9.80665
STEP = 1e-30


@dataclass(frozen=True)
class Body:
    """Geometry and inertia, SI; `rate_airspeed` is U0 of the nondimensional rates, None for the current airspeed."""

    wing_area: float
    chord: float
    span: float
    inertia: tuple[float, float, float, float]
    """I_xx, I_yy, I_zz, I_xz; I_xx and I_zz may be zero where roll and yaw are measured."""
    rate_airspeed: float | None
    reference_airspeed: float
    incidence: float = 0.0
    arm: float = 0.0
    positions: Mapping[str, Sequence[float]] = field(default_factory=dict)


def arctan2(y: complex, x: complex) -> complex:
    """The angle of (x, y), analytic; the real part is numpy's."""
    whole = np.arctan2(np.real(y), np.real(x))
    square = np.real(x) ** 2 + np.real(y) ** 2
    return whole + 1j * (np.real(x) * np.imag(y) - np.real(y) * np.imag(x)) / square


def motion(states: Sequence[str], x: Sequence[complex], inputs: Numbers) -> dict[str, complex]:
    """u, v, w, p, q, r, phi, theta from states, and from measured channels where they are no states."""
    z = dict(zip(states, x, strict=True))
    full = {name: z.get(name, inputs.get(name, 0.0)) for name in ("p", "q", "r", "phi", "theta")}
    if "u" in z:
        plane = np.sqrt(z["u"] ** 2 + z["w"] ** 2)
        return {"u": z["u"], "w": z["w"], "v": z.get("v", plane * np.tan(inputs.get("beta", 0.0)))} | full
    plane = np.sqrt(inputs["V"] ** 2 - z["v"] ** 2)
    return {"u": plane * np.cos(inputs["alpha"]), "v": z["v"], "w": plane * np.sin(inputs["alpha"])} | full


def cross(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """The product of two vectors; numpy's, made for stacks of them, takes ten times as long."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def rotation(z: Numbers) -> NDArray[np.complex128]:
    """From body axes to north-east-down at zero heading."""
    sin, cos = np.sin(z["phi"]), np.cos(z["phi"])
    roll = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    sin, cos = np.sin(z["theta"]), np.cos(z["theta"])
    return np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]) @ roll


@dataclass(frozen=True)
class Answer:
    """Rates of the states, and what every sensor sees, which a simulation asks for at few of its steps."""

    rates: NDArray[np.complex128]
    sensors: Callable[[], dict[str, complex]]

    @property
    def outputs(self) -> dict[str, complex]:
        return self.sensors()


def lift_first(terms: Terms) -> list[tuple[tuple[str, str], complex]]:
    """The terms, those of lift before all that may hold it."""
    return sorted(terms.items(), key=lambda item: item[0][0] not in ("C_L", "C_Z"))


def answer(states: Sequence[str], x: Sequence[complex], inputs: Numbers, terms: Terms, body: Body) -> Answer:
    """The equations of motion and the sensors; inputs are channels, `gust`, `side_gust`, `thrust_change`, `cg_x` ..."""
    z = motion(states, x, inputs)
    velocity, omega = np.array([z["u"], z["v"], z["w"]]), np.array([z["p"], z["q"], z["r"]])
    wind = np.array([0.0, inputs.get("side_gust", 0.0), inputs.get("gust", 0.0)])
    u, v, w = velocity - wind
    if "u" in states and "v" not in states:  # the vane gives sideslip, whatever the air does
        v = np.sqrt(u**2 + w**2) * np.tan(inputs.get("beta", 0.0))
    speed = np.sqrt(u**2 + v**2 + w**2)
    alpha, beta = arctan2(w, u), arctan2(v, np.sqrt(u**2 + w**2))
    if "u" not in states:  # airspeed and angle of attack are measured in the air that there is
        speed, alpha, beta = inputs["V"], inputs["alpha"], np.arcsin(v / inputs["V"])
    if "v" not in states:
        beta = inputs.get("beta", 0.0)
    force = 0.5 * inputs["rho"] * speed**2 * body.wing_area
    half = 0.5 / (body.rate_airspeed or speed)
    mass, thrust = inputs["mass"], inputs["thrust"] + inputs.get("thrust_change", 0.0)
    centre = np.array([inputs.get(f"cg_{axis}", 0.0) for axis in "xyz"])
    rates = {"p_hat": z["p"] * body.span, "q_hat": z["q"] * body.chord, "r_hat": z["r"] * body.span}
    variables = {
        **z, **inputs, "alpha": alpha, "beta": beta, "thrust": thrust, "V_hat": speed / body.reference_airspeed - 1.0,
        "C_T": thrust / force, "mach": speed / inputs["speed_of_sound"], "alpha_dot_hat": 0.0,
        **{name: value * half for name, value in rates.items()},
    }  # fmt: skip
    turned, ordered = rotation(z), lift_first(terms)
    gravity = turned.T @ np.array([0.0, 0.0, GRAVITY])
    implicit = any("alpha_dot_hat" in text for _, text in terms)
    for _ in range(60):
        c = dict.fromkeys(("C_X", "C_Y", "C_Z", "C_l", "C_m", "C_n", "C_L", "C_D"), 0.0)
        for (coefficient, text), value in ordered:
            c[coefficient] += value * term_by_tree(text, variables | {"C_L": c["C_L"], "C_Z": c["C_Z"]})
        turn = np.array([[np.sin(alpha), -np.cos(alpha)], [-np.cos(alpha), -np.sin(alpha)]])
        wind_x, wind_z = turn @ np.array([c["C_L"], c["C_D"]])
        total = force * np.array([c["C_X"] + wind_x, c["C_Y"], c["C_Z"] + wind_z])
        total = total + thrust * np.array([np.cos(body.incidence), 0.0, -np.sin(body.incidence)])
        accelerated = total / mass + gravity - cross(omega, velocity)
        hat = (z["u"] * accelerated[2] - z["w"] * accelerated[0]) / (z["u"] ** 2 + z["w"] ** 2) * half * body.chord
        if not implicit:
            break
        variables["alpha_dot_hat"] = hat
    if "u" not in states:  # forces along x and z are not modelled: what they do about the centre is in the trim
        total = total * np.array([0.0, 1.0, 0.0])
    moment = force * np.array([body.span * c["C_l"], body.chord * c["C_m"], body.span * c["C_n"]])
    if "q" in states:
        moment = moment + np.array([0.0, thrust * body.arm, 0.0])
    moment = moment - cross(centre, total)
    i_xx, i_yy, i_zz, i_xz = body.inertia
    tensor = np.array([[i_xx, 0.0, -i_xz], [0.0, i_yy, 0.0], [-i_xz, 0.0, i_zz]])
    left = moment - cross(omega, tensor @ omega)
    spin = np.zeros(3, dtype=complex)
    if "p" in states:
        spin[[0, 2]] = np.linalg.solve(tensor[np.ix_([0, 2], [0, 2])], left[[0, 2]])
    if "q" in states:
        spin[1] = left[1] / i_yy
    euler = np.array(
        [
            [1.0, np.sin(z["phi"]) * np.tan(z["theta"]), np.cos(z["phi"]) * np.tan(z["theta"])],
            [0.0, np.cos(z["phi"]), -np.sin(z["phi"])],
            [0.0, np.sin(z["phi"]) / np.cos(z["theta"]), np.cos(z["phi"]) / np.cos(z["theta"])],
        ]
    ) @ omega  # fmt: skip
    whole = dict(zip("uvw", accelerated, strict=True)) | dict(zip("pqr", spin, strict=True))
    whole |= dict(zip(("phi", "theta", "psi"), euler, strict=True)) | {"h": -(turned @ velocity)[2]}
    here = dict(zip(states, x, strict=True))

    def place(name: str) -> NDArray[np.complex128]:
        return np.array(body.positions.get(name, (0.0, 0.0, 0.0))) - centre

    def sensors() -> dict[str, complex]:
        seen = {name: here.get(name, 0.0) for name in ("p", "q", "r", "phi", "theta", "psi", "h")}
        seen |= {"V": speed, **{f"{name}_dot": whole[name] for name in "pqr"}}
        vane = np.array([u, v, w]) + cross(omega, place("alpha"))
        seen["alpha"] = arctan2(vane[2], vane[0])
        at = place("beta")
        seen["beta"] = beta + (at[0] * z["r"] - at[2] * z["p"]) / speed
        for axis, name in enumerate(("a_x", "a_y", "a_z")):
            at = place(name)
            seen[name] = (total / mass + cross(spin, at) + cross(omega, cross(omega, at)))[axis]
        return seen

    return Answer(np.array([whole[name] for name in states]), sensors)


def slopes(
    function: Callable[[NDArray[np.complex128]], NDArray[np.complex128]], at: Sequence[float]
) -> NDArray[np.float64]:
    """Derivatives (outputs, arguments) by the complex step."""
    columns = []
    for place in range(len(at)):
        moved = np.array(at, dtype=complex)
        moved[place] += 1j * STEP
        columns.append(np.imag(function(moved)) / STEP)
    return np.array(columns).reshape(len(at), -1).T


def simulate(
    states: Sequence[str],
    start: Sequence[float],
    time: NDArray[np.float64],
    inputs: Mapping[str, NDArray[np.float64] | float],
    terms: Terms,
    body: Body,
) -> tuple[NDArray[np.float64], list[dict[str, complex]]]:
    """States (N, n) and what the sensors see, inputs linear between samples, each interval solved to 1e-11."""
    held = {name: np.broadcast_to(np.asarray(value, dtype=float), time.shape) for name, value in inputs.items()}

    def at(t: float) -> dict[str, complex]:
        return {name: float(np.interp(t, time, values)) for name, values in held.items()}

    path = [np.array(start, dtype=float)]
    for first, last in itertools.pairwise(time.tolist()):
        solution = solve_ivp(
            lambda t, x: np.real(answer(states, x, at(t), terms, body).rates),
            (first, last), path[-1], method="DOP853", rtol=1e-11, atol=1e-11,
        )  # fmt: skip
        path.append(solution.y[:, -1])
    return np.array(path), [answer(states, x, at(t), terms, body).outputs for t, x in zip(time, path, strict=True)]
