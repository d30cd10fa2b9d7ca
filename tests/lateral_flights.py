"""Flights of a commuter with rolling and yawing motion, by the suite's own rigid body: no code of the package flies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from oracles.rigid_body import Body, answer
from scipy.optimize import fsolve

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS

Array = NDArray[np.float64]
Terms = Mapping[tuple[str, str], float]

STATES = ("u", "v", "w", "p", "q", "r", "phi", "theta", "h", "psi")
SPEED, DENSITY, MASS, SOUND = 75.0, 1.05, 4800.0, 338.0
WING, CHORD, SPAN = 38.0, 1.9, 20.0
INERTIA = (29000.0, 34000.0, 56000.0, 1400.0)
SIDE: dict[tuple[str, str], float] = {
    ("C_Y", "1"): 0.001, ("C_Y", "beta"): -0.8, ("C_Y", "r_hat"): 0.6, ("C_Y", "delta_r"): 0.3,
    ("C_l", "1"): 0.0, ("C_l", "beta"): -0.11, ("C_l", "p_hat"): -0.52, ("C_l", "r_hat"): 0.18,
    ("C_l", "delta_a"): -0.2, ("C_l", "delta_r"): 0.035,
    ("C_n", "1"): 0.0, ("C_n", "beta"): 0.09, ("C_n", "p_hat"): -0.055, ("C_n", "r_hat"): -0.18,
    ("C_n", "delta_a"): 0.006, ("C_n", "delta_r"): -0.12,
}  # fmt: skip
PITCH: dict[tuple[str, str], float] = {
    ("C_X", "1"): -0.05, ("C_X", "alpha"): 0.25, ("C_X", "alpha^2"): 2.5,
    ("C_Z", "1"): -0.3, ("C_Z", "alpha"): -5.2, ("C_Z", "q_hat"): -6.0, ("C_Z", "delta_e"): -0.4,
    ("C_m", "1"): 0.03, ("C_m", "alpha"): -0.8, ("C_m", "q_hat"): -18.0, ("C_m", "delta_e"): -1.5,
}  # fmt: skip
NOISE = {
    "V": 0.12, "alpha": 0.0012, "beta": 0.0015, "p": 0.0018, "q": 0.001, "r": 0.001, "phi": 0.0012, "theta": 0.001,
    "psi": 0.0015, "a_x": 0.02, "a_y": 0.03, "a_z": 0.05, "h": 0.3, "delta_e": 0.0002, "delta_a": 0.0003,
    "delta_r": 0.0002,
}  # fmt: skip


def plain(_time: Array, values: Array) -> Array:
    """A surface that does what is recorded, a sensor that shows what is true."""
    return values


@dataclass(frozen=True)
class Lateral:
    """One flight: what acts beyond the declared model, and how it was flown.

    Attributes
    ----------
    extra : mapping of (coefficient, term) to float
        Terms of the truth that the declared file lacks, or values in place of its own.
    surfaces : mapping of str to callable
        (time, recorded) -> what the surface does.
    sensors : mapping of str to callable
        (time, true) -> what is recorded, before its noise.
    inputs : mapping of str to ndarray, shape (N,)
        Further inputs of the truth: gusts, moving centre of gravity, changes of thrust, columns that terms name.
    positions : mapping of str to (x, y, z)
        Of the sensors, m.
    inertia : tuple of float
        I_xx, I_yy, I_zz, I_xz, kg m^2, of the truth.
    factor : float
        Declared over true derivatives.
    recorded_inputs : tuple of str
        Those of `inputs` that the log holds.
    """

    extra: Terms = field(default_factory=dict)
    surfaces: Mapping[str, Callable[[Array, Array], Array]] = field(default_factory=dict)
    sensors: Mapping[str, Callable[[Array, Array], Array]] = field(default_factory=dict)
    inputs: Mapping[str, Array] = field(default_factory=dict)
    positions: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    inertia: tuple[float, float, float, float] = INERTIA
    factor: float = 1.0
    seed: int = 1
    duration: float = 18.0
    interval: float = 0.04
    size: float = 1.0
    noise: float = 1.0
    recorded_inputs: tuple[str, ...] = ()

    @property
    def time(self) -> Array:
        """S."""
        return np.arange(0.0, self.duration, self.interval)

    def log(self, *, mirrored: bool = False, name: str = "flight") -> FlightLog:
        """The recorded flight; `mirrored`: a rudder input first, an aileron input later, for validation."""
        return FlightLog(name, *_recorded(self, mirrored=mirrored))


def aircraft(terms: Terms, factor: float = 1.0) -> Aircraft:
    """The declared file with these terms, their values times a factor."""
    i_xx, i_yy, i_zz, i_xz = INERTIA
    lines = [
        "schema = 1",
        'aircraft = { name = "commuter" }',
        f"reference = {{ wing_area = {WING}, mean_chord = {CHORD}, span = {SPAN} }}",
        f"mass = {{ mass = {MASS}, I_xx = {i_xx}, I_yy = {i_yy}, I_zz = {i_zz}, I_xz = {i_xz} }}",
        f"air = {{ density = {DENSITY} }}",
        f"thrust = {{ force = {level()[2]:.6f} }}",
    ]
    for coefficient in dict.fromkeys(coefficient for coefficient, _ in terms):
        lines.append(f"[derivatives.{coefficient}]")
        lines += [f'"{t}" = {{ value = {factor * value} }}' for (c, t), value in terms.items() if c == coefficient]
    return aircraft_from_text("\n".join(lines) + "\n", "commuter.toml", "0" * 64)


def without_vane(log: FlightLog) -> FlightLog:
    """The same of a recorder that has no vane of sideslip."""
    return replace(log, channels={name: values for name, values in log.channels.items() if name != "beta"})


def inputs_flown(time: Array, size: float = 1.0, *, mirrored: bool = False) -> dict[str, Array]:
    """Deviations of aileron, rudder and elevator: 3211, doublets of two sizes, an elevator doublet, rad."""
    first, second = ("delta_r", "delta_a") if mirrored else ("delta_a", "delta_r")
    amplitude = {"delta_a": 0.08 * size, "delta_r": 0.06 * size}
    found = {name: np.zeros(time.size) for name in ("delta_a", "delta_r", "delta_e")}
    found[first] += amplitude[first] * _steps(time, 1.0, ((0.9, 1.0), (0.9, -1.0), (0.5, 0.5), (0.5, -0.5)))
    found[second] += amplitude[second] * _steps(time, 5.0, ((1.2, 1.0), (0.8, -1.0), (0.4, 1.0), (0.4, -1.0)))
    found[first] += 0.6 * amplitude[first] * _steps(time, 9.5, ((0.6, -1.0), (0.6, 1.0)))
    found["delta_e"] += 0.025 * size * _steps(time, 11.5, ((0.7, -1.0), (0.7, 1.0)))
    found[second] += 0.6 * amplitude[second] * _steps(time, 13.5, ((0.7, -1.0), (0.7, 1.0)))
    return found


def _steps(time: Array, begin: float, levels: tuple[tuple[float, float], ...]) -> Array:
    out = np.zeros(time.size)
    for width, level_of in levels:
        out[(time >= begin - 1e-9) & (time < begin + width - 1e-9)] = level_of
        begin += width
    return out


def level() -> tuple[float, float, float]:
    """Angle of attack, elevator and thrust of level flight with the terms of `PITCH`, rad and N."""
    force = 0.5 * DENSITY * SPEED**2 * WING

    def drift(unknown: Array) -> Array:
        alpha, elevator, thrust = unknown
        x = PITCH[("C_X", "1")] + PITCH[("C_X", "alpha")] * alpha + PITCH[("C_X", "alpha^2")] * alpha**2
        z = PITCH[("C_Z", "1")] + PITCH[("C_Z", "alpha")] * alpha + PITCH[("C_Z", "delta_e")] * elevator
        m = PITCH[("C_m", "1")] + PITCH[("C_m", "alpha")] * alpha + PITCH[("C_m", "delta_e")] * elevator
        weight = MASS * 9.80665
        along = (force * x + 1e4 * thrust - weight * np.sin(alpha)) / weight
        return np.array([along, (force * z + weight * np.cos(alpha)) / weight, m])

    alpha, elevator, thrust = fsolve(drift, np.array([0.02, 0.0, 0.5]), xtol=1e-13)
    return float(alpha), float(elevator), 1e4 * float(thrust)


def _recorded(flight: Lateral, *, mirrored: bool) -> tuple[Array, dict[str, Array], dict[str, str]]:
    """Time, channels and units."""
    time = flight.time
    alpha, elevator, thrust = level()
    commanded = inputs_flown(time, flight.size, mirrored=mirrored)
    commanded["delta_e"] = commanded["delta_e"] + elevator
    acting = {name: flight.surfaces.get(name, plain)(time, values) for name, values in commanded.items()}
    given = {"rho": DENSITY, "mass": MASS, "thrust": thrust, "speed_of_sound": SOUND, **acting, **flight.inputs}
    body = Body(WING, CHORD, SPAN, flight.inertia, None, SPEED, positions=flight.positions)
    start = [SPEED * np.cos(alpha), 0.0, SPEED * np.sin(alpha), 0.0, 0.0, 0.0, 0.0, alpha, 1500.0, 0.0]
    seen = simulate(start, time, given, {**PITCH, **SIDE, **flight.extra}, body)
    generator = np.random.default_rng(flight.seed)
    channels = {}
    truth = {**seen, **commanded}
    for name, deviation in NOISE.items():
        shown = flight.sensors.get(name, plain)(time, truth[name])
        channels[name] = shown + flight.noise * deviation * generator.standard_normal(time.size)
    channels |= {name: np.array(flight.inputs[name]) for name in flight.recorded_inputs}
    return time, channels, {name: CHANNELS[name].unit if name in CHANNELS else "1" for name in channels}


def simulate(
    start: list[float], time: Array, inputs: Mapping[str, object], terms: Terms, body: Body
) -> dict[str, Array]:
    """What the sensors see, inputs linear between samples: the classical Runge-Kutta method, two steps a sample."""
    held = {name: np.broadcast_to(np.asarray(value, dtype=float), time.shape) for name, value in inputs.items()}

    def given(k: int, share: float) -> dict[str, complex]:
        last = min(k + 1, time.size - 1)
        return {name: float((1.0 - share) * v[k] + share * v[last]) for name, v in held.items()}

    def rates(x: Array, k: int, share: float) -> Array:
        return np.real(answer(STATES, x, given(k, share), terms, body).rates)

    x, rows = np.array(start, dtype=float), []
    for k in range(time.size):
        rows.append(
            {name: float(np.real(v)) for name, v in answer(STATES, x, given(k, 0.0), terms, body).outputs.items()}
        )
        if k + 1 == time.size:
            break
        step = 0.5 * (time[k + 1] - time[k])
        for at in (0.0, 0.5):
            a = rates(x, k, at)
            b = rates(x + 0.5 * step * a, k, at + 0.25)
            c = rates(x + 0.5 * step * b, k, at + 0.25)
            d = rates(x + step * c, k, at + 0.5)
            x = x + step * (a + 2.0 * b + 2.0 * c + d) / 6.0
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}
