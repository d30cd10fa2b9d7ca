"""The task that every tool is set: the sample flight of the light transport, whose alpha^2 terms are not declared.

Everybody gets the time, the recorded elevator, seven noisy channels, the aircraft's constants and its declared
derivatives. What is asked: what is missing, and every derivative. The truth is known, for the flight is simulated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.estimation.manoeuvre import prepare
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.simulation import doublet, fly, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.studies.cramer_rao import sensitivity
from benchmarks.flights import INTERVAL, NOISE, UNDECLARED, flown_model, light_transport

Array = NDArray[np.float64]

CHANNELS = ("V", "alpha", "q", "theta", "a_x", "a_z", "h")
LIBRARY = (
    *("1", "alpha", "q_hat", "delta_e", "alpha^2", "alpha*q_hat", "alpha*delta_e"),
    *("q_hat^2", "q_hat*delta_e", "delta_e^2"),
)
"""Every product of alpha, q_hat and delta_e up to the second degree: the columns of a table of derivatives."""

COEFFICIENTS = ("C_X", "C_Z", "C_m")
"""Its rows."""

SAMPLE_SEED = 1994
SAMPLES = 470
SENSORS = {name: (NOISE | {"h": 0.3})[name] for name in (*CHANNELS, "delta_e")}
AIRSPEED = 100.0


class Body(NamedTuple):
    """The aircraft's constants, SI; `reference_speed` that of q_hat."""

    mass: float
    I_yy: float
    wing_area: float
    mean_chord: float
    reference_speed: float
    density: float
    thrust: float


@dataclass(frozen=True)
class Record:
    """One flight as recorded: `time`, `elevator` (N,), `measured` (N, 7) in the order of CHANNELS, and as a log."""

    log: FlightLog

    @cached_property
    def time(self) -> Array:
        """Instants of the samples, s."""
        return np.array(self.log.time)

    @cached_property
    def elevator(self) -> Array:
        """As recorded, rad."""
        return np.array(self.log["delta_e"])

    @cached_property
    def measured(self) -> Array:
        """Channels, SI."""
        return np.column_stack([self.log[name] for name in CHANNELS])

    @cached_property
    def start(self) -> Array:
        """A first guess of u, w, q, theta, h (5,): means of the first five samples."""
        V, alpha, q, theta, _, _, h = self.measured[:5].mean(axis=0)
        return np.array([V * np.cos(alpha), V * np.sin(alpha), q, theta, h])


@dataclass(frozen=True)
class Task:
    """What is given and what is true.

    Attributes
    ----------
    aircraft : Aircraft
        As its file declares it.
    body : Body
    deviations : ndarray, shape (7,)
        Of the channels' noise, SI: as of the sensors' data sheets.
    declared, true : ndarray, shape (3, 10)
        Tables of derivatives.
    structure : ndarray of bool, shape (3, 10)
        Where the true table holds one.
    validation : Record
        The second sample flight, a 3-2-1-1.
    """

    aircraft: Aircraft
    body: Body
    deviations: Array
    declared: Array
    true: Array
    structure: NDArray[np.bool_]
    validation: Record

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The true derivatives, in the order of the table's places."""
        return tuple(
            (COEFFICIENTS[row], parse_term(LIBRARY[column])) for row, column in np.argwhere(self.structure).tolist()
        )

    def flights(self, count: int) -> Iterator[Record]:
        """The sample flight, then the same with other noise."""
        yield Record(_sample("doublet"))
        for seed in range(SAMPLE_SEED + 1, SAMPLE_SEED + count):
            yield Record(sample_flight(seed))

    def bound(self) -> Array:
        """The Cramer-Rao bound of each true derivative, (12,): structure known, initial state unknown."""
        model = flown_model(self.aircraft)
        clean = sample_flight(SAMPLE_SEED, noisy=False)
        manoeuvre = prepare(clean, self.aircraft, model.columns)
        level = Record(clean)
        held = sensitivity(model, manoeuvre, level.measured[0, [0, 0, 2, 3, 6]] * _split(level), self.entries,
                           np.array([True]))  # fmt: skip
        assert held is not None
        noise = np.zeros((len(CHANNELS), len(CHANNELS), SAMPLES))
        for place, name in enumerate(manoeuvre.outputs):
            noise[place, place, 0] = SENSORS[name] ** 2
        return held.bound(noise, np.array([SENSORS["delta_e"] ** 2]))


def _split(level: Record) -> Array:
    """Factors that turn V, V, q, theta, h of the first sample into u, w, q, theta, h."""
    alpha = level.measured[0, 1]
    return np.array([np.cos(alpha), np.sin(alpha), 1.0, 1.0, 1.0])


def sample_flight(seed: int, noisy: bool = True) -> FlightLog:
    """The doublet of flight_data/, with noise of another seed, or none."""
    aircraft = light_transport()
    model: AerodynamicModel = flown_model(aircraft)
    assert aircraft.density is not None
    time = np.arange(SAMPLES) * INTERVAL
    noise = SENSORS if noisy else dict.fromkeys(SENSORS, 0.0)
    level = trim(model, AIRSPEED, aircraft.density, aircraft.mass)
    elevator = doublet(time, 1.02, 1.02, 0.06)
    return fly(
        model, level, time, elevator, density=aircraft.density, mass=aircraft.mass, noise=noise, seed=seed,
        name=f"light transport, doublet, seed {seed}",
    )  # fmt: skip


def sample_task() -> Task:
    """The task."""
    aircraft = light_transport()
    assert aircraft.density is not None
    assert aircraft.thrust is not None
    assert aircraft.airspeed is not None
    declared = np.zeros((len(COEFFICIENTS), len(LIBRARY)))
    for row in aircraft.derivatives:
        declared[COEFFICIENTS.index(row.coefficient), LIBRARY.index(str(row.term))] = row.value
    true = declared.copy()
    for (coefficient, term), value in UNDECLARED.items():
        true[COEFFICIENTS.index(coefficient), LIBRARY.index(str(term))] = value
    body = Body(
        aircraft.mass, aircraft.I_yy, aircraft.wing_area, aircraft.mean_chord, aircraft.airspeed, aircraft.density,
        aircraft.thrust,
    )  # fmt: skip
    deviations = np.array([SENSORS[name] for name in CHANNELS])
    return Task(aircraft, body, deviations, declared, true, true != 0.0, Record(_sample("3211")))


def _sample(name: str) -> FlightLog:
    return read_log(str(bundled_folder("flight_data") / f"light_transport_{name}.csv"))


@dataclass(frozen=True)
class Answer:
    """What a tool gives back.

    Attributes
    ----------
    values : ndarray, shape (3, 10)
        The table of derivatives; zero where it holds none.
    std_errors : ndarray, shape (3, 10), or None
        NaN where there is none; None where the tool gives none at all.
    named : frozenset of (str, str), or None
        Coefficient and term of what it says is missing; None where it was told the structure.
    """

    values: Array
    std_errors: Array | None
    named: frozenset[tuple[str, str]] | None


def table_of(values: Array, places: NDArray[np.bool_], elsewhere: float) -> Array:
    """A table (3, 10) from the numbers at its places."""
    table = np.full(places.shape, elsewhere)
    table[places] = values
    return table


def names_of(places: NDArray[np.bool_]) -> frozenset[tuple[str, str]]:
    """Coefficient and term of each place that is set."""
    return frozenset((COEFFICIENTS[row], LIBRARY[column]) for row, column in np.argwhere(places).tolist())
