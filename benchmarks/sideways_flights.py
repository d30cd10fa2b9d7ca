"""Simulated lateral flights in calm air and side gusts, by equations that share no code with the package.

Rolling, yawing and sideslipping motion at constant airspeed and pitch angle with I_xz, by the classical Runge-Kutta
method; aileron and rudder steps of random lengths and sizes, a slow pilot that holds bank through the recorded aileron,
and an exponentially correlated wind from the side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.logs.flight_log import FlightLog
from benchmarks.planted_aircraft import declared_derivatives

Array = NDArray[np.float64]
State = tuple[float, float, float, float, float]

G = 9.80665
SUBSTEP = 0.01
"""s, at most."""

UNITS = {"V": "m/s", "alpha": "rad", "beta": "rad", "p": "rad/s", "q": "rad/s", "r": "rad/s", "phi": "rad"}
UNITS |= {"theta": "rad", "psi": "rad", "a_y": "m/s^2", "delta_a": "rad", "delta_r": "rad"}
NOISE = {"V": 0.1, "alpha": 1e-3, "beta": 1e-3, "p": 1.2e-3, "q": 8e-4, "r": 8e-4, "phi": 1e-3, "theta": 8e-4}
NOISE |= {"psi": 1.5e-3, "a_y": 0.02, "delta_a": 2e-4, "delta_r": 2e-4}
HOLD = 0.12
"""Aileron for a bank, 1: the pilot's gain."""


@dataclass(frozen=True)
class SideBody:
    """An aircraft: geometry and inertia, SI, airspeed m/s, and its derivatives."""

    name: str
    wing_area: float
    span: float
    chord: float
    mass: float
    inertia: tuple[float, float, float, float]
    airspeed: float
    density: float
    terms: dict[tuple[str, str], float]


def _terms(side: tuple[float, ...], roll: tuple[float, ...], yaw: tuple[float, ...]) -> dict[tuple[str, str], float]:
    names = ("1", "beta", "p_hat", "r_hat", "delta_a", "delta_r")
    rows = (("C_Y", side), ("C_l", roll), ("C_n", yaw))
    return {(c, name): value for c, values in rows for name, value in zip(names, values, strict=True)}


BODIES = (
    SideBody(
        "commuter", 38.0, 20.0, 1.9, 4800.0, (29000.0, 34000.0, 56000.0, 1400.0), 75.0, 1.05,
        _terms((0.001, -0.82, -0.05, 0.7, 0.02, 0.28), (0.0, -0.11, -0.53, 0.18, -0.2, 0.03),
               (0.0, 0.09, -0.05, -0.19, 0.004, -0.12)),
    ),
    SideBody(
        "jet trainer", 17.0, 9.5, 2.0, 3600.0, (4200.0, 16500.0, 19500.0, 700.0), 150.0, 0.82,
        _terms((-0.001, -0.9, 0.03, 0.5, 0.0, 0.2), (0.0001, -0.075, -0.34, 0.1, -0.12, 0.02),
               (0.0, 0.13, -0.03, -0.17, -0.006, -0.08)),
    ),
    SideBody(
        "unmanned", 1.1, 3.0, 0.37, 22.0, (2.6, 2.2, 4.5, 0.12), 28.0, 1.15,
        _terms((0.0, -0.35, -0.02, 0.25, 0.03, 0.12), (0.0, -0.08, -0.48, 0.14, -0.15, 0.012),
               (0.0, 0.065, -0.04, -0.11, -0.004, -0.06)),
    ),
)  # fmt: skip


def aircraft_of(body: SideBody, off: float, generator: np.random.Generator) -> Aircraft:
    """The aircraft file, its derivatives `off` by a share at random."""
    i_xx, i_yy, i_zz, i_xz = body.inertia
    lines = [
        "schema = 1",
        f'aircraft = {{ name = "{body.name}", source = "benchmarks" }}',
        f"reference = {{ wing_area = {body.wing_area}, mean_chord = {body.chord}, span = {body.span} }}",
        f"mass = {{ mass = {body.mass}, I_xx = {i_xx}, I_yy = {i_yy}, I_zz = {i_zz}, I_xz = {i_xz} }}",
        f"air = {{ density = {body.density} }}",
    ]
    lines += declared_derivatives(body.terms, ("C_Y", "C_l", "C_n"), off, generator)
    return aircraft_from_text("\n".join(lines) + "\n", f"{body.name}.toml", "0" * 64)


