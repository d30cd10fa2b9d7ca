"""Responses of inputs and outputs to the parameters of effects, acting or tested, by central differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, OutputEffect, StateEffect
from aerosid.estimation.effect_parameters import parameters_of
from aerosid.estimation.effects_in_flight import in_acting_order, simulated_states, transformed
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
) -> list[dict[int, NDArray[np.float64]]]:
    """Sensitivities of the acting inputs to each parameter of an input effect, acting or tested.

    Returns
    -------
    list of dict of int to ndarray, shape (N,)
        Of each parameter, by the places among the extra inputs of those that it moves.
    """
    time = manoeuvre.flight.time
    acting = list(parameters_of(effects, InputEffect))
    tested_parameters = list(parameters_of(tested, InputEffect, StateEffect))
    directions: list[dict[int, NDArray[np.float64]]] = [{} for _ in (*acting, *tested_parameters)]
    chain = ActingChain.of(model, manoeuvre, effects) if acting else None
    for place, (active, n) in enumerate(acting):
        if chain is not None and active.acts_on(manoeuvre.name):
            for column, direction in chain.direction(active, n).items():
                directions[place][model.extra_place(column)] = direction
    states: NDArray[np.float64] | None = None
    if any(isinstance(active.effect, StateEffect) for active in tested):
        states = simulated_states(model, flight, values, state)
    for place, (active, n) in enumerate(tested_parameters, start=len(acting)):
        effect = active.effect
        step = effect.parameters[n].step
        sides = active.perturbed(n, step), active.perturbed(n, -step)
        width = sides[0].values[n] - sides[1].values[n]
        if isinstance(effect, StateEffect) and states is not None:
            # At zero strength the effect changes its own motion only through the inputs that it fills.
            more, less = (added_along(side, model, flight, values, states, manoeuvre.ground) for side in sides)
            for column in effect.columns:
                directions[place][model.extra_place(column)] = (more[column] - less[column]) / width
        elif isinstance(effect, InputEffect) and active.acts_on(manoeuvre.name):
            upper_side, lower_side = (transformed(effect, model, time, flight.inputs, side.values) for side in sides)
            directions[place][model.extra_place(effect.where_acts)] = (upper_side - lower_side) / width
    return directions


@dataclass(frozen=True)
class ActingChain:
    """The effects on a flight's inputs in series.

    Attributes
    ----------
    model : AerodynamicModel
    time : ndarray, shape (N,)
    stages : list of (InputEffect, ActiveEffect), length S
        In the order in which they act.
    recorded : ndarray, shape (N, K)
        The inputs before the first.
    """

    model: AerodynamicModel
    time: NDArray[np.float64]
    stages: list[tuple[InputEffect, ActiveEffect]]
    recorded: NDArray[np.float64]

    @classmethod
    def of(cls, model: AerodynamicModel, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect]) -> ActingChain:
        """The effects of a structure that act on a manoeuvre's inputs."""
        flight = manoeuvre.flight
        stages = in_acting_order(active for active in effects if active.acts_on(manoeuvre.name))
        recorded = np.zeros((flight.time.size, len(model.columns)))
        recorded[:, : flight.inputs.shape[1]] = flight.inputs
        return cls(model, flight.time, stages, recorded)

    @cached_property
    def inputs(self) -> list[NDArray[np.float64]]:
        """The inputs (N, K) before the first stage, after it, after the next and so on, S + 1 in all."""
        found = [self.recorded]
        for effect, active in self.stages:
            behind = found[-1].copy()
            behind[:, self._place(effect)] = transformed(effect, self.model, self.time, behind, active.values)
            found.append(behind)
        return found

    def direction(self, active: ActiveEffect, n: int) -> dict[str, NDArray[np.float64]]:
        """Sensitivities of the acting inputs to parameter `n` of one of the effects, (N,) each, by name."""
        step = active.effect.parameters[n].step
        sides = active.perturbed(n, step), active.perturbed(n, -step)
        width = sides[0].values[n] - sides[1].values[n]
        above, below = (self._moved(active, side) for side in sides)
        return {column: (above[column] - below[column]) / width for column in above}

    def _moved(self, active: ActiveEffect, side: ActiveEffect) -> dict[str, NDArray[np.float64]]:
        """The columns that change with one effect's parameters: its own, and those that depend on it."""
        first = next(k for k, (_, each) in enumerate(self.stages) if each is active)
        own = self.stages[first][0]
        if self._acts_alone(own):
            return {own.where_acts: transformed(own, self.model, self.time, self.recorded, side.values)}
        inputs, moved = self.inputs[first].copy(), {own.where_acts}
        for k, (effect, each) in enumerate(self.stages[first:], start=first):
            place = self._place(effect)
            if moved.isdisjoint((effect.where_acts, effect.driven_by)):
                inputs[:, place] = self.inputs[k + 1][:, place]
            else:
                numbers = side.values if each is active else each.values
                inputs[:, place] = transformed(effect, self.model, self.time, inputs, numbers)
                moved.add(effect.where_acts)
        return {column: inputs[:, self.model.columns.index(column)] for column in moved}

    def _place(self, effect: InputEffect) -> int:
        return self.model.columns.index(effect.where_acts)

    def _acts_alone(self, effect: InputEffect) -> bool:
        """Whether no other effect changes an input column of this one, or is driven by its output column."""
        seen = {effect.where_acts, effect.driven_by} - {""}
        others = (other for other, _ in self.stages if other is not effect)
        return not any(other.where_acts in seen or other.driven_by == effect.where_acts for other in others)


def apply_sensor_effects(
    block: NDArray[np.float64],
    outputs: NDArray[np.float64],
    time: NDArray[np.float64],
    manoeuvre: Manoeuvre,
    effects: Sequence[ActiveEffect],
    tested: Sequence[ActiveEffect],
    first: int,
) -> None:
    """Apply output effects to outputs and sensitivities in place, and write their own sensitivities into `block`.

    `first`: column of the first of those.
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
            sides = active.perturbed(parameter, step), active.perturbed(parameter, -step)
            upper, lower = (effect.output(time, given, side.values)[:, 0] for side in sides)
            slopes.append((upper - lower) / (sides[0].values[parameter] - sides[1].values[parameter]))
        if n < len(effects):
            block[:, i, 1:] = effect.transform(time, np.ascontiguousarray(block[:, i, 1:]), active.values)
            outputs[:, i] = effect.output(time, given, active.values)[:, 0]
        for parameter, slope in enumerate(slopes):
            block[:, i, places[n] + parameter] = slope
