"""Simulate a flight open loop together with the response of every output to every parameter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.flight import ALPHA_LIMIT, Flight
from aerosid.flight_model.longitudinal import Constants, Workspace, evaluate, make_workspace
from aerosid.flight_model.sampling_interval import Stages, inputs_at, integrate, make_stages
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.variation import Span, cross, force_inputs, force_terms, make_span, note
from aerosid.signals.trace import Trace, carry_columns


class TraceCarry(NamedTuple):
    """State (5) and its sensitivities (5, M) where the next stretch begins; changed in place."""

    state: NDArray[np.float64]
    columns: NDArray[np.float64]


class Directions(NamedTuple):
    """Changes of the extra inputs whose effect is wanted: `inputs` (N, E, D), linear between samples.

    `places` (D,): the column of the block that each one's effect is written to.
    """

    inputs: NDArray[np.float64]
    places: NDArray[np.int64]


def make_trace(samples: int, extra_inputs: int, columns: int) -> Trace:
    """An empty `Trace` of a stretch whose block has so many columns."""
    return Trace(
        np.empty((samples, 8)),
        np.zeros((samples, 8, columns)),
        np.zeros((samples, 5, 5)),
        np.zeros((samples, 5, extra_inputs)),
        np.zeros((samples, 5, extra_inputs)),
        np.empty((samples, 8, 5)),
        np.empty((samples, 8, extra_inputs)),
    )


def make_trace_carry(state: NDArray[np.float64], free: int, directions: int) -> TraceCarry:
    """The carry at the first sample: every initial state is a parameter."""
    columns = np.zeros((5, free + 5 + directions))
    columns[:, free : free + 5] = np.eye(5)
    return TraceCarry(state.copy(), columns)


@njit
def trace_stretch(
    begin: int,
    stop: int,
    carry: TraceCarry,
    flight: Flight,
    theta: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    directions: Directions,
    trace: Trace,
) -> bool:
    """Simulate samples `begin` to `stop` - 1 into `trace` and move `carry` on; False where alpha leaves its limit.

    Parameters
    ----------
    theta : (T,) values of the terms; `free` (F,) the indices of those whose derivatives are wanted.

    Notes
    -----
    The state is that of `simulate_outputs` to rounding, the derivatives are those of `variation`. An evaluation
    at a sample serves four: its outputs, the end of the span before it, the start of the one after it, and the first
    stage of the integrator.
    """
    extra = flight.inputs.shape[1] - 8
    work, stages, span = make_workspace(extra, table), make_stages(extra), make_span(extra, free.shape[0])
    # Beside the columns of parameters those of the interval's own start state and inputs, from sample to sample.
    kept = carry.columns.shape[1]
    width = -(-(kept + 5 + 2 * extra) // LANES) * LANES
    here, there, u = np.zeros((5, width)), np.zeros((5, width)), np.zeros(8 + extra)
    here[:, :kept] = carry.columns
    # A slow sensor looks back over samples that are missing: of a channel that is recorded every sample is wanted.
    recorded = np.zeros(8, dtype=np.bool_)
    for i in range(8):
        for k in range(flight.time.shape[0]):
            if not np.isnan(flight.measured[k, i]):
                recorded[i] = True
                break
    inside = _trace(
        begin, stop, carry.state, here, there, kept, flight, theta, free, table, constants, directions, trace,
        recorded, work, stages, span, u,
    )  # fmt: skip
    carry.columns[:, :] = here[:, :kept]
    return inside


LANES = 8
"""Columns are made up to a multiple of this: the widest vectors of today's processors hold as many numbers."""


