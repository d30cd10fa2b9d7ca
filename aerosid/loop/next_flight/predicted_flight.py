"""Prediction of a planned flight from steady flight at a record's condition."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.preparation_settings import PREPARATION
from aerosid.flight_model.axes import state_vector
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.logs.flight_log import FlightLog
from aerosid.notation import number

ELEVATOR = "delta_e"
_STILL = 0.01
"""Numerical: s over which nothing may change in steady flight."""


@dataclass(frozen=True)
class SteadyFlight:
    """Straight flight without acceleration, everything but the elevator as at the beginning of a record.

    Attributes
    ----------
    state : ndarray, shape (n,)
        SI.
    inputs : ndarray, shape (I,)
        Of the record's columns; the elevator's is the one that holds this flight.
    elevator : int
        The elevator's column.
    airspeed, alpha : float
        True airspeed, m/s; angle of attack, rad.
    """

    state: NDArray[np.float64]
    inputs: NDArray[np.float64]
    elevator: int
    airspeed: float
    alpha: float

    @property
    def delta_e(self) -> float:
        """Elevator, rad."""
        return float(self.inputs[self.elevator])


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
        Where the model has no elevator, or no steady flight within 0.6 rad of angle of attack was found.

    Notes
    -----
    Angle of attack, elevator and pitch angle are found; with the thrust of the record the flight may climb or sink.
    """
    if ELEVATOR not in manoeuvre.columns:
        raise EstimationError(f"no term of the model names {ELEVATOR}, so that no elevator input can be designed.")
    model, start = completed.model, completed.states[0]
    elevator = manoeuvre.columns.index(ELEVATOR)
    inputs = np.median(manoeuvre.flight.inputs[:5], axis=0)
    inputs[[manoeuvre.columns.index(name) for name in manoeuvre.axes.measured]] = 0.0
    motion = dict(zip(model.axes.integrated, start.tolist(), strict=True))
    airspeed = float(np.hypot(motion["u"], motion["w"]))
    rows, outputs = np.zeros((2, len(model.columns))), len(model.axes.outputs)
    time, none, still = np.array([0.0, _STILL]), np.full((2, outputs), np.nan), np.zeros((outputs, 3))
    moving = [model.axes.integrated.index(name) for name in ("u", "w", "q")]

    def state_at(alpha: float, theta: float) -> NDArray[np.float64]:
        level = {"u": airspeed * np.cos(alpha), "w": airspeed * np.sin(alpha), "theta": theta, "h": motion["h"]}
        return state_vector(model.axes, level)

    def drift(unknown: NDArray[np.float64]) -> NDArray[np.float64]:
        alpha, delta_e, theta = unknown
        rows[:, : inputs.size] = inputs
        rows[:, elevator] = delta_e
        state = state_at(float(alpha), float(theta))
        flight = Flight(time, rows, none, still, 1, np.zeros(len(model.extra_columns)))
        _, states = simulate_outputs(state, flight, np.array(model.values), model.table, model.constants)
        change = np.nan_to_num(states[1] - states[0], nan=1e3)
        return np.asarray(change[moving] / (np.array([9.8, 9.8, 1.0]) * _STILL))

    begin = np.array([np.arctan2(motion["w"], motion["u"]), inputs[elevator], motion["theta"]])
    solution = root(drift, begin, tol=1e-10)
    alpha, delta_e, theta = (float(number) for number in solution.x)
    if np.max(np.abs(drift(solution.x))) > 1e-6 or abs(alpha) > 0.6 or abs(delta_e) > 1.0 or abs(theta) > 1.2:
        raise EstimationError(f"the completed model has no steady flight at {number(airspeed)} m/s.")
    inputs[elevator] = delta_e
    return SteadyFlight(state_at(alpha, theta), inputs, elevator, airspeed, alpha)


def planned_manoeuvre(
    record: Manoeuvre,
    steady: SteadyFlight,
    time: NDArray[np.float64],
    deflection: NDArray[np.float64],
    measured: NDArray[np.float64] | None = None,
    name: str = "next flight",
    longest_substep: float = PREPARATION.longest_substep,
) -> Manoeuvre:
    """The flight to come with the sensors of a record, as the estimators take it.

    Parameters
    ----------
    record : Manoeuvre
        Gives columns, sensors, their positions and the noise of the inputs.
    time, deflection : ndarray, shape (N,)
        s; the elevator's deflection from trim, rad, linear between samples.
    measured : ndarray, shape (N, m), optional
        What the sensors are to show; zero where none is given.
    longest_substep : float
        Of the integrator, s.

    Notes
    -----
    Noise of an input is white from sample to sample; at another interval than the record's its density is kept.
    """
    flight = record.flight
    inputs = np.tile(steady.inputs, (time.size, 1))
    inputs[:, steady.elevator] += deflection
    held = np.array([channel in record.outputs for channel in record.axes.outputs])
    shown = np.zeros((time.size, len(record.axes.outputs))) if measured is None else measured
    interval = float(np.median(np.diff(time)))
    planned = Flight(
        time=np.array(time),
        inputs=inputs,
        measured=np.where(held, shown, np.nan),
        positions=flight.positions,
        substeps=max(1, int(np.ceil(interval / longest_substep - 1e-9))),
        input_variance=flight.input_variance * sampling_ratio(record, time),
    )
    channels = {ELEVATOR: np.array(inputs[:, steady.elevator])}
    log = FlightLog(name, np.array(time), channels, {ELEVATOR: "rad"})
    return replace(record, log=log, flight=planned, notes=())


def sampling_ratio(record: Manoeuvre, time: NDArray[np.float64]) -> float:
    """The record's sampling interval over that of `time` (N,): by this the noise of a sample is to be scaled."""
    return float(np.median(np.diff(record.flight.time)) / np.median(np.diff(time)))


def at_steady(estimate: Refinement, state: NDArray[np.float64], ratio: float) -> Refinement:
    """The estimate as it would see the flight to come: from `state` (n,), noise variances scaled by `ratio`."""
    return replace(estimate, states=(state,), variance=estimate.variance * ratio)
