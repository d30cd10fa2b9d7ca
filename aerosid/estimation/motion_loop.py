"""Simulation and sensitivities of manoeuvres with flow separation or ground effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, StateEffect
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import loads_of
from aerosid.flight_model.flight import Flight, coefficients_along
from aerosid.flight_model.motion_feedback import offsets_along, simulate_feedback
from aerosid.flight_model.motion_laws import Feedback, Places
from aerosid.flight_model.motion_sensitivity import FeedbackCarry, feed_back, make_feedback_carry
from aerosid.flight_model.response import Directions
from aerosid.signals.trace import Trace


def self_consistent(
    model: AerodynamicModel,
    flight: Flight,
    values: NDArray[np.float64],
    state: NDArray[np.float64],
    effects: Sequence[ActiveEffect],
    ground: float = 0.0,
) -> tuple[Flight, NDArray[np.float64]]:
    """The flight with the inputs that its own motion adds, and that motion's states (N, n).

    `ground` [m] is the altitude of the ground.

    Raises
    ------
    OutOfRangeError
        Where the simulation leaves the model's range.
    """
    return _simulated(model, flight, values, state, feedback_of(model, values, effects, ground))


def _simulated(
    model: AerodynamicModel,
    flight: Flight,
    values: NDArray[np.float64],
    state: NDArray[np.float64],
    feedback: Feedback,
) -> tuple[Flight, NDArray[np.float64]]:
    inputs, states = simulate_feedback(state, flight, np.array(values), model.table, model.constants, feedback)
    if not np.isfinite(states).all():
        raise OutOfRangeError
    return flight._replace(inputs=inputs), states


def feedback_of(
    model: AerodynamicModel, values: NDArray[np.float64], effects: Sequence[ActiveEffect], ground: float
) -> Feedback:
    """The effects that depend on the motion, with their parameters, as compiled code takes them."""
    moving = [(active.effect, active.values) for active in effects if isinstance(active.effect, StateEffect)]
    numbers = [effect.law_numbers(given) for effect, given in moving]
    slopes = [slope_of(model, effect) for effect, _ in moving]
    return Feedback(
        law=np.array([int(effect.law) for effect, _ in moving], dtype=np.int64),
        first_number=np.cumsum([0, *map(len, numbers)]),
        first_column=np.cumsum([0, *(len(effect.columns) for effect, _ in moving)]),
        numbers=np.array([number for each in numbers for number in each], dtype=np.float64),
        columns=np.array(
            [model.extra_place(column) for effect, _ in moving for column in effect.columns],
            dtype=np.int64,
        ),
        slope=np.array([0.0 if place is None else float(values[place]) for place in slopes]),
        coefficient=np.array(
            [loads_of(model.axes).index(effect.lift) if effect.proportional else -1 for effect, _ in moving],
            dtype=np.int64,
        ),
        ground=float(ground),
        layout=model.constants.layout,
    )


def slope_of(model: AerodynamicModel, effect: StateEffect) -> int | None:
    """Index of the model's alpha derivative that an effect uses; None where it has none."""
    for place, (coefficient, term) in enumerate(model.entries):
        if coefficient == effect.lift and str(term) == "alpha":
            return place
    return None


def added_along(
    active: ActiveEffect,
    model: AerodynamicModel,
    flight: Flight,
    values: NDArray[np.float64],
    states: NDArray[np.float64],
    ground: float,
) -> dict[str, NDArray[np.float64]]:
    """Addition of an effect to each of its input columns, (N,), along given states (N, n) of a flight without it."""
    effect = active.effect
    assert isinstance(effect, StateEffect)
    feedback = feedback_of(model, values, [active], ground)
    coefficients = np.zeros((states.shape[0], len(loads_of(model.axes))))
    if effect.proportional:
        coefficients = coefficients_along(states, flight, np.array(values), model.table, model.constants)
    found = offsets_along(flight.time, states, coefficients, feedback)
    return dict(zip(effect.columns, found.T, strict=True))


RUNAWAY = 1e50
"""Numerical: sensitivity, SI, from which a flight no longer determines its initial state; its square may overflow."""


@dataclass(frozen=True)
class MotionLoop:
    """A flight whose motion feeds back to its inputs, with the propagation of the sensitivities in that loop.

    Attributes
    ----------
    flight : Flight
        With the inputs that the motion adds.
    plain : Flight
        Without them.
    states : ndarray, shape (N, n)
        The motion.
    feedback, places, carry :
        As the compiled propagation of the sensitivities takes them; `carry` is passed from stretch to stretch.
    """

    flight: Flight
    plain: Flight
    states: NDArray[np.float64]
    feedback: Feedback
    places: Places
    carry: FeedbackCarry

    @property
    def traced_flight(self) -> Flight:
        """The flight to trace: with every output, from which the state's sensitivities follow."""
        return self.flight._replace(measured=np.zeros_like(self.flight.measured))

    def close(
        self,
        begin: int,
        stop: int,
        model: AerodynamicModel,
        values: NDArray[np.float64],
        free: NDArray[np.int64],
        directions: Directions,
        trace: Trace,
    ) -> None:
        """Add the loop's contribution to the sensitivities in the trace of samples `begin` to `stop` - 1, in place.

        Raises
        ------
        OutOfRangeError
            Where they grow without bound: the motion diverges and is limited only by the stalled flow.
        """
        arguments = (free, model.table, model.constants, self.feedback, self.places, directions, trace)
        feed_back(begin, stop, self.carry, self.plain, self.states, values, *arguments)
        unrecorded = [not np.isfinite(channel).any() for channel in self.flight.measured.T]
        trace.block[:, unrecorded] = 0.0
        if not np.abs(trace.block[:, :, 1:]).max(initial=0.0) < RUNAWAY:
            raise OutOfRangeError


def motion_loop(
    model: AerodynamicModel,
    flight: Flight,
    values: NDArray[np.float64],
    state: NDArray[np.float64],
    effects: Sequence[ActiveEffect],
    ground: float,
    free: NDArray[np.int64],
    parameters: int,
) -> MotionLoop:
    """The loop at its first sample; `parameters`: number of `free` terms, initial states and effects' parameters.

    Raises
    ------
    OutOfRangeError
        Where the simulation leaves the model's range.
    """
    feedback = feedback_of(model, values, effects, ground)
    acting, states = _simulated(model, flight, values, state, feedback)
    numbers, slopes = np.full(feedback.numbers.size, -1), np.full(feedback.law.size, -1)
    place, n = free.size + state.size, 0
    for active in effects:
        if isinstance(active.effect, StateEffect):
            for at in active.effect.places:
                numbers[feedback.first_number[n] + at] = place + active.effect.places.index(at)
            slope = slope_of(model, active.effect)
            if slope is not None and slope in free:
                slopes[n] = int(np.flatnonzero(free == slope)[0])
            n += 1
        place += active.slopes
    carry = make_feedback_carry(feedback, parameters)
    return MotionLoop(acting, flight, states, feedback, Places(numbers, slopes), carry)
