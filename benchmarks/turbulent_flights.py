"""Simulated flights in turbulence, as recorders give them, by equations that share no code with the package.

Fourth-order Runge-Kutta at 5 ms with Dryden-like gusts along and across the path; every channel goes through the same
second-order recorder filter, gets coloured beside white noise, a resolution and the recorder's rate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import fsolve
from scipy.signal import lfilter

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.logs.flight_log import FlightLog
from benchmarks.planted_aircraft import BODIES, Body, declared_derivatives

Array = NDArray[np.float64]

G = 9.80665
STEP = 0.005
UNITS = {"V": "m/s", "alpha": "rad", "q": "rad/s", "theta": "rad", "a_x": "m/s^2", "a_z": "m/s^2", "h": "m"}
UNITS |= {"delta_e": "rad", "thrust": "N"}
NOISE = {"V": 0.08, "alpha": 6e-4, "q": 5e-4, "theta": 4e-4, "a_x": 0.012, "a_z": 0.03, "h": 0.3, "delta_e": 1e-4}
RESOLUTION = {"V": 0.02, "alpha": 2e-4, "q": 1e-4, "theta": 1e-4, "a_x": 2e-3, "a_z": 5e-3, "h": 0.1, "delta_e": 5e-5}
BANDWIDTH = 6.0
"""Hz, of the recorder."""


@dataclass(frozen=True)
class Wrong:
    """What a flight has that its aircraft file does not: terms, late or biased sensors, a late elevator, s and SI."""

    terms: Mapping[tuple[str, str], float] = field(default_factory=dict)
    delay: Mapping[str, float] = field(default_factory=dict)
    lag: Mapping[str, float] = field(default_factory=dict)
    bias: Mapping[str, float] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    elevator_delay: float = 0.0


NOTHING = Wrong()


def aircraft_of(body: Body, off: float, generator: np.random.Generator) -> Aircraft:
    """The aircraft file of a body with derivatives that are `off` by a share at random."""
    thrust = level(body, {})[2]
    lines = [
        "schema = 1",
        f'aircraft = {{ name = "{body.name}", source = "tests" }}',
        f"reference = {{ wing_area = {body.wing_area}, mean_chord = {body.mean_chord}, airspeed = {body.airspeed} }}",
        f"mass = {{ mass = {body.mass}, I_yy = {body.I_yy} }}",
        f"air = {{ density = {body.density} }}",
        f"thrust = {{ force = {thrust!r} }}",
    ]
    lines += declared_derivatives(body.terms, ("C_X", "C_Z", "C_m"), off, generator)
    return aircraft_from_text("\n".join(lines) + "\n", f"{body.name}.toml", "0" * 64)


def flown(
    name: str,
    body: Body,
    seed: int,
    *,
    air: float,
    wrong: Wrong = NOTHING,
    seconds: float = 30.0,
    interval: float = 0.04,
    rotary: bool = False,
) -> FlightLog:
    """The log of a manoeuvre of random steps in turbulence of `air` m/s.

    `rotary`: whether the gusts vary along the aircraft, as those of MIL-F-8785C do.
    """
    generator = np.random.default_rng(seed)
    terms = dict(body.terms)
    for key, value in wrong.terms.items():
        terms[key] = terms.get(key, 0.0) + value
    count = int(seconds / STEP)
    asked = _steps(body, count, generator)
    gust = air * np.array([_gust(count, 150.0 / body.airspeed, generator) for _ in range(2)])
    turning = _gust_in_pitch(body, gust[1]) if rotary else np.zeros(count)
    outputs = _simulated(body, terms, asked, np.vstack([gust, turning]), wrong.elevator_delay)
    return _recorded(name, outputs, wrong, interval, generator)


def _steps(body: Body, count: int, generator: np.random.Generator) -> Array:
    unit = float(np.clip(math.pi / body.short_period, 0.5, 2.0))
    size = 0.06 * abs(body.C_m[1] / body.C_m[3])
    asked = np.zeros(count)
    start = 2.0
    while start < STEP * count - 4.0:
        level_ = size * float(generator.uniform(-1.0, 1.0))
        for width in generator.uniform(0.5, 1.5, 2) * unit:
            asked[int(start / STEP) : int((start + width) / STEP)] = level_
            start += float(width)
            level_ = -level_
        start += float(generator.uniform(0.5, 3.0)) * unit
    return asked


def _gust(count: int, memory: float, generator: np.random.Generator) -> Array:
    keep = math.exp(-STEP / memory)
    return np.asarray(lfilter([math.sqrt(1.0 - keep**2)], [1.0, -keep], generator.standard_normal(count)))


def _gust_in_pitch(body: Body, down: Array) -> Array:
    """q_g = w_g'/V behind 1/(1 + s 4b/(pi V)), rad/s: (w_g less its average)/(V times that time); b is S/c."""
    time = 4.0 * body.wing_area / body.mean_chord / (math.pi * body.airspeed)
    keep = math.exp(-STEP / time)
    average = down[0] + lfilter([1.0 - keep], [1.0, -keep], down - down[0])
    return np.asarray((down - average) / (body.airspeed * time))


def level(body: Body, further: Mapping[tuple[str, str], float]) -> tuple[float, float, float]:
    """Angle of attack, elevator and thrust of level flight."""
    force = 0.5 * body.density * body.airspeed**2 * body.wing_area
    terms = {**body.terms, **further}

    def unbalanced(x: Array) -> list[float]:
        c = _coefficients(terms, float(x[0]), 0.0, float(x[1]), 0.0)
        weight = body.mass * G / force
        return [c[0] + x[2] - weight * math.sin(x[0]), c[1] + weight * math.cos(x[0]), c[2]]

    alpha, elevator, thrust = fsolve(unbalanced, [0.05, 0.0, 0.1])
    return float(alpha), float(elevator), float(thrust * force)


