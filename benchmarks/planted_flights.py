"""Simulated flights of many aircraft with something wrong in them, by equations that share no code with the package.

Eight aircraft from glider to jet transport, nine input shapes of small and large amplitude, 20 to 100 Hz, 10 to 30 s,
noise of half to four times good sensors', white or coloured, the elevator's too. What is wrong is a `Plant`
(benchmarks/plants.py); what a recorder would hold of it is a `FlightLog`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import fsolve
from scipy.signal import chirp, lfilter

from aerosid.logs.flight_log import FlightLog
from benchmarks.planted_aircraft import BODIES, STRUCTURE, Body
from benchmarks.plants import Plant

Array = NDArray[np.float64]

G = 9.80665
NOISE = {"V": 0.15, "alpha": 1.5e-3, "q": 1.2e-3, "theta": 1.2e-3, "a_x": 0.02, "a_z": 0.05, "h": 0.3, "delta_e": 2e-4}
"""Standard deviations of good flight-test sensors, SI."""
UNITS = {"V": "m/s", "a_x": "m/s^2", "a_z": "m/s^2", "q": "rad/s", "h": "m", "thrust": "N"}
VARIABLES = ("alpha", "q_hat", "delta_e", "V_hat", "alpha_dot_hat", "delta_f", "delta_h")


@dataclass(frozen=True)
class Circumstances:
    """How a pair of flights was flown and recorded; `memory`: of the outputs' noise from sample to sample."""

    body: Body
    shapes: tuple[str, str]
    interval: float
    duration: float
    excursion: float
    noise: float
    elevator_noise: float
    memory: float
    off: float


SHAPES = ("doublet", "3-2-1-1", "2-1-1", "multistep", "sweep", "pulses", "doublets", "multisine", "staircase")


def drawn(generator: np.random.Generator) -> Circumstances:
    """Circumstances at random; noise is coloured in a quarter of all."""
    body = BODIES[int(generator.integers(len(BODIES)))]
    first, second = generator.choice(len(SHAPES), 2, replace=False)
    interval = float(generator.choice([0.01, 0.02, 0.025, 0.03, 0.04, 0.05]))
    return Circumstances(
        body=body,
        shapes=(SHAPES[first], SHAPES[second]),
        interval=interval,
        duration=float(generator.uniform(10.0, 30.0 if interval > 0.015 else 18.0)),
        excursion=float(np.exp(generator.uniform(np.log(0.03), np.log(0.11)))),
        noise=float(np.exp(generator.uniform(np.log(0.5), np.log(3.0)))),
        elevator_noise=float(generator.choice([0.5, 1.0, 1.0, 5.0])),
        memory=float(generator.choice([0.0, 0.0, 0.0, generator.uniform(0.2, 0.8)])),
        off=float(generator.uniform(0.0, 0.12)),
    )


def shape(name: str, time: Array, unit: float, generator: np.random.Generator) -> Array:
    """An elevator input of unit size, (N,); its longest step is `unit` s or some of it."""
    start = 1.0
    levels = {
        "doublet": [(unit, 1.0), (unit, -1.0)],
        "3-2-1-1": [(0.5 * n * unit, s) for n, s in ((3, 1.0), (2, -1.0), (1, 1.0), (1, -1.0))],
        "2-1-1": [(unit, 1.0), (0.5 * unit, -1.0), (0.5 * unit, 1.0)],
        "pulses": [(0.4 * unit, 1.0), (2.5 * unit, 0.0), (0.4 * unit, -1.0), (2.0 * unit, 0.0), (0.4 * unit, 0.6)],
        "doublets": [(unit, 1.0), (unit, -1.0), (2.5 * unit, 0.0), (0.6 * unit, -0.5), (0.6 * unit, 0.5)],
        "staircase": [(unit, 0.35), (unit, 0.7), (unit, 1.0), (unit, 0.0), (unit, -0.6), (unit, 0.0)],
        "multistep": [(float(generator.uniform(0.3, 1.2)) * unit, float(generator.uniform(-1, 1))) for _ in range(9)],
    }.get(name)
    values = np.zeros(time.size)
    if levels is not None:
        if generator.random() < 0.5:
            levels = [(width, -level) for width, level in levels]
        for width, level in levels:
            values[(time >= start - 1e-9) & (time < start + width - 1e-9)] = level
            start += width
        return values
    length = min(time[-1] - 2.0, 6.0 * unit)
    inside = (time >= start) & (time <= start + length)
    at = time[inside] - start
    if name == "sweep":
        values[inside] = (
            chirp(at, 0.15 / unit, length, 1.2 / unit, phi=-90.0)
            * np.sin(np.pi * np.minimum(at / length, 1.0 - 1e-12)) ** 0.3
        )
    else:
        phases = generator.uniform(0.0, 2.0 * np.pi, 5)
        sine = sum(np.sin(2.0 * np.pi * (n + 1) * at / length + p) for n, p in enumerate(phases))
        values[inside] = 0.4 * sine * np.sin(np.pi * np.minimum(at / length, 1.0 - 1e-12)) ** 0.3
    return values


