"""Whole flights of a six-degree-of-freedom aircraft, flown by an autopilot from test to test: what a finder must find.

Everything is in units of V/g, so that one plan is flown by a model aircraft and by an airliner alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS

G = 9.80665


@dataclass(frozen=True)
class Airframe:
    """Size, mass and the airspeed at which the tests are flown, SI."""

    name: str
    mass: float
    wing_area: float
    span: float
    chord: float
    airspeed: float
    density: float


MODEL = Airframe("model", 5.0, 0.5, 2.0, 0.26, 18.0, 1.2)
LIGHT = Airframe("light", 1100.0, 16.0, 11.0, 1.5, 52.0, 1.1)
JET = Airframe("jet", 6200.0, 30.0, 15.9, 2.06, 105.0, 1.0)
AIRLINER = Airframe("airliner", 60000.0, 122.0, 34.0, 4.2, 190.0, 0.5)

Controls = dict[str, float]


@dataclass
class Flight:
    """A flight under way: state, recorded rows and what was flown."""

    frame: Airframe
    seed: int
    turbulence: float = 0.0  # m/s, over the airspeed
    state: np.ndarray = field(default_factory=lambda: np.zeros(10))  # u v w p q r phi theta psi h
    time: float = 0.0
    rows: list[list[float]] = field(default_factory=list)
    truth: list[tuple[str, float, float]] = field(default_factory=list)
    trim: tuple[float, float] = (0.0, 0.0)  # elevator, thrust
    gust: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        self.unit = self.frame.airspeed / G
        self.step = 0.005 * self.unit
        self.random = np.random.default_rng(self.seed)
        alpha, elevator, thrust = _trim(self.frame, self.frame.airspeed)
        self.trim = elevator, thrust
        self.speed, self.height, self.bank = self.frame.airspeed, 2000.0, 0.0
        self.state[[0, 2, 7, 9]] = self.speed * math.cos(alpha), self.speed * math.sin(alpha), alpha, self.height

    def fly(self, units: float, control: Callable[[float], Controls]) -> None:
        """Advance by `units` V/g with what `control` says at the time since the start, in V/g."""
        start = self.time
        for _ in range(round(units * self.unit / self.step)):
            said = control((self.time - start) / self.unit)
            self._advance(said.get("delta_e", 0.0), said.get("delta_a", 0.0), said.get("delta_r", 0.0), said["thrust"])

    def cruise(self, units: float) -> None:
        """Autopilot: height, speed and bank held."""
        self.fly(units, lambda _: self.autopilot())

    def autopilot(self) -> Controls:
        """What holds height, speed and bank."""
        u, v, w, p, q, r, phi, theta, _, h = self.state
        speed = math.sqrt(u * u + v * v + w * w)
        alpha, elevator, thrust = _trim(self.frame, self.speed)
        climb = math.asin(max(-1.0, min(1.0, math.sin(theta - math.atan2(w, u)))))
        wanted = max(-0.12, min(0.12, (self.height - h) / (3.0 * self.unit * self.speed)))
        pitch = alpha / max(0.5, math.cos(phi)) + wanted
        delta_e = elevator + 0.15 * (theta - pitch) + 0.1 * (climb - wanted) + 0.03 * q * self.unit
        slow = 0.4 * self.frame.span / (self.frame.airspeed * self.unit)
        delta_a = slow * (12.0 * (phi - self.bank) + 3.0 * p * self.unit)
        delta_r = 0.05 * (r * self.unit - math.sin(phi))
        force = thrust + self.frame.mass * (self.speed - speed) / (1.5 * self.unit)
        return {
            "delta_e": max(elevator - 0.03, min(elevator + 0.03, delta_e)),
            "delta_a": max(-2.0 * slow, min(2.0 * slow, delta_a)),
            "delta_r": max(-0.1, min(0.1, delta_r)),
            "thrust": max(0.0, min(0.6 * self.frame.mass * G, force)),
        }

    def hold(self, lateral: bool = True, **moved: Callable[[float], float]) -> Callable[[float], Controls]:
        """The controls of level flight with what is moved on top; the wings held level by a pilot or not."""
        _, elevator, thrust = _trim(self.frame, self.speed)
        now = {"delta_e": elevator, "delta_a": 0.0, "delta_r": 0.0, "thrust": thrust}

        # Who flies a longitudinal test holds the wings level meanwhile.
        level = lateral and not {"delta_a", "delta_r"} & set(moved)

        def said(t: float) -> Controls:
            if level:
                now["delta_a"] = self.autopilot()["delta_a"]
            return {name: value + (moved[name](t) if name in moved else 0.0) for name, value in now.items()}

        return said

    def log(self, noise: float = 1.0, name: str = "simulated flight") -> FlightLog:
        """What a recorder would hold; noise 1 is that of a good installation."""
        data = np.array(self.rows)
        time = data[:, 0]
        names = ("V", "alpha", "beta", "p", "q", "r", "phi", "theta", "h", "a_x", "a_y", "a_z")
        names = (*names, "delta_e", "delta_a", "delta_r")
        deviations = dict.fromkeys(names, 2e-4)
        deviations |= {"V": 2e-3 * self.frame.airspeed * 0.2, "h": 0.05, "a_x": 0.01, "a_y": 0.01, "a_z": 0.02}
        deviations |= dict.fromkeys(("p", "q", "r"), 0.002 / self.unit)
        channels = {
            channel: data[:, 1 + k] + noise * deviations[channel] * self.random.standard_normal(time.size)
            for k, channel in enumerate(names)
        }
        return FlightLog(name, time, channels, {channel: CHANNELS[channel].unit for channel in names})

    def _advance(self, delta_e: float, delta_a: float, delta_r: float, thrust: float) -> None:
        # A first-order gust with a length of three seconds of flight, in w and v; it also rolls.
        keep = math.exp(-self.step / (0.3 * self.unit))
        sigma = self.turbulence * self.frame.airspeed
        self.gust = keep * self.gust + sigma * math.sqrt(1.0 - keep * keep) * self.random.standard_normal(3)
        rates, force = _rates(self.frame, self.state, self.gust, delta_e, delta_a, delta_r, thrust)
        middle = self.state + 0.5 * self.step * rates
        rates, _ = _rates(self.frame, middle, self.gust, delta_e, delta_a, delta_r, thrust)
        u, v, w, p, q, r, phi, theta, _, h = self.state
        speed = math.sqrt(u * u + v * v + w * w)
        air = (u, v + self.gust[1], w + self.gust[0])
        row = [self.time, speed, math.atan2(air[2], air[0]), math.asin(air[1] / speed), p, q, r, phi, theta, h]
        self.rows.append([*row, *force, delta_e, delta_a, delta_r])
        self.state = self.state + self.step * rates
        self.time += self.step


def _coefficients(frame: Airframe, alpha: float, q_hat: float, delta_e: float) -> tuple[float, float, float]:
    """Lift, drag and pitching moment, with a gentle stall past 0.24 rad."""
    over = max(0.0, alpha - 0.24)
    lift = 0.2 + 5.2 * alpha - 9.0 * over + 6.0 * q_hat + 0.5 * delta_e
    drag = 0.03 + 0.045 * lift * lift + 0.5 * over
    moment = 0.02 - 0.7 * alpha - 18.0 * q_hat - 1.3 * delta_e - 3.0 * over
    return lift, drag, moment


def _rates(
    frame: Airframe,
    x: np.ndarray,
    gust: np.ndarray,
    delta_e: float,
    delta_a: float,
    delta_r: float,
    thrust: float,
) -> tuple[np.ndarray, tuple[float, float, float]]:
    u, v, w, p, q, r, phi, theta, _, _ = x
    ua, va, wa = u, v + gust[1], w + gust[0]
    speed = math.sqrt(ua * ua + va * va + wa * wa)
    alpha, beta = math.atan2(wa, ua), math.asin(va / speed)
    pressure = 0.5 * frame.density * speed * speed * frame.wing_area
    q_hat = q * frame.chord / (2.0 * speed)
    p_hat, r_hat = p * frame.span / (2.0 * speed), r * frame.span / (2.0 * speed)
    p_hat += 0.05 * gust[2] / speed
    lift, drag, moment = _coefficients(frame, alpha, q_hat, delta_e)
    x_force = pressure * (lift * math.sin(alpha) - drag * math.cos(alpha)) + thrust
    z_force = pressure * (-lift * math.cos(alpha) - drag * math.sin(alpha))
    y_force = pressure * (-0.75 * beta + 0.2 * delta_r)
    roll = pressure * frame.span * (-0.08 * beta - 0.5 * p_hat + 0.15 * r_hat - 0.2 * delta_a + 0.02 * delta_r)
    yaw = pressure * frame.span * (0.1 * beta - 0.05 * p_hat - 0.16 * r_hat - 0.09 * delta_r)
    mass = frame.mass
    inertia = (mass * (0.128 * frame.span) ** 2, mass * (1.2 * frame.chord) ** 2, mass * (0.21 * frame.span) ** 2)
    force = x_force / mass, y_force / mass, z_force / mass
    sin_phi, cos_phi, sin_theta, cos_theta = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    return np.array(
        [
            force[0] - G * sin_theta - q * w + r * v,
            force[1] + G * cos_theta * sin_phi - r * u + p * w,
            force[2] + G * cos_theta * cos_phi + q * u - p * v,
            (roll + (inertia[1] - inertia[2]) * q * r) / inertia[0],
            (pressure * frame.chord * moment + (inertia[2] - inertia[0]) * p * r) / inertia[1],
            (yaw + (inertia[0] - inertia[1]) * p * q) / inertia[2],
            p + math.tan(theta) * (q * sin_phi + r * cos_phi),
            q * cos_phi - r * sin_phi,
            (q * sin_phi + r * cos_phi) / cos_theta,
            u * sin_theta - v * sin_phi * cos_theta - w * cos_phi * cos_theta,
        ]
    ), force


def _trim(frame: Airframe, speed: float) -> tuple[float, float, float]:
    """Angle of attack, elevator and thrust of level flight."""
    pressure = 0.5 * frame.density * speed * speed * frame.wing_area
    elevator = thrust = alpha = 0.0
    for _ in range(30):
        weight = (frame.mass * G - thrust * math.sin(alpha)) / pressure
        alpha = (weight - 0.2 - 0.5 * elevator) / 5.2
        elevator = (0.02 - 0.7 * alpha) / 1.3
        thrust = pressure * _coefficients(frame, alpha, 0.0, elevator)[1] / math.cos(alpha)
    return alpha, elevator, thrust


def stepwise(levels: Sequence[tuple[float, float]], ramp: float = 0.02) -> Callable[[float], float]:
    """A function of time in V/g from (duration, level) pairs, with edges that take `ramp` V/g."""
    edges = np.cumsum([0.0, *(duration for duration, _ in levels)])
    times, values = [], []
    before = 0.0
    for edge, (_, level) in zip(edges, levels, strict=False):
        times += [edge, edge + ramp]
        values += [before, level]
        before = level
    times += [edges[-1], edges[-1] + ramp]
    values += [before, 0.0]
    return lambda t: float(np.interp(t, times, values))


def fly_test(flight: Flight, kind: str, units: float, settle: float, **moved: Callable[[float], float]) -> None:
    """Fly one input and its answer, and note what it was and when."""
    start = flight.time
    flight.fly(units + settle, flight.hold(**moved))
    flight.truth.append((kind, start, start + (units + min(settle, 0.3)) * flight.unit))


def sweep(duration: float, first: float, last: float, level: float) -> Callable[[float], float]:
    """A sine whose frequency goes from `first` to `last`, in cycles per V/g."""
    rate = math.log(last / first) / duration

    def value(t: float) -> float:
        if not 0.0 <= t <= duration:
            return 0.0
        return level * math.sin(2.0 * math.pi * first * (math.exp(rate * t) - 1.0) / rate)

    return value


def multisine(duration: float, harmonics: Sequence[int], level: float) -> Callable[[float], float]:
    """Sines of Schroeder's phases over one period."""
    count = len(harmonics)
    phases = [-math.pi * k * (k + 1) / count for k in range(count)]

    def value(t: float) -> float:
        if not 0.0 <= t <= duration:
            return 0.0
        edge = min(1.0, t / (0.05 * duration), (duration - t) / (0.05 * duration))
        wave = sum(math.cos(2.0 * math.pi * n * t / duration + p) for n, p in zip(harmonics, phases, strict=True))
        return edge * level * wave / math.sqrt(0.5 * count)

    return value