def _coefficients(
    terms: Mapping[tuple[str, str], float], alpha: float, q_hat: float, delta_e: float, v_hat: float
) -> tuple[float, float, float]:
    values = {"1": 1.0, "alpha": alpha, "q_hat": q_hat, "delta_e": delta_e, "V_hat": v_hat, "alpha^2": alpha**2}
    values |= {"alpha^3": alpha**3, "alpha*delta_e": alpha * delta_e}
    total = {"C_X": 0.0, "C_Z": 0.0, "C_m": 0.0}
    for (coefficient, term), number in terms.items():
        total[coefficient] += number * values[term]
    return total["C_X"], total["C_Z"], total["C_m"]


def _simulated(
    body: Body, terms: Mapping[tuple[str, str], float], asked: Array, gust: Array, delay: float
) -> dict[str, Array]:
    alpha, elevator, thrust = level(body, {key: v for key, v in terms.items() if key not in body.terms})
    acting = elevator + np.roll(asked, round(delay / STEP))
    x = [body.airspeed * math.cos(alpha), body.airspeed * math.sin(alpha), 0.0, alpha, 1500.0]
    rows = np.zeros((asked.size, 7))
    driving = np.vstack([acting, gust])
    between = (0.5 * (driving + np.roll(driving, -1, axis=1))).T.tolist()
    samples = driving.T.tolist()
    between[-1] = samples[-1]

    # Numbers of Python's own: an array of five of them takes three times as long.
    def rates(x: list[float], inputs: list[float]) -> tuple[list[float], tuple[float, ...]]:
        u, w, q, theta, height = x
        elevator_now, gust_u, gust_w, gust_q = inputs
        air_u, air_w = u - gust_u, w - gust_w
        speed = math.hypot(air_u, air_w)
        angle = math.atan2(air_w, air_u)
        hat = (q + gust_q) * body.mean_chord / (2.0 * body.airspeed)
        c = _coefficients(terms, angle, hat, elevator_now, speed / body.airspeed - 1.0)
        force = 0.5 * body.density * speed**2 * body.wing_area
        a_x, a_z = (force * c[0] + thrust) / body.mass, force * c[1] / body.mass
        q_dot = force * body.mean_chord * c[2] / body.I_yy
        sin, cos = math.sin(theta), math.cos(theta)
        rate = [a_x - G * sin - q * w, a_z + G * cos + q * u, q_dot, q, u * sin - w * cos]
        return rate, (speed, angle, q, theta, a_x, a_z, height)

    for k, (here, middle) in enumerate(zip(samples, between, strict=True)):
        k1, rows[k] = rates(x, here)
        k2, _ = rates([a + 0.5 * STEP * b for a, b in zip(x, k1, strict=True)], middle)
        k3, _ = rates([a + 0.5 * STEP * b for a, b in zip(x, k2, strict=True)], middle)
        k4, _ = rates([a + STEP * b for a, b in zip(x, k3, strict=True)], samples[min(k + 1, asked.size - 1)])
        x = [a + STEP / 6.0 * (p + 2.0 * q + 2.0 * r + s) for a, p, q, r, s in zip(x, k1, k2, k3, k4, strict=True)]
    outputs = dict(zip(("V", "alpha", "q", "theta", "a_x", "a_z", "h"), rows.T, strict=True))
    return outputs | {"delta_e": elevator + asked}


def _recorded(
    name: str, outputs: Mapping[str, Array], wrong: Wrong, interval: float, generator: np.random.Generator
) -> FlightLog:
    stride = round(interval / STEP)
    omega = 2.0 * math.pi * BANDWIDTH * STEP
    # Second order, damping .7, by the bilinear transformation.
    gain = omega**2 / (4.0 + 2.8 * omega + omega**2)
    top = gain * np.array([1.0, 2.0, 1.0])
    bottom = np.array([1.0, (2.0 * omega**2 - 8.0) / (4.0 + 2.8 * omega + omega**2), 1.0])
    bottom[2] = (4.0 - 2.8 * omega + omega**2) / (4.0 + 2.8 * omega + omega**2)
    channels = {}
    for channel, true in outputs.items():
        late = wrong.delay.get(channel, 0.0)
        moved = np.interp(STEP * np.arange(true.size) - late, STEP * np.arange(true.size), true)
        if channel in wrong.lag:
            moved = _lagged(moved, wrong.lag[channel])
        seen = moved[0] + lfilter(top, bottom, moved - moved[0])
        sampled = seen[::stride] * wrong.scale.get(channel, 1.0) + wrong.bias.get(channel, 0.0)
        white = generator.standard_normal((2, sampled.size))
        coloured = lfilter([0.6], [1.0, -0.8], white[0])
        sampled = sampled + NOISE[channel] * (0.7 * white[1] + 0.7 * coloured)
        channels[channel] = RESOLUTION[channel] * np.round(sampled / RESOLUTION[channel])
    time = interval * np.arange(next(iter(channels.values())).size)
    return FlightLog(name, time, channels, {channel: UNITS[channel] for channel in channels})


def _lagged(values: Array, constant: float) -> Array:
    """Behind a first-order lag, s, by the bilinear transformation."""
    a = 0.5 * STEP / constant
    behind = lfilter([a / (1.0 + a), a / (1.0 + a)], [1.0, -(1.0 - a) / (1.0 + a)], values - values[0])
    return np.asarray(values[0] + behind)


__all__ = ["BODIES", "NOTHING", "Wrong", "aircraft_of", "flown", "level"]