@njit_inline
def _trace(
    begin: int,
    stop: int,
    x: NDArray[np.float64],
    columns: NDArray[np.float64],
    moved: NDArray[np.float64],
    kept: int,
    flight: Flight,
    theta: NDArray[np.float64],
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
    samples, substeps = flight.time.shape[0], flight.substeps
    extra, own, count = work.rates_u.shape[1], free.shape[0] + 5, directions.places.shape[0]
    start, end = kept + 5, kept + 5 + extra
    nodes = 2 * ((substeps + 1) // 2)
    length, fraction, share = 0.0, 0.0, 0.0
    for k in range(begin, min(stop + 1, samples)):
        row = k - begin
        after = min(k + 1, samples - 1)
        interval = flight.time[after] - flight.time[k]
        for node in range(nodes):
            # An odd substep is left alone at the end: a span by itself, its middle inside of it.
            alone = substeps % 2 == 1 and node >= nodes - 2
            place = (substeps - 0.5 if alone and node % 2 == 1 else float(node)) / substeps
            inputs_at(place, flight.inputs[k], flight.inputs[after], u)
            evaluate(x, u, theta, table, constants, flight.positions, work, True, node == 0)
            if node % 2 == 1:
                note(work, free, 1, span)
            else:
                if k > begin or node > 0:
                    note(work, free, 2, span)
                    cross(span, length)
                    carry_columns(span.transition, columns, moved)
                    force_terms(span, moved)
                    force_inputs(span, fraction, share, start, moved)
                    for a in range(5):
                        for c in range(columns.shape[1]):
                            columns[a, c] = moved[a, c]
                note(work, free, 0, span)
                fraction, share = place, (1.0 if alone else 2.0) / substeps
                length = share * interval
            if node == 0:
                if not abs(work.outputs[1]) < ALPHA_LIMIT:
                    return False
                if k > begin:
                    for a in range(5):
                        for b in range(5):
                            trace.transition[row - 1, a, b] = columns[a, kept + b]
                        for j in range(extra):
                            by_start, by_end = columns[a, start + j], columns[a, end + j]
                            trace.start[row - 1, a, j] = by_start
                            trace.end[row - 1, a, j] = by_end
                            for c in range(count):
                                columns[a, own + c] += (
                                    by_start * directions.inputs[k - 1, j, c] + by_end * directions.inputs[k, j, c]
                                )
                if k == stop:
                    break
                _record(k, row, columns, recorded, free, directions, work, trace)
                for a in range(5):
                    for c in range(kept, end + extra):
                        columns[a, c] = 1.0 if c == kept + a else 0.0
                if k + 1 == samples:
                    break
            if alone and node % 2 == 1:
                for a in range(5):
                    x[a] = stages.end[a]
            else:
                integrate(
                    x, flight.inputs[k], flight.inputs[after], interval, node, node + 1, substeps,
                    theta, table, constants, flight.positions, work, stages,
                )  # fmt: skip
                if alone:
                    for a in range(5):
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
    work: Workspace,
    trace: Trace,
) -> None:
    """Write the outputs of sample `k`, and how they move with each column, into `row` of the trace."""
    extra, count = work.outputs_u.shape[1], directions.places.shape[0]
    free_count = free.shape[0]
    own = free_count + 5
    for i in range(8):
        trace.outputs[row, i] = work.outputs[i]
        for a in range(5):
            trace.outputs_x[row, i, a] = work.outputs_x[i, a]
        for j in range(extra):
            trace.outputs_u[row, i, j] = work.outputs_u[i, j]
        if not recorded[i]:
            continue
        block = trace.block[row, i]
        by_u, by_w, by_q, by_theta = (
            work.outputs_x[i, 0], work.outputs_x[i, 1], work.outputs_x[i, 2], work.outputs_x[i, 3]
        )  # fmt: skip
        by_h = work.outputs_x[i, 4]
        for c in range(own):
            block[1 + c] = (by_u * columns[0, c] + by_w * columns[1, c]) + (
                by_q * columns[2, c] + by_theta * columns[3, c]
            )
        for c in range(count):
            at = own + c
            block[directions.places[c]] = (
                (by_u * columns[0, at] + by_w * columns[1, at]) + (by_q * columns[2, at] + by_theta * columns[3, at])
            ) + by_h * columns[4, at]
        if by_h != 0.0:
            for c in range(own):
                block[1 + c] += by_h * columns[4, c]
        if 4 <= i <= 6:  # terms act on accelerations alone
            for c in range(free_count):
                block[1 + c] += work.outputs_p[i, free[c]]
        for j in range(extra):
            slope = work.outputs_u[i, j]
            if slope != 0.0:
                for c in range(count):
                    block[directions.places[c]] += slope * directions.inputs[k, j, c]
