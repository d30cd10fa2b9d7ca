"""Prediction of a planned flight from steady flight at a record's condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.preparation_settings import PREPARATION
from aerosid.flight_model.axes import Axes, moving_of, state_vector
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.logs.flight_log import FlightLog
from aerosid.notation import number

SURFACES = {"delta_e": "elevator", "delta_r": "rudder", "delta_a": "aileron"}
"""Controls of an input, in the order in which they are moved, and what a pilot calls them."""

_TURNING = ("p", "q", "r", "phi", "beta")
"""Measured motion that steady flight with wings level has none of."""

_BALANCED = {"u": "alpha", "w": "delta_e", "q": "theta", "v": "beta", "p": "delta_a", "r": "delta_r"}
"""Unknowns of the trim: found so that each state on which forces and moments act is steady."""

_FARTHEST = {"alpha": 0.6, "delta_e": 1.0, "theta": 1.2, "beta": 0.3, "delta_a": 1.0, "delta_r": 1.0}
"""Numerical: rad, beyond which a root of the balance is no steady flight."""

_STILL = 0.01
"""Numerical: s over which nothing may change in steady flight."""


@dataclass(frozen=True)
class SteadyFlight:
    """Straight flight without acceleration, everything but the surfaces as at the beginning of a record.

    Attributes
    ----------
    state : ndarray, shape (n,)
        SI.
    inputs : ndarray, shape (I,)
        Of the record's columns; the surfaces' are those that hold this flight.
    controls : mapping of str to int
        Column of each surface that an input may move.
    airspeed, alpha : float
        True airspeed, m/s; angle of attack, rad.
    """

    state: NDArray[np.float64]
    inputs: NDArray[np.float64]
    controls: Mapping[str, int]
    airspeed: float
    alpha: float

    @property
    def trim(self) -> dict[str, float]:
        """Each surface, rad."""
        return {name: float(self.inputs[place]) for name, place in self.controls.items()}


def surfaces_of(axes: Axes) -> tuple[str, ...]:
    """The surfaces that balance the moments of a case."""
    balanced = {_BALANCED[state] for state in moving_of(axes)}
    return tuple(name for name in SURFACES if name in balanced)


def steady_flight(completed: Refinement, manoeuvre: Manoeuvre) -> SteadyFlight:
    """The steady flight of a model at the airspeed, thrust and configuration with which a record begins.

    Parameters
    ----------
    completed : Refinement
        The model, and the record's initial state as it was estimated; the record is its first manoeuvre.
    manoeuvre : Manoeuvre
        The record.

    Raises
    ------
    EstimationError
        Where the model lacks a surface, or no steady flight within 0.6 rad of angle of attack was found.

    Notes
    -----
    Angle of attack, elevator and pitch angle are found, sideslip, aileron and rudder, as far as the case integrates
    them; with the thrust of the record the flight may climb or sink.
    """
    model, start = completed.model, completed.states[0]
    axes, columns = model.axes, manoeuvre.columns
    lacking = [name for name in surfaces_of(axes) if name not in columns]
    if lacking:
        raise EstimationError(
            f"no term of the model names {lacking[0]}, so that no {_input_of(lacking)} can be designed."
        )
    inputs = np.median(manoeuvre.flight.inputs[:5], axis=0)
    inputs[[columns.index(name) for name in axes.measured if name in _TURNING]] = 0.0
    motion = dict(zip(axes.integrated, start.tolist(), strict=True))
    given = {name: float(inputs[columns.index(name)]) for name in axes.measured}
    airspeed = given["V"] if "V" in given else float(np.hypot(np.hypot(motion["u"], motion["w"]), motion.get("v", 0.0)))
    rows, outputs = np.zeros((2, len(model.columns))), len(axes.outputs)
    time, none, still = np.array([0.0, _STILL]), np.full((2, outputs), np.nan), np.zeros((outputs, 3))
    found = [name for state, name in _BALANCED.items() if state in axes.integrated]
    from scipy.optimize import root  # late: the verdict is reached without it

    moving = [axes.integrated.index(state) for state in _BALANCED if state in axes.integrated]
    size = np.array([1.0 if state in ("p", "q", "r") else 9.8 for state in _BALANCED if state in axes.integrated])

    def state_at(numbers: Mapping[str, float]) -> NDArray[np.float64]:
        alpha, beta = numbers.get("alpha", 0.0), numbers.get("beta", 0.0)
        plane = airspeed * np.cos(beta)
        level = {"u": plane * np.cos(alpha), "v": airspeed * np.sin(beta), "w": plane * np.sin(alpha)}
        return state_vector(axes, {**level, "theta": numbers.get("theta", 0.0), "h": motion.get("h", 0.0)})

    def drift(unknown: NDArray[np.float64]) -> NDArray[np.float64]:
        numbers = dict(zip(found, unknown.tolist(), strict=True))
        rows[:, : inputs.size] = inputs
        for name in surfaces_of(axes):
            rows[:, columns.index(name)] = numbers[name]
        flight = Flight(time, rows, none, still, 1, np.zeros(len(model.extra_columns)))
        _, states = simulate_outputs(state_at(numbers), flight, np.array(model.values), model.table, model.constants)
        change = np.nan_to_num(states[1] - states[0], nan=1e3)
        return np.asarray(change[moving] / (size * _STILL))

    first = {
        "alpha": np.arctan2(motion.get("w", 0.0), motion.get("u", 1.0)),
        "theta": motion.get("theta", 0.0),
        "beta": 0.0,
    }
    first |= {name: inputs[columns.index(name)] for name in surfaces_of(axes)}
    solution = root(drift, np.array([first[name] for name in found]), tol=1e-10)
    numbers = dict(zip(found, solution.x.tolist(), strict=True))
    far = any(abs(number) > _FARTHEST[name] for name, number in numbers.items())
    if np.max(np.abs(drift(solution.x))) > 1e-6 or far:
        raise EstimationError(f"the completed model has no steady flight at {number(airspeed)} m/s.")
    controls = {name: columns.index(name) for name in surfaces_of(axes)}
    for name, place in controls.items():
        inputs[place] = numbers[name]
    return SteadyFlight(state_at(numbers), inputs, controls, airspeed, numbers.get("alpha", given.get("alpha", 0.0)))


def _input_of(controls: Sequence[str]) -> str:
    """Name of an input of some surfaces."""
    return f"{' and '.join(SURFACES[name] for name in controls)} input"


def planned_manoeuvre(
    record: Manoeuvre,
    steady: SteadyFlight,
    time: NDArray[np.float64],
    deflections: Mapping[str, NDArray[np.float64]],
    longest_substep: float = PREPARATION.longest_substep,
) -> Manoeuvre:
    """The flight to come with the sensors of a record, which read zero as yet, as the estimators take it.

    Parameters
    ----------
    record : Manoeuvre
        Gives columns, sensors, their positions and the noise of the inputs.
    time : ndarray, shape (N,)
        s.
    deflections : mapping of str to ndarray, shape (N,)
        Of each surface that is moved, from trim, rad, linear between samples.
    longest_substep : float
        Of the integrator, s.

    Notes
    -----
    Noise of an input is white from sample to sample; at another interval than the record's its density is kept.
    """
    flight = record.flight
    inputs = np.tile(steady.inputs, (time.size, 1))
    for name, deflection in deflections.items():
        inputs[:, steady.controls[name]] += deflection
    held = np.array([channel in record.outputs for channel in record.axes.outputs])
    interval = float(np.median(np.diff(time)))
    planned = Flight(
        time=np.array(time),
        inputs=inputs,
        measured=np.tile(np.where(held, 0.0, np.nan), (time.size, 1)),
        positions=flight.positions,
        substeps=max(1, int(np.ceil(interval / longest_substep - 1e-9))),
        input_variance=flight.input_variance * sampling_ratio(record, time),
    )
    channels = {control: np.array(inputs[:, place]) for control, place in steady.controls.items()}
    log = FlightLog("next flight", np.array(time), channels, dict.fromkeys(channels, "rad"))
    return replace(record, log=log, flight=planned, notes=())


def sampling_ratio(record: Manoeuvre, time: NDArray[np.float64]) -> float:
    """The record's sampling interval over that of `time` (N,): by this the noise of a sample is to be scaled."""
    return float(np.median(np.diff(record.flight.time)) / np.median(np.diff(time)))


def at_steady(estimate: Refinement, state: NDArray[np.float64], ratio: float) -> Refinement:
    """The estimate as it would see the flight to come: from `state` (n,), noise variances scaled by `ratio`."""
    return replace(estimate, states=(state,), variance=estimate.variance * ratio)
