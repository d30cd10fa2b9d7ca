"""A short list of (model, input, truth): aircraft with the terms they fly and do not declare, and their logs.

Flights are made by `aerosid.flight_model.simulation`, which tests/flight_model holds to an independent integration.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from aerosid.aircraft import Aircraft, Derivative, load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.simulation import doublet, fly, steps, three_two_one_one, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.search.candidate_terms import candidate_entries

Truth = Mapping[tuple[str, str], float]

NOISE = {
    "V": 0.15,
    "alpha": 0.0015,
    "q": 0.0012,
    "theta": 0.0012,
    "a_x": 0.02,
    "a_z": 0.05,
    "h": 0.3,
    "delta_e": 0.0002,
}
"""Standard deviations of good flight-test sensors, SI."""

SILENT = dict.fromkeys([*NOISE, "q_dot"], 0.0)
BOTH_SQUARES: Truth = {("C_X", "alpha^2"): 3.6089, ("C_m", "alpha^2"): -1.715}
"""What the paper's aircraft flies and does not declare."""

LIGHT = load_aircraft("light_transport")
AIRSPEED = 100.0


def entry(coefficient: str, text: str) -> Entry:
    return coefficient, parse_term(text)


def terms_of(model: AerodynamicModel) -> Truth:
    """The model's values as the oracles take them, by coefficient and term as text."""
    return {(c, str(t)): float(v) for (c, t), v in zip(model.entries, model.values, strict=True)}


def from_derivatives(name: str, derivatives: Iterable[Derivative]) -> Aircraft:
    """The light transport's body with other derivatives, as an aircraft file would say it."""
    lines = [
        "schema = 1",
        f'aircraft = {{ name = "{name}", source = "tests" }}',
        f"reference = {{ wing_area = {LIGHT.wing_area}, mean_chord = {LIGHT.mean_chord}, airspeed = 100.0 }}",
        f"mass = {{ mass = {LIGHT.mass}, I_yy = {LIGHT.I_yy} }}",
        f"air = {{ density = {LIGHT.density} }}",
    ]
    tables: dict[str, list[str]] = {}
    for d in derivatives:
        fixed = ", fixed = true" if d.fixed else ""
        tables.setdefault(d.coefficient, []).append(f'"{d.term}" = {{ value = {float(d.value)!r}{fixed} }}')
    for coefficient, rows in tables.items():
        lines += [f"[derivatives.{coefficient}]", *rows]
    return aircraft_from_text("\n".join(lines) + "\n", f"{name}.toml", "0" * 64)


def declaring(aircraft: Aircraft, values: Truth, fixed: tuple[tuple[str, str], ...] = ()) -> Aircraft:
    """The aircraft with derivatives replaced or added, some of them fixed."""
    wanted = {entry(*key): value for key, value in values.items()}
    held = {entry(*key) for key in fixed}
    rows = [
        replace(d, value=wanted.pop((d.coefficient, d.term), d.value), fixed=(d.coefficient, d.term) in held)
        for d in aircraft.derivatives
    ]
    rows += [Derivative(c, t, value, None, (c, t) in held) for (c, t), value in wanted.items()]
    return from_derivatives("declaring", rows)


UNSTABLE = declaring(LIGHT, {("C_m", "alpha"): 0.53})
"""Pitch divergence that doubles in about a second: `test_refinement.py` holds it to that."""

LIFT_AND_DRAG = from_derivatives(
    "light transport in lift and drag",
    [
        Derivative(c, parse_term(text), value)
        for c, text, value in (
            ("C_D", "1", 0.030),
            ("C_D", "alpha", 0.12),
            ("C_L", "1", 0.12),
            ("C_L", "alpha", 5.6),
            ("C_L", "q_hat", 4.3),
            ("C_L", "delta_e", 0.40),
            ("C_m", "1", 0.055),
            ("C_m", "alpha", -0.729),
            ("C_m", "q_hat", -16.3),
            ("C_m", "delta_e", -1.94),
        )
    ],
)

POLAR = declaring(LIFT_AND_DRAG, {("C_D", "C_L^2"): 0.05})
"""Drag by a polar, C_D = C_D0 + C_D_alpha alpha + k C_L^2."""

POLAR_EXPANDED = declaring(
    LIFT_AND_DRAG,
    {
        ("C_D", "1"): 0.030 + 0.05 * 0.12**2,
        ("C_D", "alpha"): 0.12 + 0.05 * 2 * 0.12 * 5.6,
        ("C_D", "q_hat"): 0.05 * 2 * 0.12 * 4.3,
        ("C_D", "delta_e"): 0.05 * 2 * 0.12 * 0.40,
        ("C_D", "alpha^2"): 0.05 * 5.6**2,
        ("C_D", "q_hat^2"): 0.05 * 4.3**2,
        ("C_D", "delta_e^2"): 0.05 * 0.40**2,
        ("C_D", "alpha*q_hat"): 0.05 * 2 * 5.6 * 4.3,
        ("C_D", "alpha*delta_e"): 0.05 * 2 * 5.6 * 0.40,
        ("C_D", "q_hat*delta_e"): 0.05 * 2 * 4.3 * 0.40,
    },
)
"""The same drag without a polar: C_L is multiplied out."""