def eigenmotions(flight: Flight, size: float = 1.0) -> None:
    """Phugoid, short period, Dutch roll, roll and spiral, with the autopilot between them."""
    flight.cruise(10.0)
    start = flight.time
    flight.fly(2.0, flight.hold(delta_e=stepwise([(2.0, -0.006 * size)])))
    flight.truth.append(("elevator_pulse", start, flight.time))
    start = flight.time
    flight.fly(14.0, flight.hold())
    flight.truth.append(("phugoid", start, flight.time))
    flight.cruise(12.0)
    fly_test(flight, "short_period", 1.0, 0.6, delta_e=stepwise([(1.0, -0.02 * size)]))
    flight.cruise(12.0)
    rudder = stepwise([(0.15, 0.09 * size), (0.15, -0.09 * size)])
    start = flight.time
    flight.fly(1.8, flight.hold(delta_r=rudder))
    flight.truth.append(("dutch_roll", start, flight.time))
    flight.cruise(10.0)
    flight.bank = -0.7
    flight.cruise(3.0)
    start = flight.time
    # At 1.25 V/(2 b): a bank of 1.6 rad per V/g.
    aileron = -1.6 * 0.5 * 0.5 / 0.2 * flight.frame.span / (flight.frame.airspeed * flight.unit)
    while flight.state[6] < 0.7:
        flight.fly(0.01, flight.hold(delta_a=lambda _: aileron))
    flight.truth.append(("aperiodic_roll", start, flight.time))
    flight.bank = 0.0
    flight.cruise(10.0)
    flight.bank = 0.2
    flight.cruise(3.0)
    start = flight.time
    flight.fly(9.0, flight.hold(lateral=False))
    flight.truth.append(("spiral", start, flight.time))
    flight.bank = 0.0
    flight.cruise(12.0)