@dataclass
class Motion:
    """What a simulated flight did, on its samples; `terms` by the variables' names."""

    time: Array
    outputs: dict[str, Array]
    variables: dict[str, Array] = field(default_factory=dict)


def parsed_term(text: str) -> list[tuple[int, int]]:
    """Places in `VARIABLES` and powers of a term's factors."""
    factors = []
    for part in text.split("*"):
        name, _, power = part.partition("^")
        if name != "1":
            factors.append((VARIABLES.index(name), int(power or 1)))
    return factors


def _level(body: Body, terms: Mapping[tuple[str, str], float]) -> tuple[float, float, float]:
    """Angle of attack, elevator and thrust of level flight; what is planted and moves is at rest."""
    force = 0.5 * body.density * body.airspeed**2 * body.wing_area

    def unbalanced(x: Array) -> Array:
        values = dict.fromkeys(VARIABLES, 0.0) | {"alpha": float(x[0]), "delta_e": float(x[1])}
        total = dict.fromkeys(STRUCTURE, 0.0)
        for (coefficient, text), number in terms.items():
            total[coefficient] += number * math.prod(values[VARIABLES[i]] ** p for i, p in parsed_term(text))
        weight = body.mass * G / force
        return np.array(
            [total["C_X"] + x[2] - weight * math.sin(x[0]), total["C_Z"] + weight * math.cos(x[0]), total["C_m"]]
        )

    alpha, elevator, thrust = fsolve(unbalanced, [0.05, 0.0, 0.1])
    return float(alpha), float(elevator), float(thrust * force)