def flown(
    name: str, body: SideBody, seed: int, *, gust: float, interval: float, seconds: float, rotary: bool = False
) -> FlightLog:
    """The recorded flight; `gust`: standard deviation of the wind from the side, m/s.

    `rotary`: whether it varies along the aircraft, and one as large from below across it (MIL-F-8785C).
    """
    generator = np.random.default_rng(seed)
    time = interval * np.arange(int(seconds / interval))
    aileron, rudder = (_steps(time, size, generator) for size in (0.08, 0.06))
    wind = first_order_wind(gust, time, body.airspeed, generator, 180.0)
    alpha = float(generator.uniform(0.01, 0.06))
    turning = np.zeros((2, time.size))
    if rotary:
        turning = np.stack([_gust_in_roll(body, gust, time, seed), _gust_in_yaw(body, wind, interval)])
    rows, inputs = _simulated(body, time, aileron, rudder, np.vstack([wind, turning]).T, alpha)
    seen = {"V": np.full(time.size, body.airspeed), "alpha": np.full(time.size, alpha), **rows, **inputs}
    seen["theta"] = np.full(time.size, alpha)
    memory = float(generator.uniform(0.0, 0.5))
    channels = {}
    for channel in UNITS:
        shocks = np.sqrt(1.0 - memory**2) * generator.standard_normal(time.size)
        colour = lfilter([1.0], [1.0, -memory], shocks) if not channel.startswith("delta") else shocks
        channels[channel] = np.asarray(seen[channel] + NOISE[channel] * colour)
    return FlightLog(name, time, channels, dict(UNITS))


def _steps(time: Array, size: float, generator: np.random.Generator) -> Array:
    """Steps of random length and size with rests between, rad; about half a second for a fast aircraft to two."""
    out, at = np.zeros(time.size), float(generator.uniform(0.8, 2.5))
    while at < time[-1] - 2.0:
        width, level = float(generator.uniform(0.4, 1.4)), size * float(generator.uniform(0.5, 1.0))
        for sign in (1.0, -1.0):
            out[(time >= at) & (time < at + width)] = sign * level
            at += width
        at += float(generator.uniform(1.0, 4.0))
    return out


def first_order_wind(
    sigma: float, time: Array, airspeed: float, generator: np.random.Generator, length: float
) -> Array:
    """A first-order Gauss-Markov wind of a scale length, m, at the samples, m/s."""
    kept = math.exp(-airspeed * float(time[1] - time[0]) / length)
    shocks = sigma * math.sqrt(1.0 - kept**2) * generator.standard_normal(time.size)
    shocks[0] = sigma * generator.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -kept], shocks))


def _gust_in_yaw(body: SideBody, wind: Array, interval: float) -> Array:
    """r_g = -v_g'/V behind 1/(1 + s 3b/(pi V)), rad/s: (the average of v_g less v_g)/(V times that time)."""
    time = 3.0 * body.span / (math.pi * body.airspeed)
    keep = math.exp(-interval / time)
    average = wind[0] + lfilter([1.0 - keep], [1.0, -keep], wind - wind[0])
    return np.asarray((average - wind) / (body.airspeed * time))


def _gust_in_roll(body: SideBody, sigma: float, time: Array, seed: int) -> Array:
    """p_g of the variance and memory of its Dryden spectrum, scale length 180 m, rad/s."""
    share = 0.8 * math.pi**2 / (8.0 * body.span * 180.0) * (math.pi * 180.0 / (4.0 * body.span)) ** (1.0 / 3.0)
    memory = 4.0 * body.span / (math.pi * body.airspeed)
    generator = np.random.default_rng([seed, 1])
    return first_order_wind(sigma * math.sqrt(share), time, body.airspeed, generator, body.airspeed * memory)


