"""Simulated flights in all six axes, by equations that share no code with the package.

One rigid body with I_xz over a flat earth, by the classical Runge-Kutta method with inputs linear between samples:
steps of aileron, rudder and elevator of random lengths and sizes, a slow pilot that holds bank and pitch through the
recorded surfaces, an exponentially correlated wind from the side, sensors away from the centre of gravity, and what
is wrong with the flight (`benchmarks/sideways_plants.py`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import fsolve
from scipy.signal import butter, filtfilt, lfilter, lfilter_zi

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.logs.flight_log import FlightLog
from benchmarks.planted_aircraft import declared_derivatives
from benchmarks.sideways_flights import first_order_wind
from benchmarks.sideways_plants import SidePlant

Array = NDArray[np.float64]
Terms = Mapping[tuple[str, str], float]

G = 9.80665
SUBSTEP = 0.01
"""s, at most."""
HOLD = {"delta_a": 0.1, "delta_e": 0.15}
"""Surface for a bank or a departure of pitch, 1: the pilot's gains."""

SYMMETRIC, SIDE = ("C_X", "C_Z", "C_m"), ("C_Y", "C_l", "C_n")
CASES = {"longitudinal": SYMMETRIC, "lateral": SIDE, "six": (*SYMMETRIC, *SIDE)}
"""Coefficients that the file of each case declares."""
UNITS = {"V": "m/s", "p": "rad/s", "q": "rad/s", "r": "rad/s", "a_x": "m/s^2", "a_y": "m/s^2", "a_z": "m/s^2"}
UNITS |= {"h": "m", "thrust": "N"}
NOISE = {"V": 0.12, "alpha": 1.2e-3, "beta": 1.3e-3, "p": 1.6e-3, "q": 9e-4, "r": 9e-4, "phi": 1.2e-3, "theta": 9e-4}
NOISE |= {"psi": 1.5e-3, "a_x": 0.02, "a_y": 0.025, "a_z": 0.05, "h": 0.3}
NOISE |= {"delta_e": 2e-4, "delta_a": 2.5e-4, "delta_r": 2e-4}
RESOLUTION = {"V": 0.02, "a_x": 2e-3, "a_y": 2e-3, "a_z": 5e-3, "h": 0.1}
RESOLUTION |= dict.fromkeys(("alpha", "beta"), 2e-4) | dict.fromkeys(("p", "q", "r", "phi", "theta", "psi"), 1e-4)
RESOLUTION |= dict.fromkeys(("delta_e", "delta_a", "delta_r"), 5e-5)
RECORDERS = {"none": 0.0, "filtered": 6.0, "smoothed": 5.0}
"""Hz, corner of the second-order filter of all channels: none, a recorder's, or one run both ways afterwards."""
STATES = ("u", "v", "w", "p", "q", "r", "phi", "theta", "psi", "h")


@dataclass(frozen=True)
class WholeBody:
    """An aircraft: SI, airspeed m/s, `inertia` I_xx, I_yy, I_zz, I_xz, and its derivatives about body axes."""

    name: str
    wing_area: float
    span: float
    chord: float
    mass: float
    inertia: tuple[float, float, float, float]
    airspeed: float
    density: float
    terms: Terms


def _terms(**rows: Mapping[str, float]) -> dict[tuple[str, str], float]:
    return {(coefficient, term): value for coefficient, values in rows.items() for term, value in values.items()}