def simulated(
    body: Body, at: Circumstances, asked: Array, time: Array, plants: Sequence[Plant], seed: Sequence[int]
) -> tuple[Motion, float, float]:
    """The motion that an elevator deviation gives, with the trimmed elevator [rad] and thrust [N].

    Fourth-order Runge-Kutta at 5 ms or less; the elevator between samples is linear.
    """
    terms = dict(body.terms)
    for plant in plants:
        for coefficient, text, number in plant.terms:
            terms[coefficient, text] = terms.get((coefficient, text), 0.0) + number
    alpha, trimmed, thrust = _level(body, terms)
    parsed = [(("C_X", "C_Z", "C_m").index(c), number, parsed_term(t)) for (c, t), number in terms.items()]
    parts = max(1, math.ceil(at.interval / 0.005 - 1e-9))
    step = at.interval / parts
    half = np.arange(2 * parts * (time.size - 1) + 1) * 0.5 * step
    generator = np.random.default_rng([*seed, 7])
    elevator = trimmed + np.interp(half, time, asked)
    for plant in plants:
        if plant.control is not None:
            elevator = plant.control(half, elevator)
    offsets = np.zeros((3, half.size))
    inputs = {"delta_f": np.zeros(half.size), "delta_h": np.zeros(half.size)}
    push = np.full(half.size, thrust)
    air = np.zeros(half.size)
    for plant in plants:
        for coefficient, history in plant.driven:
            offsets[("C_X", "C_Z", "C_m").index(coefficient)] += history(half)
        for name, history in plant.inputs:
            inputs[name] = history(half)
        if plant.push is not None:
            push = plant.push(half, push)
        if plant.gust is not None:
            sigma, length = plant.gust
            keep = math.exp(-body.airspeed * 0.5 * step / length)
            shocks = sigma * math.sqrt(1.0 - keep**2) * generator.standard_normal(half.size)
            air = lfilter([1.0], [1.0, -keep], shocks, zi=[keep * sigma * generator.standard_normal()])[0]
    stall = next((plant.stall for plant in plants if plant.stall is not None), None)
    ground = next((plant.ground for plant in plants if plant.ground is not None), None)
    shift = next((plant.shift for plant in plants if plant.shift is not None), None)
    places = {"a_x": (0.0, 0.0), "a_z": (0.0, 0.0)} | {c: at for plant in plants for c, at in plant.places.items()}
    (ahead_x, below_x), (ahead_z, below_z) = places["a_x"], places["a_z"]
    remembered = [(plant.memory, n) for n, plant in enumerate(plants) if plant.memory is not None]
    span = body.wing_area / body.mean_chord
    area, chord, mass, inertia = body.wing_area, body.mean_chord, body.mass, body.I_yy
    lift_slope = body.C_Z[1]
    apparent = VARIABLES.index("alpha_dot_hat")
    rounds = 2 if any(place == apparent for _, _, factors in parsed for place, _ in factors) else 1
    # Numbers of Python's own: each of numpy's, taken from its array at every step, takes several times as long.
    air, elevator, push = air.tolist(), elevator.tolist(), push.tolist()
    flaps, stabiliser = inputs["delta_f"].tolist(), inputs["delta_h"].tolist()
    beside = offsets.T.tolist()

    def rates(x: list[float], k: int) -> tuple[list[float], tuple[float, ...]]:
        u, w, q, theta, height, separated, memory = x
        if not abs(theta) < 1.5:
            raise ArithmeticError("the flight turns over")
        relative = w - air[k]
        speed = math.hypot(u, relative)
        angle = math.atan2(relative, u)
        force = 0.5 * body.density * speed * speed * area
        q_hat = q * chord / (2.0 * body.airspeed)
        deflection = elevator[k]
        slope = 0.0
        for _ in range(rounds):
            values = (
                angle,
                q_hat,
                deflection,
                speed / body.airspeed - 1.0,
                slope * chord / (2.0 * body.airspeed),
                flaps[k],
                stabiliser[k],
            )
            total = list(beside[k])
            for place, number, factors in parsed:
                for i, power in factors:
                    number *= values[i] ** power
                total[place] += number
            separation_rate = 0.0
            if ground is not None:
                total[1] *= 1.0 + ground * math.exp(-2.48 * (2.0 * max(height, 0.0) / span) ** 0.768)
            a_x, a_z = (force * total[0] + push[k]) / mass, force * total[1] / mass
            w_dot = q * u + G * math.cos(theta) + a_z
            u_dot = -q * w - G * math.sin(theta) + a_x
            slope = (u * w_dot - relative * u_dot) / (speed * speed)
        if stall is not None:
            static = 0.5 * (
                1.0 - math.tanh(stall["sharpness"] * (angle - stall["delay"] * slope - stall["alpha_star"]))
            )
            separation_rate = (static - separated) / stall["relaxation"]
            point = min(max(separated, 0.0), 1.0)
            total[0] += stall["C_X"] * (1.0 - point)
            total[1] += lift_slope * angle * ((0.5 * (1.0 + math.sqrt(point))) ** 2 - 1.0)
            total[2] += stall["C_m"] * (1.0 - point)
        memory_rate = 0.0
        for (coefficient, number, source, constant), _ in remembered:
            value = {"alpha": angle, "delta_e": deflection, "speed": speed / body.airspeed - 1.0}[source]
            memory_rate = (value - memory) / constant
            total[("C_X", "C_Z", "C_m").index(coefficient)] += number * (memory - value)
        a_x, a_z = (force * total[0] + push[k]) / mass, force * total[1] / mass
        q_dot = force * chord * total[2] / inertia
        arm = 0.0
        if shift is not None and half[k] >= shift[1]:
            arm = shift[0]
            q_dot += arm * force * total[1] / inertia
        u_dot, w_dot = a_x - q * w - G * math.sin(theta), a_z + q * u + G * math.cos(theta)
        climb = u * math.sin(theta) - w * math.cos(theta)
        # accelerometers stay where the declared centre of gravity was
        along = a_x + below_x * q_dot - (ahead_x - arm) * q * q
        across = a_z - (ahead_z - arm) * q_dot - below_z * q * q
        seen = (speed, angle, q, theta, along, across, height, deflection)
        return [u_dot, w_dot, q_dot, q, climb, separation_rate, memory_rate], seen

    start = 1.0 if stall is None else 0.5 * (1.0 - math.tanh(stall["sharpness"] * (alpha - stall["alpha_star"])))
    first = {"alpha": alpha, "delta_e": trimmed, "speed": 0.0}
    remains = first[remembered[0][0][2]] if remembered else 0.0
    altitude = 1500.0 if ground is None else 0.5 * span
    x = [body.airspeed * math.cos(alpha), body.airspeed * math.sin(alpha), 0.0, alpha, altitude, start, remains]
    rows = []
    for k in range(0, half.size, 2):
        one, seen = rates(x, k)
        if (k // 2) % parts == 0:
            rows.append(seen)
        if k + 2 >= half.size:
            break
        two, _ = rates([a + 0.5 * step * b for a, b in zip(x, one, strict=True)], k + 1)
        three, _ = rates([a + 0.5 * step * b for a, b in zip(x, two, strict=True)], k + 1)
        four, _ = rates([a + step * b for a, b in zip(x, three, strict=True)], k + 2)
        x = [
            a + step / 6.0 * (p + 2.0 * q + 2.0 * r + s) for a, p, q, r, s in zip(x, one, two, three, four, strict=True)
        ]
    table = np.array(rows)
    outputs = dict(zip(("V", "alpha", "q", "theta", "a_x", "a_z", "h", "delta_e"), table.T, strict=True))
    return Motion(time, outputs), trimmed, thrust


def recorded(
    motion: Motion, at: Circumstances, asked: Array, plants: Sequence[Plant], seed: Sequence[int], name: str
) -> FlightLog:
    """What a recorder holds of a motion: `asked` [rad] is what it takes the elevator for."""
    generator = np.random.default_rng([*seed, 1])
    time = motion.time
    channels = {channel: values.copy() for channel, values in motion.outputs.items()} | {"delta_e": asked.copy()}
    for plant in plants:
        for channel, change in plant.sensors:
            channels[channel] = change(time, channels[channel], motion.outputs)
    for channel, deviation in NOISE.items():
        size = deviation * (at.elevator_noise if channel == "delta_e" else at.noise)
        keep = 0.0 if channel == "delta_e" else at.memory
        shocks = generator.standard_normal(time.size + 50)
        channels[channel] += size * math.sqrt(1.0 - keep**2) * lfilter([1.0], [1.0, -keep], shocks)[50:]
    for plant in plants:
        for channel, change in plant.recorders:
            channels[channel] = change(time, channels[channel], generator)
        for channel, history in plant.logged:
            channels[channel] = history(time)
    units = {channel: UNITS.get(channel, "rad") for channel in channels}
    return FlightLog(name, time, channels, units)


def aircraft_text(at: Circumstances, thrust: float, logged_thrust: bool, seed: Sequence[int]) -> str:
    """The aircraft file: the structure that flies but for what is planted, its numbers off by up to `off`."""
    generator = np.random.default_rng([*seed, 2])
    body = at.body
    lines = [
        "schema = 1",
        "[aircraft]",
        f'name = "{body.name}"',
        'source = "a-priori estimate"',
        "[reference]",
        f"wing_area = {body.wing_area}",
        f"mean_chord = {body.mean_chord}",
        f"airspeed = {body.airspeed}",
        "[mass]",
        f"mass = {body.mass}",
        f"I_yy = {body.I_yy}",
        "[air]",
        f"density = {body.density}",
    ]
    if not logged_thrust:
        lines += ["[thrust]", f"force = {thrust:.2f}"]
    for coefficient, names in STRUCTURE.items():
        lines.append(f"[derivatives.{coefficient}]")
        for name, value in zip(names, getattr(body, coefficient), strict=True):
            given = value * (1.0 + at.off * float(generator.uniform(-1.0, 1.0)))
            lines.append(f'"{name}" = {{ value = {given:.5g}, sigma = {max(0.01, 0.8 * at.off) * abs(value):.3g} }}')
    return "\n".join(lines) + "\n"


def csv_text(log: FlightLog) -> str:
    """The native log."""
    head = ",".join(["time [s]", *(f"{name} [{unit}]" for name, unit in log.units.items())])
    table = np.column_stack([log.time, *(log[name] for name in log.units)])
    rows = [",".join("" if math.isnan(v) else f"{v:.7g}" for v in row) for row in table]
    return "\n".join([head, *rows]) + "\n"
