"""Simulated response with the sensitivity of every output to every parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.axes import Axes
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import Flight, within_limit
from aerosid.flight_model.layout import (
    layout_of,
    leading_columns,
    output_count,
    output_places,
    state_count,
    state_places,
)
from aerosid.flight_model.sampling_interval import (
    Stages,
    hold_columns,
    inputs_at,
    inputs_at_end,
    integrate,
    make_stages,
)
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.variation import Span, cross, force_inputs, force_terms, make_span, note
from aerosid.flight_model.workspace import Workspace, make_workspace
from aerosid.signals.array_elements import copy_rows
from aerosid.signals.trace import Trace, carry_columns


class TraceCarry(NamedTuple):
    """State (n) and its sensitivities (n, M) where the next stretch begins; changed in place."""

    state: NDArray[np.float64]
    columns: NDArray[np.float64]


class Directions(NamedTuple):
    """Changes of the extra inputs whose effect is wanted, linear between samples.

    Most move one input alone. Input j changes along directions `first[j]` to `stop[j]` - 1 out of D, `first` and `stop`
    (E,), and its changes are columns `begin[j]` and following of `inputs` (N, P). `places` (D,): the column of the
    block that each one's effect is written to.
    """

    inputs: NDArray[np.float64]
    first: NDArray[np.int64]
    stop: NDArray[np.int64]
    begin: NDArray[np.int64]
    places: NDArray[np.int64]


def make_directions(
    moved: Sequence[Mapping[int, NDArray[np.float64]]], places: NDArray[np.int64], samples: int, extra_inputs: int
) -> Directions:
    """`Directions` along each of which some extra inputs change, (N,) each by their places, in order of those inputs.

    `places` (D,): as in `Directions`.
    """
    order = sorted(range(len(moved)), key=lambda n: min(moved[n], default=extra_inputs))
    first, stop = (np.zeros(extra_inputs, dtype=np.int64) for _ in range(2))
    for d, n in enumerate(order):
        for j in moved[n]:
            first[j], stop[j] = d if stop[j] == 0 else first[j], d + 1
    ends = np.cumsum(stop - first)
    begin = ends - (stop - first)
    changes = np.zeros((int(ends[-1]) if extra_inputs else 0, samples))
    for d, n in enumerate(order):
        for j, change in moved[n].items():
            changes[begin[j] + d - first[j]] = change
    return Directions(np.ascontiguousarray(changes.T), first, stop, begin, places[order])


def make_trace(samples: int, extra_inputs: int, columns: int, axes: Axes) -> Trace:
    """An empty `Trace` of a stretch whose block has so many columns."""
    n, m = len(axes.integrated), len(axes.outputs)
    return Trace(
        np.empty((samples, m)),
        np.zeros((samples, m, columns)),
        np.zeros((samples, n, n)),
        np.zeros((samples, n, extra_inputs)),
        np.zeros((samples, n, extra_inputs)),
        np.empty((samples, m, n)),
        np.empty((samples, m, extra_inputs)),
        layout_of(axes).sizes,
    )


def make_trace_carry(state: NDArray[np.float64], free: int, directions: int) -> TraceCarry:
    """The carry at the first sample: every initial state is a parameter."""
    n = state.size
    columns = np.zeros((n, free + n + directions))
    columns[:, free : free + n] = np.eye(n)
    return TraceCarry(state.copy(), columns)


@njit
def trace_stretch(
    begin: int,
    stop: int,
    carry: TraceCarry,
    flight: Flight,
    parameters: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    directions: Directions,
    trace: Trace,
) -> bool:
    """Simulate samples `begin` to `stop` - 1 into `trace` and move `carry` on; False where alpha leaves its limit.

    Parameters
    ----------
    parameters : (T,) values of the terms; `free` (F,) the indices of those whose derivatives are wanted.

    Notes
    -----
    The state is that of `simulate_outputs` to rounding, the derivatives are those of `variation`. An evaluation
    at a sample serves four: its outputs, the end of the span before it, the start of the one after it, and the first
    stage of the integrator.
    """
    layout = constants.layout
    leading, states, outputs = leading_columns(layout), state_count(layout), output_count(layout)
    extra = flight.inputs.shape[1] - leading
    work, stages = make_workspace(extra, table, layout), make_stages(extra, layout)
    span = make_span(extra, free.shape[0], layout)
    # Beside the columns of parameters those of the interval's own start state and inputs, from sample to sample.
    kept = carry.columns.shape[1]
    width = -(-(kept + states + 2 * extra) // LANES) * LANES
    here, there, u = np.zeros((states, width)), np.zeros((states, width)), np.zeros(leading + extra)
    copy_rows(here, carry.columns)
    # A slow sensor looks back over samples that are missing: of a channel that is recorded every sample is wanted.
    recorded = np.zeros(outputs, dtype=np.bool_)
    for i in range(outputs):
        for k in range(flight.time.shape[0]):
            if not np.isnan(flight.measured[k, i]):
                recorded[i] = True
                break
    inside = _trace(
        begin, stop, carry.state, here, there, kept, flight, parameters, free, table, constants, directions, trace,
        recorded, work, stages, span, u,
    )  # fmt: skip
    copy_rows(carry.columns, here[:, :kept])
    return inside


LANES = 8
"""Layout: columns are made up to a multiple of this: the widest vectors of today's processors hold as many numbers."""