BODIES = (
    WholeBody(
        "four-seater", 15.6, 10.9, 1.46, 1080.0, (1300.0, 1900.0, 2950.0, 60.0), 56.0, 1.12,
        _terms(
            C_X={"1": -0.04, "alpha": 0.3, "alpha^2": 3.4},
            C_Z={"1": -0.31, "alpha": -4.8, "q_hat": -4.5, "delta_e": -0.4},
            C_m={"1": 0.02, "alpha": -0.75, "q_hat": -12.5, "delta_e": -1.15},
            C_Y={"1": 0.0, "beta": -0.45, "r_hat": 0.25, "delta_r": 0.16},
            C_l={"1": 0.0, "beta": -0.085, "p_hat": -0.46, "r_hat": 0.12, "delta_a": -0.16, "delta_r": 0.012},
            C_n={"1": 0.0, "beta": 0.068, "p_hat": -0.04, "r_hat": -0.11, "delta_a": 0.009, "delta_r": -0.07},
        ),
    ),
    WholeBody(
        "regional jet", 51.0, 21.2, 2.6, 19500.0, (205000.0, 470000.0, 650000.0, 21000.0), 165.0, 0.72,
        _terms(
            C_X={"1": -0.032, "alpha": 0.24, "alpha^2": 2.6},
            C_Z={"1": -0.22, "alpha": -5.5, "q_hat": -7.0, "delta_e": -0.45},
            C_m={"1": 0.03, "alpha": -1.15, "q_hat": -23.0, "delta_e": -1.4},
            C_Y={"1": 0.0, "beta": -0.85, "p_hat": 0.05, "r_hat": 0.55, "delta_r": 0.24},
            C_l={"1": 0.0, "beta": -0.13, "p_hat": -0.44, "r_hat": 0.17, "delta_a": -0.11, "delta_r": 0.028},
            C_n={"1": 0.0, "beta": 0.14, "p_hat": -0.035, "r_hat": -0.22, "delta_a": 0.004, "delta_r": -0.105},
        ),
    ),
    WholeBody(
        "survey drone", 2.3, 4.8, 0.5, 64.0, (13.5, 17.0, 29.0, 0.9), 34.0, 1.16,
        _terms(
            C_X={"1": -0.045, "alpha": 0.22, "alpha^2": 2.9},
            C_Z={"1": -0.29, "alpha": -4.9, "q_hat": -5.0, "delta_e": -0.38},
            C_m={"1": 0.025, "alpha": -0.7, "q_hat": -11.0, "delta_e": -1.05},
            C_Y={"1": 0.0, "beta": -0.4, "r_hat": 0.2, "delta_r": 0.14},
            C_l={"1": 0.0, "beta": -0.07, "p_hat": -0.5, "r_hat": 0.13, "delta_a": -0.17, "delta_r": 0.01},
            C_n={"1": 0.0, "beta": 0.06, "p_hat": -0.045, "r_hat": -0.1, "delta_a": 0.006, "delta_r": -0.062},
        ),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Circumstances:
    """How a pair was flown: `gust` standard deviation of the side wind, m/s; `memory` of the recorder's noise, 1.

    `recorder`: one of `RECORDERS`.
    """

    body: WholeBody
    interval: float
    seconds: float
    gust: float
    memory: float
    off: float
    recorder: str = "none"

    @property
    def time(self) -> Array:
        """S."""
        return self.interval * np.arange(int(self.seconds / self.interval))


def drawn(gust: float, generator: np.random.Generator, recorder: str = "none") -> Circumstances:
    """Circumstances at random; `gust`: over the airspeed, 1."""
    body = BODIES[int(generator.integers(len(BODIES)))]
    return Circumstances(
        body,
        interval=float(generator.choice([0.02, 0.04])),
        seconds=float(generator.uniform(18.0, 26.0)),
        gust=gust * body.airspeed,
        memory=float(generator.uniform(0.0, 0.5)),
        off=float(generator.uniform(0.0, 0.12)),
        recorder=recorder,
    )


def trimmed(body: WholeBody) -> tuple[float, float, float]:
    """Angle of attack, elevator [rad] and thrust [N] of level flight."""
    force, weight = 0.5 * body.density * body.airspeed**2 * body.wing_area, body.mass * G

    def left(unknown: Array) -> tuple[float, float, float]:
        alpha, elevator, thrust = unknown
        values = {"1": 1.0, "alpha": alpha, "alpha^2": alpha**2, "q_hat": 0.0, "delta_e": elevator}
        x, z, m = (sum(v * values[t] for (c, t), v in body.terms.items() if c == name) for name in SYMMETRIC)
        return x + thrust - weight / force * math.sin(alpha), z + weight / force * math.cos(alpha), m

    alpha, elevator, thrust = fsolve(left, np.array([0.02, 0.0, 0.04]))
    return float(alpha), float(elevator), force * float(thrust)


def aircraft_of(at: Circumstances, plant: SidePlant, case: str, generator: np.random.Generator) -> Aircraft:
    """The aircraft file of a case, one of `CASES`: what is flown less what is planted, off at random."""
    body = at.body
    declared = {entry: value for entry, value in body.terms.items() if entry not in plant.omitted}
    coefficients = CASES[case]
    i_xx, i_yy, i_zz, i_xz = body.inertia
    lines = [
        "schema = 1",
        f'aircraft = {{ name = "{body.name}", source = "benchmarks" }}',
        f"reference = {{ wing_area = {body.wing_area}, mean_chord = {body.chord}, span = {body.span} }}",
        f"mass = {{ mass = {body.mass}, I_xx = {i_xx}, I_yy = {i_yy}, I_zz = {i_zz}, I_xz = {i_xz} }}",
        f"air = {{ density = {body.density} }}",
        f"thrust = {{ force = {trimmed(body)[2]!r} }}",
    ]
    lines += declared_derivatives(declared, coefficients, at.off, generator)
    return aircraft_from_text("\n".join(lines) + "\n", f"{body.name}.toml", "0" * 64)


def flown(name: str, at: Circumstances, plant: SidePlant, seed: int) -> FlightLog:
    """The recorded flight with what was planted."""
    generator = np.random.default_rng(seed)
    time, body = at.time, at.body
    alpha, elevator, thrust = trimmed(body)
    # A faster aircraft is moved for a shorter time and less far.
    asked = {
        surface: _steps(time, size, width, generator)
        for surface, size, width in (("delta_a", 0.08, 0.8), ("delta_r", 0.06, 1.0), ("delta_e", 0.02, 0.8))
    }
    asked["delta_e"] += elevator
    swung = 1.0 + (0.4 * np.sin(0.7 * time + generator.uniform(0.0, 6.0)) if plant.thrust_moves else 0.0)
    given = {
        "thrust": thrust * swung * np.ones(time.size),
        "side_wind": first_order_wind(at.gust, time, body.airspeed, generator, 160.0),
    }
    given |= {channel: history(time, generator) for channel, history in plant.channels.items()}
    seen, recorded = _simulated(body, plant, time, asked, given, (alpha, elevator))
    shown = {**seen, **recorded, **{channel: given[channel] for channel in plant.channels}}
    if plant.thrust_moves:
        shown["thrust"] = given["thrust"]
    channels = {}
    for channel, values in shown.items():
        true = plant.sensors[channel](time, values) if channel in plant.sensors else values
        shocks = math.sqrt(1.0 - at.memory**2) * generator.standard_normal(time.size)
        colour = shocks if channel in recorded else lfilter([1.0], [1.0, -at.memory], shocks)
        noisy = np.asarray(true + NOISE.get(channel, 0.0) * colour)
        channels[channel] = _as_recorded(channel, noisy, at)
    units = {channel: UNITS.get(channel, "1" if channel in plant.channels else "rad") for channel in channels}
    return FlightLog(name, time, channels, units)


def _as_recorded(channel: str, values: Array, at: Circumstances) -> Array:
    """A channel, (N,), noise and all, through the recorder's filter and in its resolution."""
    corner = RECORDERS[at.recorder]
    if not corner:
        return values
    b, a = butter(2, corner, fs=1.0 / at.interval)
    if at.recorder == "smoothed":
        values = filtfilt(b, a, values)
    else:
        values, _ = lfilter(b, a, values, zi=values[0] * lfilter_zi(b, a))
    step = RESOLUTION.get(channel, 0.0)
    return np.asarray(step * np.round(values / step) if step else values)


def _steps(time: Array, size: float, width: float, generator: np.random.Generator) -> Array:
    """Doublets of random length and size with rests between, rad."""
    out, at = np.zeros(time.size), float(generator.uniform(0.8, 3.0))
    while at < time[-1] - 2.0:
        length, level = width * float(generator.uniform(0.5, 1.6)), size * float(generator.uniform(0.5, 1.0))
        for sign in (1.0, -1.0) if generator.random() < 0.5 else (-1.0, 1.0):
            out[(time >= at) & (time < at + length)] = sign * level
            at += length
        at += float(generator.uniform(1.5, 4.5))
    return out


def _simulated(
    body: WholeBody,
    plant: SidePlant,
    time: Array,
    asked: dict[str, Array],
    given: Mapping[str, Array],
    trim: tuple[float, float],
) -> tuple[dict[str, Array], dict[str, Array]]:
    """What sensors at their places would show without noise, and the recorded surfaces."""
    interval = float(time[1] - time[0])
    count = max(1, math.ceil(interval / SUBSTEP))
    step = interval / count
    flight = _Flight(body, plant)
    recorded = {name: values.copy() for name, values in asked.items()}
    # The pilot's part is small and slow; the surfaces' faults act on all that is recorded, which is why a first pass
    # flies the recorded surfaces, and the second one, with the same record, what becomes of them.
    for faulty in (False, True):
        acting = dict(recorded)
        if faulty:
            acting |= {name: fault(time, recorded[name]) for name, fault in plant.surfaces.items()}
        x = [body.airspeed * math.cos(trim[0]), 0.0, body.airspeed * math.sin(trim[0])]
        x += [0.0, 0.0, 0.0, 0.0, trim[0], 0.0, 1500.0]
        rows = []
        for k in range(time.size):
            now = {name: float(values[k]) for name, values in (*acting.items(), *given.items())}
            rows.append(flight.shown(x, float(time[k]), now))
            if k + 1 == time.size:
                break
            if not faulty:
                for name, value in (("delta_a", x[6]), ("delta_e", x[7] - trim[0])):
                    recorded[name][k + 1] = asked[name][k + 1] + HOLD[name] * value
                    acting[name] = recorded[name]
            after = {name: float(values[k + 1]) for name, values in (*acting.items(), *given.items())}
            for n in range(count):
                x = flight.stepped(x, float(time[k]) + n * step, step, now, after, (n / count, 1.0 / count))
        if not plant.surfaces:
            break
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, recorded


class _Flight:
    """The equations of motion of one body with what is planted."""

    def __init__(self, body: WholeBody, plant: SidePlant) -> None:
        self.body, self.plant = body, plant
        # What is planted replaces a value of the same name.
        terms = {**body.terms, **plant.terms}
        self.terms = [(c, _factors(t), value) for (c, t), value in terms.items()]
        i_xx, i_yy, i_zz, i_xz = body.inertia
        self.inertia = (i_xx, i_yy, i_zz, i_xz + plant.product_of_inertia * i_xx)

    def stepped(
        self,
        x: list[float],
        t: float,
        step: float,
        now: Mapping[str, float],
        after: Mapping[str, float],
        share: tuple[float, float],
    ) -> list[float]:
        """The state a step later; `share`: where in the sampling interval, and how much of it."""

        def rates(part: float, state: list[float]) -> list[float]:
            s = share[0] + part * share[1]
            inputs = {name: value + s * (after[name] - value) for name, value in now.items()}
            return self.rates(state, t + part * step, inputs)[0]

        a = rates(0.0, x)
        b = rates(0.5, [v + 0.5 * step * d for v, d in zip(x, a, strict=True)])
        c = rates(0.5, [v + 0.5 * step * d for v, d in zip(x, b, strict=True)])
        d = rates(1.0, [v + step * d for v, d in zip(x, c, strict=True)])
        return [v + step / 6.0 * (e + 2.0 * f + 2.0 * g + h) for v, e, f, g, h in zip(x, a, b, c, d, strict=True)]

    def rates(self, x: list[float], t: float, given: Mapping[str, float]) -> tuple[list[float], tuple[float, ...]]:
        """Rates of the states; specific forces, angular accelerations, airspeed, alpha, beta."""
        body, plant = self.body, self.plant
        u, v, w, p, q, r, phi, theta, _, _ = x
        across = v - given["side_wind"]
        speed = math.sqrt(u * u + across * across + w * w)
        alpha, beta = math.atan2(w, u), math.asin(across / speed)
        force = 0.5 * body.density * speed * speed * body.wing_area
        hat = 0.5 / speed
        thrust, lost = given["thrust"], 0.0
        if plant.engine is not None and t >= plant.engine[0]:
            lost = plant.engine[1] * thrust
        values = {"alpha": alpha, "beta": beta, "p_hat": p * body.span * hat, "r_hat": r * body.span * hat}
        values |= {"q_hat": q * body.chord * hat, "C_T": thrust / force, **given}
        c = dict.fromkeys((*SYMMETRIC, *SIDE), 0.0)
        for coefficient, factors, value in self.terms:
            for name, magnitude, power in factors:
                factor = values[name]
                value *= (abs(factor) if magnitude else factor) ** power
            c[coefficient] += value
        for coefficient, (size, moment) in plant.jumps.items():
            c[coefficient] += size if t >= moment else 0.0
        f_x, f_y, f_z = force * c["C_X"] + thrust - lost, force * c["C_Y"], force * c["C_Z"]
        right = plant.centre[0] if t >= plant.centre[1] else 0.0
        roll = force * body.span * c["C_l"] - right * f_z
        pitch = force * body.chord * c["C_m"]
        yaw = force * body.span * c["C_n"] + right * f_x
        if plant.engine is not None:
            yaw += plant.engine[2] * lost
        i_xx, i_yy, i_zz, i_xz = self.inertia
        roll += i_xz * p * q - (i_zz - i_yy) * q * r
        yaw += -i_xz * q * r - (i_yy - i_xx) * p * q
        pitch += -(i_xx - i_zz) * p * r - i_xz * (p * p - r * r)
        scale = 1.0 / (i_xx * i_zz - i_xz * i_xz)
        p_dot, q_dot, r_dot = scale * (i_zz * roll + i_xz * yaw), pitch / i_yy, scale * (i_xz * roll + i_xx * yaw)
        a_x, a_y, a_z = f_x / body.mass, f_y / body.mass, f_z / body.mass
        sf, cf, st, ct = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
        turn = q * sf + r * cf
        climb = u * st - v * sf * ct - w * cf * ct
        rates = [a_x - G * st + r * v - q * w, a_y + G * sf * ct - r * u + p * w, a_z + G * cf * ct + q * u - p * v]
        rates += [p_dot, q_dot, r_dot, p + st / ct * turn, q * cf - r * sf, turn / ct, climb]
        return rates, (a_x, a_y, a_z, p_dot, q_dot, r_dot, speed, alpha, beta)

    def shown(self, x: list[float], t: float, given: Mapping[str, float]) -> dict[str, float]:
        """What the sensors show at their places."""
        _, (a_x, a_y, a_z, p_dot, q_dot, r_dot, speed, alpha, beta) = self.rates(x, t, given)
        _, _, _, p, q, r, phi, theta, psi, h = x
        right = self.plant.centre[0] if t >= self.plant.centre[1] else 0.0
        seen = {"V": speed, "alpha": alpha, "p": p, "q": q, "r": r, "phi": phi, "theta": theta, "psi": psi, "h": h}
        x_v, _, z_v = self.plant.positions.get("beta", (0.0, 0.0, 0.0))
        seen["beta"] = beta + (x_v * r - z_v * p) / speed
        # Accelerometers that stand at the declared centre of gravity stand beside one that moved.
        places = {name: self.plant.positions.get(name, (0.0, 0.0, 0.0)) for name in ("a_x", "a_y", "a_z")}
        along, aside, down = ((x_a, y_a - right, z_a) for x_a, y_a, z_a in places.values())
        seen["a_x"] = a_x - along[0] * (q * q + r * r) + along[1] * (p * q - r_dot) + along[2] * (p * r + q_dot)
        seen["a_y"] = a_y + aside[0] * (r_dot + p * q) - aside[1] * (p * p + r * r) + aside[2] * (q * r - p_dot)
        seen["a_z"] = a_z + down[0] * (p * r - q_dot) + down[1] * (q * r + p_dot) - down[2] * (p * p + q * q)
        return seen


def _factors(term: str) -> tuple[tuple[str, bool, int], ...]:
    """Name, whether its magnitude, and power of every factor."""
    found = []
    for part in term.split("*"):
        base, _, power = part.partition("^")
        if base != "1":
            magnitude = base.startswith("abs(")
            found.append((base[4:-1] if magnitude else base, magnitude, int(power or 1)))
    return tuple(found)
