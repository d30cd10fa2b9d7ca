"""Application of effects to a flight: acting inputs and recorded outputs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, NoiseEffect, OutputEffect
from aerosid.effects.kinds import BodyEffect, PositionEffect
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.signals.sensor_dynamics import SensorStates, no_sensor_states, sensor_states


class OutOfRangeError(Exception):
    """A simulation exceeded the angle-of-attack limit; the search shortens its step."""


def acting_flight(
    model: AerodynamicModel, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect]
) -> tuple[Flight, NDArray[np.float64]]:
    """The flight with the acting inputs, and the memory (E) of their noise.

    Columns of the model without a channel are zero until an effect fills them.
    """
    flight = manoeuvre.flight
    samples, extra = flight.time.size, len(model.extra_columns)
    inputs, variance, memory = flight.inputs, flight.input_variance, np.zeros(extra)
    held, leading = manoeuvre.columns, len(model.columns) - extra
    acting = in_acting_order(active for active in effects if active.acts_on(manoeuvre.name))
    if model.columns != held:
        inputs = np.zeros((samples, len(model.columns)))
        inputs[:, : len(held)] = flight.inputs
        variance = np.zeros(extra)
        variance[: flight.input_variance.size] = flight.input_variance
    elif acting:
        inputs, variance = inputs.copy(), variance.copy()
    for effect, active in acting:
        place = model.columns.index(effect.where_acts)
        inputs[:, place] = transformed(effect, model, flight.time, inputs, active.values)
        factor, remembered = effect.noise(active.values, manoeuvre.interval)
        variance[place - leading] *= factor
        memory[place - leading] = max(memory[place - leading], remembered)
    for active in effects:
        if isinstance(active.effect, NoiseEffect):
            variance = variance.copy()
            numbers = active.effect.noise(active.values, manoeuvre.interval, manoeuvre.mean_airspeed)
            for column, power, remembered in zip(active.effect.columns, *numbers, strict=True):
                place = model.columns.index(column)
                variance[place - leading], memory[place - leading] = power, remembered
    positions = flight.positions
    for active in effects:
        if isinstance(active.effect, PositionEffect):
            positions = positions.copy()
            rows = [row for row, channel in enumerate(manoeuvre.axes.outputs) if active.effect.moves(channel)]
            for axis, further in zip(active.effect.axes, active.numbers, strict=True):
                positions[rows, "xyz".index(axis)] += further
    return flight._replace(inputs=np.ascontiguousarray(inputs), input_variance=variance, positions=positions), memory


def in_acting_order(effects: Iterable[ActiveEffect]) -> list[tuple[InputEffect, ActiveEffect]]:
    """The effects on inputs, each after those on whose result it acts."""
    acting = [(active.effect, active) for active in effects if isinstance(active.effect, InputEffect)]
    return sorted(acting, key=lambda pair: not pair[0].comes_first)


def acting_model(model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> AerodynamicModel:
    """The model with the constants as changed by effects on the aircraft's body."""
    acting = [(active.effect, active.numbers) for active in effects if isinstance(active.effect, BodyEffect)]
    if not acting:
        return model
    changed = model.constants._asdict()
    for effect, numbers in acting:
        for name, change in zip(effect.fields, numbers, strict=True):
            changed[name] += change
    return replace(model, constants=Constants(**changed))


def transformed(
    effect: InputEffect,
    model: AerodynamicModel,
    time: NDArray[np.float64],
    inputs: NDArray[np.float64],
    numbers: tuple[float, ...],
) -> NDArray[np.float64]:
    """The column (N,) that an input effect acts on, with the effect."""
    own = inputs[:, model.columns.index(effect.where_acts)]
    if not effect.driven_by:
        return effect.transform(time, own, numbers)
    return np.asarray(own + effect.transform(time, inputs[:, model.columns.index(effect.driven_by)], numbers))


def simulated_states(
    model: AerodynamicModel, flight: Flight, values: NDArray[np.float64], state: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The states (N, n) of a flight whose inputs are given.

    Raises
    ------
    OutOfRangeError
        Where the simulation leaves the model's range.
    """
    _, states = simulate_outputs(state, flight, values, model.table, model.constants)
    if not np.isfinite(states).all():
        raise OutOfRangeError
    return states


def recorded(outputs: NDArray[np.float64], manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect]) -> None:
    """Apply the sensors' effects to simulated outputs (N, m), in place."""
    for active in effects:
        if isinstance(active.effect, OutputEffect) and active.acts_on(manoeuvre.name):
            i = manoeuvre.row(active.effect.where)
            given = np.ascontiguousarray(outputs[:, i : i + 1])
            outputs[:, i] = active.effect.output(manoeuvre.flight.time, given, active.values)[:, 0]


def recording_sensors(manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect]) -> SensorStates:
    """Dynamics of the sensors that record a manoeuvre, as they filter the noise of its inputs."""
    acting = [
        (manoeuvre.row(active.effect.where), active.effect.dynamics(active.values))
        for active in effects
        if isinstance(active.effect, OutputEffect) and active.acts_on(manoeuvre.name)
    ]
    if not acting:
        return no_sensor_states(len(manoeuvre.axes.outputs))
    return sensor_states(acting, manoeuvre.interval, len(manoeuvre.axes.outputs))