BODY_POLAR = declaring(LIGHT, {("C_X", "C_Z^2"): -0.04, ("C_m", "theta"): 0.01})
"""The same in body axes, with a moment of attitude."""

LEVELS = ((0.9, 1.0), (0.9, -1.0), (0.9, 0.45), (0.9, -0.45), (0.6, 0.67), (0.6, -0.67))
"""Durations [s] and sizes of steps."""


@dataclass(frozen=True)
class Problem:
    """A declared aircraft, what it flies beside that, and how it is flown.

    `undeclared` terms are flown and not declared; `elevator` is one of doublet, 3211, levels
    (steps of several sizes: with one size only, a dead band is a weaker elevator), none.
    """

    aircraft: Aircraft = LIGHT
    undeclared: Truth = field(default_factory=dict)
    elevator: str = "doublet"
    amplitude: float = 0.06
    duration: float = 12.0
    interval: float = 0.03
    noise: Mapping[str, float] = field(default_factory=lambda: NOISE)
    airspeed: float = AIRSPEED

    @property
    def time(self) -> NDArray[np.float64]:
        time = np.arange(round(self.duration / self.interval)) * self.interval
        time.setflags(write=False)  # as a log's: kernels are compiled once for both
        return time

    @property
    def deflection(self) -> NDArray[np.float64]:
        shapes = {
            "doublet": lambda t: doublet(t, 1.0, 1.0, self.amplitude),
            "3211": lambda t: three_two_one_one(t, 1.0, 0.6, self.amplitude),
            "levels": lambda t: steps(t, 1.0, [(w, self.amplitude * s) for w, s in LEVELS]),
            "none": np.zeros_like,
        }
        return shapes[self.elevator](self.time)

    @property
    def truth(self) -> AerodynamicModel:
        """The model that is flown."""
        declared = declared_model(self.aircraft, self.airspeed)
        wanted = {entry(*key): value for key, value in self.undeclared.items()}
        # delta_e needs a column even where no declared term names it
        model = declared_model(self.aircraft, self.airspeed, [parse_term("delta_e"), *(t for _, t in wanted)])
        model = model.extended(wanted)
        values = [wanted.get(e, 0.0) + declared.value(e) for e in model.entries]
        return model.with_values(np.array(values))

    def fly(self, seed: int = 0, name: str = "flight") -> FlightLog:
        """The recorded log."""
        density, mass = self.aircraft.density, self.aircraft.mass
        assert density is not None
        level = trim(self.truth, self.airspeed, density, mass)
        log = fly(
            self.truth,
            level,
            self.time,
            self.deflection,
            density=density,
            mass=mass,
            noise=self.noise,
            seed=seed,
            name=name,
        )
        return with_thrust(log, level.thrust)

    def candidates(self, log: FlightLog) -> tuple[Entry, ...]:
        return candidate_entries(self.aircraft, [log])

    def prepared(self, log: FlightLog) -> tuple[AerodynamicModel, Manoeuvre]:
        """The declared model with columns for every candidate, and the log as the estimators take it."""
        model = declared_model(self.aircraft, self.airspeed, [term for _, term in self.candidates(log)])
        return model, prepare(log, self.aircraft, model.columns)


def with_channels(log: FlightLog, **channels: NDArray[np.float64] | None) -> FlightLog:
    """The log with channels added or replaced; a value of None drops one."""
    held = {name: values for name, values in {**log.channels, **channels}.items() if values is not None}
    units = {name: log.units.get(name, "1") for name in held}
    return FlightLog(log.name, log.time, held, units)


def shaken(log: FlightLog, seed: int) -> FlightLog:
    """The log with noise in theta and a_z that follows itself: something is left, whatever is found."""
    white = np.random.default_rng(seed).normal(0.0, 1.0, log.time.size)
    slow = lfilter([0.06], [1.0, -0.98], white)
    return with_channels(log, theta=log["theta"] + 0.004 * slow, a_z=log["a_z"] + 0.3 * slow)


def with_thrust(log: FlightLog, thrust: float) -> FlightLog:
    """The log with the trim's thrust as a channel: the aircraft file's force holds one trim only."""
    channels = {**log.channels, "thrust": np.full(log.time.size, thrust)}
    return FlightLog(log.name, log.time, channels, {**log.units, "thrust": "N"})


def native_csv(log: FlightLog) -> str:
    """The log in the native format, nine digits."""
    header = ",".join(["time [s]", *(f"{name} [{log.units[name]}]" for name in log.channels)])
    rows = [
        ",".join("" if np.isnan(value) else f"{value:.9g}" for value in row)
        for row in np.column_stack([log.time, *log.channels.values()])
    ]
    return header + "\n" + "\n".join(rows) + "\n"