def _simulated(
    body: SideBody, time: Array, aileron: Array, rudder: Array, wind: Array, alpha: float
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Measured motion and recorded surfaces; inputs are linear between samples, `wind` (N, 3) of v, p and r."""
    interval = float(time[1] - time[0])
    count = max(1, math.ceil(interval / SUBSTEP))
    step = interval / count
    x: State = (0.0, 0.0, 0.0, 0.0, 0.0)
    rows: list[tuple[float, ...]] = []
    moved = aileron.copy()
    for k in range(time.size):
        _, a_y, beta = _rates(body, x, moved[k], rudder[k], wind[k], alpha)
        rows.append((beta, x[1], _pitching(x), x[2], x[3], x[4], a_y))
        if k + 1 == time.size:
            break
        moved[k + 1] += HOLD * x[3]  # the pilot is a sample late
        for n in range(count):

            def at(share: float, state: State, n: int = n, k: int = k) -> State:
                s = (n + share) / count
                surfaces = (moved[k] + s * (moved[k + 1] - moved[k]), rudder[k] + s * (rudder[k + 1] - rudder[k]))
                return _rates(body, state, *surfaces, wind[k] + s * (wind[k + 1] - wind[k]), alpha)[0]

            a = at(0.0, x)
            b = at(0.5, _beside(x, a, 0.5 * step))
            c = at(0.5, _beside(x, b, 0.5 * step))
            d = at(1.0, _beside(x, c, step))
            mean = tuple((p + 2.0 * q + 2.0 * r + s) / 6.0 for p, q, r, s in zip(a, b, c, d, strict=True))
            x = _beside(x, mean, step)  # type: ignore[arg-type]
    names = ("beta", "p", "q", "r", "phi", "psi", "a_y")
    return dict(zip(names, np.array(rows).T, strict=True)), {"delta_a": moved, "delta_r": rudder}


def _beside(x: State, rate: State, step: float) -> State:
    return tuple(value + step * change for value, change in zip(x, rate, strict=True))  # type: ignore[return-value]


def _pitching(x: State) -> float:
    """The pitch rate that keeps the pitch angle."""
    return x[2] * math.tan(x[3])


def _rates(
    body: SideBody, x: State, aileron: float, rudder: float, wind: Array, alpha: float
) -> tuple[State, float, float]:
    """Rates of v, p, r, phi, psi, the lateral specific force and the sideslip in the air."""
    v, p, r, phi, _ = x
    q, speed = _pitching(x), body.airspeed
    beta = math.asin((v - wind[0]) / speed)
    force = 0.5 * body.density * speed**2 * body.wing_area
    hat = body.span / (2.0 * speed)
    values = {"1": 1.0, "beta": beta, "p_hat": (p + wind[1]) * hat, "r_hat": (r + wind[2]) * hat}
    values |= {"delta_a": aileron, "delta_r": rudder}
    total = dict.fromkeys(("C_Y", "C_l", "C_n"), 0.0)
    for (coefficient, term), value in body.terms.items():
        total[coefficient] += value * values[term]
    i_xx, i_yy, i_zz, i_xz = body.inertia
    a_y = force * total["C_Y"] / body.mass
    roll = force * body.span * total["C_l"] + i_xz * p * q - (i_zz - i_yy) * q * r
    yaw = force * body.span * total["C_n"] - i_xz * q * r - (i_yy - i_xx) * p * q
    scale = 1.0 / (i_xx * i_zz - i_xz**2)
    plane = math.sqrt(speed**2 - v**2)
    u, w = plane * math.cos(alpha), plane * math.sin(alpha)
    theta = alpha
    turn = q * math.sin(phi) + r * math.cos(phi)
    rates = (
        a_y + G * math.cos(theta) * math.sin(phi) - r * u + p * w,
        scale * (i_zz * roll + i_xz * yaw),
        scale * (i_xz * roll + i_xx * yaw),
        p + math.tan(theta) * turn,
        turn / math.cos(theta),
    )
    return rates, a_y, beta
