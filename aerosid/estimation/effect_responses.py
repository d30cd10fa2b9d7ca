"""Responses of inputs and outputs to the parameters of effects, acting or tested, by central differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, OutputEffect, StateEffect
from aerosid.estimation.effect_parameters import parameters_of
from aerosid.estimation.effects_in_flight import acting_flight, simulated_states, transformed
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.motion_loop import added_along
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.flight import Flight


def input_directions(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    values: NDArray[np.float64],
    state: NDArray[np.float64],
    effects: Sequence[ActiveEffect],
    flight: Flight,
    tested: Sequence[ActiveEffect],
) -> NDArray[np.float64]:
    """How the acting inputs move with each parameter of an input effect, acting or tested: (N, E, D)."""
    time, extra = manoeuvre.flight.time, len(model.extra_columns)
    acting = list(parameters_of(effects, InputEffect))
    asked = list(parameters_of(tested, InputEffect, StateEffect))
    moves = np.zeros((time.size, extra, len(acting) + len(asked)))
    for place, (active, n) in enumerate(acting):
        if active.acts_on(manoeuvre.name):
            moves[:, :, place] = _acting_direction(model, manoeuvre, effects, active, n)
    states: NDArray[np.float64] | None = None
    if any(isinstance(active.effect, StateEffect) for active in tested):
        states = simulated_states(model, flight, values, state)
    for place, (active, n) in enumerate(asked, start=len(acting)):
        move = moves[:, :, place]
        effect = active.effect
        step = effect.parameters[n].step
        sides = active.beside(n, step), active.beside(n, -step)
        width = sides[0].values[n] - sides[1].values[n]
        if isinstance(effect, StateEffect) and states is not None:
            # At no strength the effect moves the motion that it sees only through the inputs that it fills.
            more, less = (added_along(side, model, flight, values, states, manoeuvre.ground) for side in sides)
            for column in effect.columns:
                move[:, model.extra_place(column)] = (more[column] - less[column]) / width
        elif isinstance(effect, InputEffect) and active.acts_on(manoeuvre.name):
            upper_side, lower_side = (transformed(effect, model, time, flight.inputs, side.values) for side in sides)
            move[:, model.extra_place(effect.where_acts)] = (upper_side - lower_side) / width
    return moves


def _acting_direction(
    model: AerodynamicModel, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect], active: ActiveEffect, n: int
) -> NDArray[np.float64]:
    """How the acting inputs move with parameter n of one of the effects that act: (N, E)."""
    effect, extra, flight = active.effect, len(model.extra_columns), manoeuvre.flight
    step = effect.parameters[n].step
    sides = active.beside(n, step), active.beside(n, -step)
    width = sides[0].values[n] - sides[1].values[n]
    if isinstance(effect, InputEffect) and _acts_alone(effect, manoeuvre, effects):
        # No other effect meets its columns, so that it acts on the recorded inputs and on one of them alone.
        inputs = np.zeros((flight.time.size, len(model.columns)))
        inputs[:, : flight.inputs.shape[1]] = flight.inputs
        upper, lower = (transformed(effect, model, flight.time, inputs, side.values) for side in sides)
        move = np.zeros((flight.time.size, extra))
        move[:, model.extra_place(effect.where_acts)] = (upper - lower) / width
        return move
    above, below = (
        acting_flight(model, manoeuvre, [side if other is active else other for other in effects])[0].inputs
        for side in sides
    )
    return np.asarray((above - below)[:, above.shape[1] - extra :] / width)


def _acts_alone(effect: InputEffect, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect]) -> bool:
    """Whether of the effects on a flight no other changes a column that one sees, or is driven by what it changes."""
    seen = {effect.where_acts, effect.driven_by} - {""}
    others = (
        active.effect
        for active in effects
        if isinstance(active.effect, InputEffect) and active.effect is not effect and active.acts_on(manoeuvre.name)
    )
    return not any(other.where_acts in seen or other.driven_by == effect.where_acts for other in others)


def sense(
    block: NDArray[np.float64],
    outputs: NDArray[np.float64],
    time: NDArray[np.float64],
    manoeuvre: Manoeuvre,
    effects: Sequence[ActiveEffect],
    tested: Sequence[ActiveEffect],
    first: int,
) -> None:
    """Let acting output effects change outputs and columns in place, and put their own columns into `block`.

    `first`: where those begin.
    """
    places = [first]
    for active in (*effects, *tested):
        places.append(places[-1] + active.slopes)
    for n, active in enumerate((*effects, *tested)):
        effect = active.effect
        if not isinstance(effect, OutputEffect) or not active.acts_on(manoeuvre.name):
            continue
        i = manoeuvre.row(effect.where)
        given = outputs[:, i : i + 1]
        slopes = []
        for parameter in range(len(effect.parameters)):
            step = effect.parameters[parameter].step
            sides = active.beside(parameter, step), active.beside(parameter, -step)
            upper, lower = (effect.output(time, given, side.values)[:, 0] for side in sides)
            slopes.append((upper - lower) / (sides[0].values[parameter] - sides[1].values[parameter]))
        if n < len(effects):
            block[:, i, 1:] = effect.transform(time, np.ascontiguousarray(block[:, i, 1:]), active.values)
            outputs[:, i] = effect.output(time, given, active.values)[:, 0]
        for parameter, slope in enumerate(slopes):
            block[:, i, places[n] + parameter] = slope
