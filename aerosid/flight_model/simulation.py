"""Simulated flights: trim, manoeuvre, sensor noise, and the log that a recorder would hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from aerosid.errors import EstimationError
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import ATMOSPHERE_AND_BODY, state_vector
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.flight_model.workspace import make_workspace
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS

ALTITUDE = 1500.0
"""m; where a simulated manoeuvre begins."""

SPEED_OF_SOUND = 340.29
"""m/s, where the simulated flight has no atmosphere of its own."""


@dataclass(frozen=True)
class Trim:
    """Level flight without acceleration: angle of attack [rad], elevator [rad] and thrust [N] at an airspeed [m/s]."""

    airspeed: float
    alpha: float
    delta_e: float
    thrust: float


def trim(
    model: AerodynamicModel,
    airspeed: float,
    density: float,
    mass: float,
    *,
    speed_of_sound: float = SPEED_OF_SOUND,
    further_inputs: Mapping[str, float] | None = None,
) -> Trim:
    """The angle of attack, elevator and thrust that hold level flight.

    Parameters
    ----------
    airspeed : float
        m/s.
    density : float
        kg/m^3.
    mass : float
        kg.
    speed_of_sound : float
        m/s.
    further_inputs : mapping of str to float, optional
        Other inputs that terms name, SI; those that the model has no column for are ignored.

    Raises
    ------
    EstimationError
        Where no trim exists within 0.6 rad of angle of attack and 1 rad of elevator.
    """
    axes, places = model.axes, [model.axes.integrated.index(name) for name in ("u", "w", "q")]
    work = make_workspace(len(model.extra_columns), model.table, model.constants.layout)
    place, thrust = model.columns.index("delta_e"), model.columns.index("thrust")
    positions = np.zeros((len(axes.outputs), 3))

    inputs = input_row(model, density, 0.0, mass, speed_of_sound)
    for name, value in (further_inputs or {}).items():
        if name in model.columns:
            inputs[model.columns.index(name)] = value

    values = np.array(model.values)  # the kernel is compiled for arrays that can be written

    def accelerations(unknown: NDArray[np.float64]) -> NDArray[np.float64]:
        alpha, delta_e, weights = unknown
        inputs[thrust], inputs[place] = weights * mass * GRAVITY, delta_e
        x = level_state(model, airspeed, float(alpha))
        evaluate(x, inputs, values, model.table, model.constants, positions, work, False, False)
        return work.rates[places]

    solution = root(accelerations, np.array([0.05, 0.0, 0.1]), tol=1e-12)
    alpha, delta_e, weights = (float(number) for number in solution.x)
    # Rounding may stop the solver short of its tolerance; what counts is that nothing accelerates.
    balanced = float(np.max(np.abs(solution.fun))) < 1e-9
    if not balanced or abs(alpha) > 0.6 or abs(delta_e) > 1.0:
        raise EstimationError(
            f"no trim was found at {airspeed:g} m/s (the search ended at alpha {alpha:.3g} rad, delta_e {delta_e:.3g} "
            "rad); try another airspeed or density."
        )
    return Trim(airspeed, alpha, delta_e, weights * mass * GRAVITY)


def fly(
    model: AerodynamicModel,
    trimmed: Trim,
    time: NDArray[np.float64],
    elevator: NDArray[np.float64],
    *,
    density: float,
    mass: float,
    noise: Mapping[str, float],
    seed: int,
    further_inputs: Mapping[str, NDArray[np.float64]] | None = None,
    name: str = "simulated",
) -> FlightLog:
    """The log of a simulated manoeuvre from trim.

    Parameters
    ----------
    time : ndarray, shape (N,)
        s.
    elevator : ndarray, shape (N,)
        Deflection from trim at the samples [rad], linear in between.
    density, mass : float
        kg/m^3, kg.
    noise : mapping of str to float
        Standard deviation of white noise on each channel to be recorded, SI; outputs and delta_e. An output that is
        not named is not recorded.
    seed : int
        Of the noise.
    further_inputs : mapping of str to ndarray, shape (N,), optional
        Other inputs that terms name; recorded without noise.

    Raises
    ------
    EstimationError
        Where the simulation leaves |alpha| < 1.5 rad.
    """
    inputs = np.tile(input_row(model, density, trimmed.thrust, mass), (time.size, 1))
    inputs[:, model.columns.index("delta_e")] = trimmed.delta_e + elevator
    for channel, values in (further_inputs or {}).items():
        inputs[:, model.columns.index(channel)] = values
    substeps = max(1, int(np.ceil(float(np.max(np.diff(time))) / 0.005 - 1e-9)))
    rows = len(model.axes.outputs)
    none, still = np.zeros((0, rows)), np.zeros((rows, 3))
    flight = Flight(time, inputs, none, still, substeps, np.zeros(len(model.extra_columns)))
    start = level_state(model, trimmed.airspeed, trimmed.alpha, ALTITUDE)
    outputs, _ = simulate_outputs(start, flight, np.array(model.values), model.table, model.constants)
    if not np.isfinite(outputs).all():
        raise EstimationError(f"the simulated manoeuvre {name} leaves |alpha| < 1.5 rad; reduce the input's amplitude.")
    truth = dict(zip(model.axes.outputs, outputs.T, strict=True)) | {
        "delta_e": inputs[:, model.columns.index("delta_e")]
    }
    generator = np.random.default_rng(seed)
    channels = {
        channel: truth[channel] + deviation * generator.standard_normal(time.size)
        for channel, deviation in noise.items()
    }
    channels.update(further_inputs or {})
    units = {channel: CHANNELS[channel].unit if channel in CHANNELS else "1" for channel in channels}
    return FlightLog(name, time, channels, units)


def doublet(time: NDArray[np.float64], start: float, width: float, amplitude: float) -> NDArray[np.float64]:
    """One push and one pull of `width` s each from `start`: (N,) rad; steps are ramps over one sample."""
    return steps(time, start, [(width, amplitude), (width, -amplitude)])


def three_two_one_one(time: NDArray[np.float64], start: float, unit: float, amplitude: float) -> NDArray[np.float64]:
    """Steps of 3, 2, 1 and 1 `unit` s of alternating sign from `start`: (N,) rad."""
    return steps(time, start, [(3 * unit, amplitude), (2 * unit, -amplitude), (unit, amplitude), (unit, -amplitude)])


def steps(time: NDArray[np.float64], start: float, levels: list[tuple[float, float]]) -> NDArray[np.float64]:
    """A sequence of (duration s, level rad) from `start`, zero elsewhere: (N,)."""
    values = np.zeros(time.size)
    for duration, level in levels:
        values[(time >= start - 1e-9) & (time < start + duration - 1e-9)] = level
        start += duration
    return values


def input_row(
    model: AerodynamicModel, density: float, thrust: float, mass: float, speed_of_sound: float = SPEED_OF_SOUND
) -> NDArray[np.float64]:
    """The model's inputs of symmetric flight at one instant, (I,), SI: all that is not given is zero."""
    given = dict(zip(ATMOSPHERE_AND_BODY, (density, thrust, mass, speed_of_sound), strict=True))
    return np.array([given.get(name, 0.0) for name in model.columns])


def level_state(model: AerodynamicModel, airspeed: float, alpha: float, altitude: float = 0.0) -> NDArray[np.float64]:
    """The state (n,) of level flight at an airspeed [m/s], angle of attack [rad] and altitude [m]."""
    motion = {"u": airspeed * np.cos(alpha), "w": airspeed * np.sin(alpha), "theta": alpha, "h": altitude}
    return state_vector(model.axes, motion)