def designed_inputs(flight: Flight, size: float = 1.0) -> None:
    """Doublet, 2-1-1, 3-2-1-1, steps, sweep and multisine of the elevator, and an aileron doublet."""
    unit, level = 0.09, 0.03 * size
    one, two, three = ((k * unit, level) for k in (1, 2, 3))

    def back(pair: tuple[float, float]) -> tuple[float, float]:
        return pair[0], -pair[1]

    flight.cruise(8.0)
    fly_test(flight, "doublet", 0.2, 0.8, delta_e=stepwise([one, back(one)]))
    flight.cruise(8.0)
    fly_test(flight, "211", 0.4, 0.8, delta_e=stepwise([two, back(one), one]))
    flight.cruise(8.0)
    fly_test(flight, "3211", 0.65, 0.8, delta_e=stepwise([three, back(two), one, back(one)]))
    flight.cruise(8.0)
    low = 0.5 * level
    train = [(0.5, low), (0.6, -low), (0.4, low), (0.7, -low)]
    fly_test(flight, "steps", 2.2, 0.6, delta_e=stepwise(train))
    flight.cruise(8.0)
    fly_test(flight, "sweep", 3.0, 0.6, delta_e=sweep(3.0, 0.7, 6.0, 0.6 * level))
    flight.cruise(8.0)
    fly_test(flight, "multisine", 2.0, 0.6, delta_e=multisine(2.0, (2, 3, 5, 7, 8, 10), 0.6 * level))
    flight.cruise(8.0)
    roll = 2.0 * flight.frame.span / (flight.frame.airspeed * flight.unit)
    fly_test(flight, "doublet", 0.2, 1.0, delta_a=stepwise([(unit, roll), (unit, -roll)]))
    flight.cruise(8.0)


def changes_of_condition(flight: Flight) -> None:
    """Turns, climbs and changes of speed by the autopilot: nothing of this is a test."""
    for speed in (0.9, 0.8, 1.1, 1.0):
        flight.cruise(8.0)
        flight.speed = speed * flight.frame.airspeed
    flight.cruise(10.0)
    for climb in (30.0, -30.0):
        flight.height += climb * flight.unit
        flight.cruise(15.0)
    flight.cruise(8.0)
    for bank in (0.5, 0.0, -0.4, 0.0):
        start = flight.time
        flight.bank = bank
        flight.cruise(8.0)
        if bank:
            flight.truth.append(("turn", start, flight.time))
