"""Simulation with effects of the motion on itself: flow separation and ground effect as feedback.

What an effect adds at the end of an interval depends on the state there, which depends on what it adds: a few unknowns,
found interval by interval.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import Flight, within_limit
from aerosid.flight_model.layout import leading_columns, load_places, state_count
from aerosid.flight_model.motion_laws import REMEMBERED, Feedback, offsets_at
from aerosid.flight_model.sampling_interval import Stages, inputs_at_end, integrate, make_stages
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.workspace import Workspace, make_workspace

AGREEMENT = 1e-11
"""Numerical: units of a coefficient to which what the effects add and the motion agree: differences of simulations
hold."""

ROUNDS = 20
"""Numerical: rounds within one interval before it is left as it is; three to five are usual."""


class _March(NamedTuple):
    """Room to simulate: what the effects add (S) here, at the sample before, as tried and found in this round and the
    last, and by how much each was missed; state and rates (n) at the start of an interval; the coefficients (K) without
    the effects; what the laws remember (K, 4) of the sample before, and of this one.
    """

    here: NDArray[np.float64]
    last: NDArray[np.float64]
    tried: NDArray[np.float64]
    found: NDArray[np.float64]
    found_before: NDArray[np.float64]
    miss: NDArray[np.float64]
    miss_before: NDArray[np.float64]
    start: NDArray[np.float64]
    rates: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    memory: NDArray[np.float64]
    kept: NDArray[np.float64]


@njit
def simulate_feedback(
    state: NDArray[np.float64],
    flight: Flight,
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    feedback: Feedback,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The inputs (N, I) with what the motion adds to those of `flight`, and the states (N, n) of that motion.

    The states are those of `simulate_outputs` with these inputs: NaN from where they leave |alpha| < 1.5 rad.

    Notes
    -----
    What is added at an interval's end, e = g(x(e)), is first tried on the straight line through the last two samples
    and then improved by Anderson's method with a memory of one round: for a single unknown, the secant method.
    """
    layout, added, effects = constants.layout, feedback.columns.shape[0], feedback.law.shape[0]
    extra, n = flight.inputs.shape[1] - leading_columns(layout), state_count(layout)
    inputs, states = flight.inputs.copy(), np.full((flight.time.shape[0], n), np.nan)
    room = _March(
        np.zeros(added), np.zeros(added), np.zeros(added), np.zeros(added), np.zeros(added), np.zeros(added),
        np.zeros(added), np.zeros(n), np.zeros(n), np.zeros(load_places(layout).total),
        np.zeros((effects, REMEMBERED)), np.zeros((effects, REMEMBERED)),
    )  # fmt: skip
    work, stages = make_workspace(extra, table, layout), make_stages(extra, layout)
    _march(state.copy(), flight, parameters, table, constants, feedback, inputs, states, work, stages, room)
    return inputs, states


@njit_inline
def _march(
    x: NDArray[np.float64],
    flight: Flight,
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    feedback: Feedback,
    inputs: NDArray[np.float64],
    states: NDArray[np.float64],
    work: Workspace,
    stages: Stages,
    room: _March,
) -> None:
    """As `simulate_feedback`, in work arrays that are given."""
    samples, added = flight.time.shape[0], feedback.columns.shape[0]
    leading, count = leading_columns(constants.layout), state_count(constants.layout)
    proportional = False
    for n in range(feedback.law.shape[0]):
        proportional = proportional or feedback.coefficient[n] >= 0
    for k in range(samples):
        interval = flight.time[k] - flight.time[k - 1] if k > 0 else 0.0
        for s in range(added):
            room.tried[s] = 2.0 * room.here[s] - room.last[s]
            room.last[s] = room.here[s]
        for turn in range(ROUNDS):
            if k > 0:
                for s in range(added):
                    place = leading + feedback.columns[s]
                    inputs[k, place] = flight.inputs[k, place]
                for s in range(added):
                    inputs[k, leading + feedback.columns[s]] += room.tried[s]
                for a in range(count):
                    x[a], work.rates[a] = room.start[a], room.rates[a]
                inputs_at_end(inputs[k - 1], inputs[k], flight.held, flight.ramp, stages.last)
                integrate(
                    x, inputs[k - 1], stages.last, interval, 0, flight.substeps, flight.substeps,
                    parameters, table, constants, flight.positions, work, stages,
                )  # fmt: skip
            if proportional:
                evaluate(x, flight.inputs[k], parameters, table, constants, flight.positions, work, False, False)
                for row in range(room.coefficients.shape[0]):
                    room.coefficients[row] = work.coefficients[row]
            offsets_at(k, flight.time, x, room.coefficients, feedback, room.memory, room.kept, room.found)
            if k == 0:  # the state is given
                for s in range(added):
                    room.here[s], room.last[s] = room.found[s], room.found[s]
                    inputs[k, leading + feedback.columns[s]] += room.found[s]
                break
            if _agree(turn, room):
                break
        evaluate(x, inputs[k], parameters, table, constants, flight.positions, work, False, True)
        if not within_limit(work.outputs, constants.layout):
            return
        for a in range(count):
            states[k, a], room.start[a], room.rates[a] = x[a], x[a], work.rates[a]
        for n in range(room.memory.shape[0]):
            for i in range(REMEMBERED):
                room.memory[n, i] = room.kept[n, i]


@njit_inline
def _agree(turn: int, room: _March) -> bool:
    """Whether what was tried is what the motion gives; else write what to try next."""
    largest, along, length = 0.0, 0.0, 0.0
    for s in range(room.here.shape[0]):
        room.here[s] = room.tried[s]
        room.miss[s] = room.found[s] - room.tried[s]
        change = room.miss[s] - room.miss_before[s]
        largest = max(largest, abs(room.miss[s]))
        along += room.miss[s] * change
        length += change * change
    if not largest > AGREEMENT:
        return True
    back = along / length if turn > 0 and length > 0.0 else 0.0
    for s in range(room.here.shape[0]):
        room.tried[s] = room.found[s] - back * (room.found[s] - room.found_before[s])
        room.found_before[s], room.miss_before[s] = room.found[s], room.miss[s]
    return False


@njit
def offsets_along(
    time: NDArray[np.float64], states: NDArray[np.float64], coefficients: NDArray[np.float64], feedback: Feedback
) -> NDArray[np.float64]:
    """What the effects add (N, S) along given states (N, n) and coefficients without them (N, K)."""
    samples, effects = time.shape[0], feedback.law.shape[0]
    found = np.zeros((samples, feedback.columns.shape[0]))
    memory = np.zeros((2, effects, REMEMBERED))
    for k in range(samples):
        offsets_at(k, time, states[k], coefficients[k], feedback, memory[k % 2], memory[1 - k % 2], found[k])
    return found