@njit_inline
def _trace(
    begin: int,
    stop: int,
    x: NDArray[np.float64],
    columns: NDArray[np.float64],
    moved: NDArray[np.float64],
    kept: int,
    flight: Flight,
    parameters: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    directions: Directions,
    trace: Trace,
    recorded: NDArray[np.bool_],
    work: Workspace,
    stages: Stages,
    span: Span,
    u: NDArray[np.float64],
) -> bool:
    """As `trace_stretch`, in work arrays that are given; `kept` of the `columns` are those of parameters."""
    samples, substeps, layout = flight.time.shape[0], flight.substeps, constants.layout
    states = state_count(layout)
    extra, own = work.rates_u.shape[1], free.shape[0] + states
    start, end = kept + states, kept + states + extra
    nodes = 2 * ((substeps + 1) // 2)
    length, fraction, share, jumps = 0.0, 0.0, 0.0, flight.held.shape[0] > 0
    for k in range(begin, min(stop + 1, samples)):
        row = k - begin
        after = min(k + 1, samples - 1)
        interval = flight.time[after] - flight.time[k]
        if jumps and k > begin:  # the span before this sample ends with other inputs than the next begins with
            evaluate(x, stages.last, parameters, table, constants, flight.positions, work, True, False)
            note(work, free, 2, span, layout)
        inputs_at_end(flight.inputs[k], flight.inputs[after], flight.held, flight.ramp, stages.last)
        for node in range(nodes):
            # An odd substep is left alone at the end: a span by itself, its middle inside of it.
            alone = substeps % 2 == 1 and node >= nodes - 2
            place = (substeps - 0.5 if alone and node % 2 == 1 else float(node)) / substeps
            inputs_at(place, flight.inputs[k], stages.last, u)
            evaluate(x, u, parameters, table, constants, flight.positions, work, True, node == 0)
            if node % 2 == 1:
                note(work, free, 1, span, layout)
            else:
                if k > begin or node > 0:
                    if node > 0 or not jumps:
                        note(work, free, 2, span, layout)
                    cross(span, length, layout)
                    carry_columns(span.transition, columns, moved, layout.sizes)
                    force_terms(span, moved, layout)
                    force_inputs(span, fraction, share, start, moved, layout)
                    for a in range(states):
                        for c in range(columns.shape[1]):
                            columns[a, c] = moved[a, c]
                note(work, free, 0, span, layout)
                fraction, share = place, (1.0 if alone else 2.0) / substeps
                length = share * interval
            if node == 0:
                if not within_limit(work.outputs, layout):
                    return False
                if k > begin:
                    hold_columns(
                        columns[:, start:end], columns[:, end : end + extra], flight.held, flight.ramp,
                        leading_columns(layout),
                    )  # fmt: skip
                    for a in range(states):
                        for b in range(states):
                            trace.transition[row - 1, a, b] = columns[a, kept + b]
                        for j in range(extra):
                            by_start, by_end = columns[a, start + j], columns[a, end + j]
                            trace.start[row - 1, a, j] = by_start
                            trace.end[row - 1, a, j] = by_end
                            first, wanted = directions.first[j], directions.stop[j] - directions.first[j]
                            if wanted > 0:
                                at = directions.begin[j]
                                earlier = directions.inputs[k - 1, at : at + wanted]
                                later = directions.inputs[k, at : at + wanted]
                                pushed = columns[a, own + first : own + first + wanted]
                                for c in range(wanted):
                                    pushed[c] += by_start * earlier[c] + by_end * later[c]
                if k == stop:
                    break
                _record(k, row, columns, recorded, free, directions, constants, work, trace)
                for a in range(states):
                    for c in range(kept, end + extra):
                        columns[a, c] = 1.0 if c == kept + a else 0.0
                if k + 1 == samples:
                    break
            if alone and node % 2 == 1:
                for a in range(states):
                    x[a] = stages.end[a]
            else:
                integrate(
                    x, flight.inputs[k], stages.last, interval, node, node + 1, substeps,
                    parameters, table, constants, flight.positions, work, stages,
                )  # fmt: skip
                if alone:
                    for a in range(states):
                        x[a] = stages.middle[a]
    return True


@njit_inline
def _record(
    k: int,
    row: int,
    columns: NDArray[np.float64],
    recorded: NDArray[np.bool_],
    free: NDArray[np.int64],
    directions: Directions,
    constants: Constants,
    work: Workspace,
    trace: Trace,
) -> None:
    """Write the outputs of sample `k`, and how they move with each column, into `row` of the trace."""
    at, outputs = state_places(constants.layout), output_places(constants.layout)
    extra, count = work.outputs_u.shape[1], directions.places.shape[0]
    free_count = free.shape[0]
    own = free_count + at.total
    for i in range(outputs.total):
        trace.outputs[row, i] = work.outputs[i]
        for a in range(at.total):
            trace.outputs_x[row, i, a] = work.outputs_x[i, a]
        for j in range(extra):
            trace.outputs_u[row, i, j] = work.outputs_u[i, j]
        if not recorded[i]:
            continue
        block, slope = trace.block[row, i], work.outputs_x[i]
        for c in range(own):
            total = slope[0] * columns[0, c]
            for a in range(1, at.coupled):
                total += slope[a] * columns[a, c]
            block[1 + c] = total
        for c in range(count):
            total = slope[0] * columns[0, own + c]
            for a in range(1, at.total):
                total += slope[a] * columns[a, own + c]
            block[directions.places[c]] = total
        for a in range(at.coupled, at.total):
            if slope[a] != 0.0:
                for c in range(own):
                    block[1 + c] += slope[a] * columns[a, c]
        if outputs.a_x <= i < outputs.h:  # terms act on accelerations alone
            for c in range(free_count):
                block[1 + c] += work.outputs_p[i, free[c]]
        for j in range(extra):
            pushed = work.outputs_u[i, j]
            if pushed != 0.0:
                shift = directions.begin[j] - directions.first[j]
                for c in range(directions.first[j], directions.stop[j]):
                    block[directions.places[c]] += pushed * directions.inputs[k, shift + c]
