"""Sensitivities of a simulation with feedback of the motion on itself.

Those of a flight with given inputs come from `response`; what the loop adds to them is one more pass through
the linearisation that was written there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.layout import Layout, leading_columns, output_places, state_count, state_places
from aerosid.flight_model.motion_laws import REMEMBERED, Feedback, LawSlopes, Places, offsets_at, remember, slopes_at
from aerosid.flight_model.response import Directions
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.workspace import Workspace, make_workspace
from aerosid.signals.array_elements import solve_by_elimination
from aerosid.signals.trace import Trace


class FeedbackCarry(NamedTuple):
    """What passes from one stretch to the next, changed in place; S offsets, K effects, M parameters.

    `ahead` (n, M): where the sensitivities that the loop adds stand at the next sample before its own offsets move;
    `end` (n, S) how these move it; `memory` (K, 4) and `columns` (K, 4, M) of the sample before.
    """

    ahead: NDArray[np.float64]
    end: NDArray[np.float64]
    memory: NDArray[np.float64]
    columns: NDArray[np.float64]


def make_feedback_carry(feedback: Feedback, parameters: int) -> FeedbackCarry:
    """The carry at the first sample, whose state is given."""
    effects, added = feedback.law.size, feedback.columns.size
    n = state_count(feedback.layout)
    return FeedbackCarry(
        np.zeros((n, parameters)),
        np.zeros((n, added)),
        np.zeros((effects, REMEMBERED)),
        np.zeros((effects, REMEMBERED, parameters)),
    )


class _Round(NamedTuple):
    """Room for one sample: sensitivities (n, M) of the state, and what the loop adds to them; the `system` (S, S) for
    those of the offsets (S, M); what the laws keep (K, 4) and add (S); the coefficients (K) that the laws are
    proportional to, and how they move with the state (K, n), the inputs (K, E), the free terms (K, F), and directly
    with the parameters (K, M); `sight` (n, n) the slopes of what is seen of the state.
    """

    given: NDArray[np.float64]
    added: NDArray[np.float64]
    system: NDArray[np.float64]
    offsets: NDArray[np.float64]
    kept: NDArray[np.float64]
    acting: NDArray[np.float64]
    coefficient: NDArray[np.float64]
    by_state: NDArray[np.float64]
    by_input: NDArray[np.float64]
    by_term: NDArray[np.float64]
    direct: NDArray[np.float64]
    sight: NDArray[np.float64]


@njit
def feed_back(
    begin: int,
    stop: int,
    carry: FeedbackCarry,
    flight: Flight,
    states: NDArray[np.float64],
    parameters: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    feedback: Feedback,
    places: Places,
    directions: Directions,
    trace: Trace,
) -> None:
    """Add to the trace of samples `begin` to `stop` - 1 how its own motion moves its inputs, and move `carry` on.

    Parameters
    ----------
    flight : without what the effects add; `states` (N, n) those of the flight with it.
    trace : of the flight with the effects, as if its inputs were given, in which every output was traced.

    Notes
    -----
    With the offsets' sensitivities d, those y that they add to the state, and the linearisation of the trace,

        y(k+1) = Phi y(k) + B0 d(k) + B1 d(k+1),    d(k+1) = G {X(k+1) + y(k+1)} + H(k+1)

    where X are the sensitivities with given inputs, G is the laws' slope and H what is known of the samples before:
    S equations for each sample. The result is the derivative of `simulate_feedback` as it stands, its rounds ended.
    """
    width, added, effects = trace.block.shape[2] - 1, feedback.columns.shape[0], feedback.law.shape[0]
    layout, n = constants.layout, state_count(constants.layout)
    extra = flight.inputs.shape[1] - leading_columns(layout)
    room = _Round(
        np.zeros((n, width)), np.zeros((n, width)), np.zeros((added, added)), np.zeros((added, width)),
        np.zeros((effects, REMEMBERED)), np.zeros(added), np.ones(effects), np.zeros((effects, n)),
        np.zeros((effects, extra)), np.zeros((effects, free.shape[0])), np.zeros((effects, width)), np.zeros((n, n)),
    )  # fmt: skip
    slopes = LawSlopes(
        np.zeros((added, n)), np.zeros((added, width)), np.zeros((effects, 2, width)), np.zeros((effects, 2)),
        carry.columns,
    )  # fmt: skip
    _feed_back(
        begin, stop, carry, flight, states, parameters.copy(), free, table, constants, feedback, places, directions,
        trace, make_workspace(extra, table, layout), np.zeros(n), np.zeros(flight.inputs.shape[1]), np.zeros(n), slopes,
        room,
    )  # fmt: skip


@njit_inline
def _feed_back(
    begin: int,
    stop: int,
    carry: FeedbackCarry,
    flight: Flight,
    states: NDArray[np.float64],
    parameters: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    feedback: Feedback,
    places: Places,
    directions: Directions,
    trace: Trace,
    work: Workspace,
    x: NDArray[np.float64],
    u: NDArray[np.float64],
    unused: NDArray[np.float64],
    slopes: LawSlopes,
    room: _Round,
) -> None:
    """As `feed_back`, in work arrays that are given."""
    width, added, effects = room.given.shape[1], feedback.columns.shape[0], feedback.law.shape[0]
    count = state_count(constants.layout)
    proportional = False
    for n in range(effects):
        proportional = proportional or feedback.coefficient[n] >= 0
    for k in range(begin, stop):
        row = k - begin
        _states_moved(k, row, directions, trace, room.given, room.sight, constants.layout)
        if proportional:
            _coefficients_moved(
                k, flight, states, parameters, free, table, constants, feedback, directions, work, x, u, room
            )
        # What the laws keep of this sample follows from its state; the offsets are those that act already.
        offsets_at(k, flight.time, states[k], unused, feedback, carry.memory, room.kept, room.acting)
        slopes_at(
            k, flight.time, states[k], room.coefficient, room.by_state, room.direct, feedback, places, carry.memory,
            room.kept, slopes,
        )  # fmt: skip
        for s in range(added):
            for c in range(width):
                room.offsets[s, c] = slopes.moved[s, c]
            for a in range(count):
                slope = slopes.by_state[s, a]
                if slope != 0.0:
                    for c in range(width):
                        room.offsets[s, c] += slope * (room.given[a, c] + carry.ahead[a, c])
            for r in range(added):
                total = 0.0
                for a in range(count):
                    total += slopes.by_state[s, a] * carry.end[a, r]
                room.system[s, r] = (1.0 if s == r else 0.0) - total
        solve_by_elimination(room.system, room.offsets)
        for a in range(count):
            for c in range(width):
                total = carry.ahead[a, c]
                for s in range(added):
                    total += carry.end[a, s] * room.offsets[s, c]
                room.added[a, c] = total
                room.given[a, c] += total
        remember(states[k], room.given, feedback, slopes)
        for n in range(effects):
            for i in range(REMEMBERED):
                carry.memory[n, i] = room.kept[n, i]
        for i in range(output_places(constants.layout).total):
            for a in range(count):
                slope = trace.outputs_x[row, i, a]
                if slope != 0.0:
                    for c in range(width):
                        trace.block[row, i, 1 + c] += slope * room.added[a, c]
            for s in range(added):
                slope = trace.outputs_u[row, i, feedback.columns[s]]
                if slope != 0.0:
                    for c in range(width):
                        trace.block[row, i, 1 + c] += slope * room.offsets[s, c]
        for a in range(count):
            for c in range(width):
                total = 0.0
                for b in range(count):
                    total += trace.transition[row, a, b] * room.added[b, c]
                for s in range(added):
                    total += trace.start[row, a, feedback.columns[s]] * room.offsets[s, c]
                carry.ahead[a, c] = total
            for s in range(added):
                carry.end[a, s] = trace.end[row, a, feedback.columns[s]]


@njit_inline
def _states_moved(
    k: int,
    row: int,
    directions: Directions,
    trace: Trace,
    states: NDArray[np.float64],
    sight: NDArray[np.float64],
    layout: Layout,
) -> None:
    """Write the sensitivities (n, M) of the state from those of all outputs but accelerations, which determine it."""
    at, outputs = state_places(layout), output_places(layout)
    seen = 0
    for i in range(outputs.total):
        if outputs.a_x <= i < outputs.h:
            continue
        for a in range(at.total):
            sight[seen, a] = trace.outputs_x[row, i, a]
        for c in range(states.shape[1]):
            states[seen, c] = trace.block[row, i, 1 + c]
        for j in range(directions.begin.shape[0]):
            slope = trace.outputs_u[row, i, j]
            if slope != 0.0:
                shift = directions.begin[j] - directions.first[j]
                for d in range(directions.first[j], directions.stop[j]):
                    states[seen, directions.places[d] - 1] -= slope * directions.inputs[k, shift + d]
        seen += 1
    solve_by_elimination(sight, states)


@njit_inline
def _coefficients_moved(
    k: int,
    flight: Flight,
    states: NDArray[np.float64],
    parameters: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    feedback: Feedback,
    directions: Directions,
    work: Workspace,
    x: NDArray[np.float64],
    u: NDArray[np.float64],
    room: _Round,
) -> None:
    """Write the coefficients of sample `k` without the effects, and how they move: central differences, one by one."""
    at, leading = state_places(constants.layout), leading_columns(constants.layout)
    extra, effects, coupled = u.shape[0] - leading, feedback.law.shape[0], at.coupled
    for a in range(at.total):
        x[a] = states[k, a]
    for j in range(u.shape[0]):
        u[j] = flight.inputs[k, j]
    for trial in range(-1, 2 * (coupled + extra + free.shape[0])):
        place, step = trial // 2, 0.0
        if trial >= 0:
            # A hundred-thousandth of what is usual of each; terms are linear in their values.
            velocity = place < coupled and (place == at.u or place == at.w)
            step = 1e-3 if velocity or place >= coupled + extra else 1e-5 if place < coupled else 1e-4
            step = step if trial % 2 == 0 else -step
        term = free[place - coupled - extra] if place >= coupled + extra else 0
        nominal = parameters[term]
        if place >= coupled + extra:
            parameters[term] += step
        elif place >= coupled:
            u[leading + place - coupled] += step
        elif place >= 0:
            x[place] += step
        evaluate(x, u, parameters, table, constants, flight.positions, work, False, False)
        parameters[term] = nominal
        if coupled <= place < coupled + extra:
            u[leading + place - coupled] = flight.inputs[k, leading + place - coupled]
        elif 0 <= place < coupled:
            x[place] = states[k, place]
        for n in range(effects):
            if feedback.coefficient[n] < 0:
                continue
            value = work.coefficients[feedback.coefficient[n]]
            if trial < 0:
                room.coefficient[n] = value
                continue
            value /= 2.0 * step
            moved = (
                room.by_state[n]
                if place < coupled
                else room.by_input[n]
                if place < coupled + extra
                else room.by_term[n]
            )
            spot = place if place < coupled else place - coupled if place < coupled + extra else place - coupled - extra
            moved[spot] = value if trial % 2 == 0 else moved[spot] + value
    for n in range(effects):
        if feedback.coefficient[n] >= 0:
            for c in range(room.direct.shape[1]):
                room.direct[n, c] = room.by_term[n, c] if c < free.shape[0] else 0.0
            for j in range(extra):
                if room.by_input[n, j] != 0.0:
                    shift = directions.begin[j] - directions.first[j]
                    for d in range(directions.first[j], directions.stop[j]):
                        room.direct[n, directions.places[d] - 1] += (
                            room.by_input[n, j] * directions.inputs[k, shift + d]
                        )
