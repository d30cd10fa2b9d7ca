"""Simulate a flight open loop together with the response of every output to every parameter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.longitudinal import Constants, advance, evaluate, make_step, make_workspace
from aerosid.prediction import ALPHA_LIMIT, Flight
from aerosid.terms import TermTable


class Trace(NamedTuple):
    """Outputs of one stretch with their derivatives, and the linearisation along the way; E extra inputs, M columns.

    `outputs` (n, 8); `columns` (n, 8, M): free terms, initial state (5), input directions; `transition` (n, 5, 5),
    `start` and `end` (n, 5, E) from each sample to the next; `outputs_x` (n, 8, 5) and `outputs_u` (n, 8, E).
    """

    outputs: NDArray[np.float64]
    columns: NDArray[np.float64]
    transition: NDArray[np.float64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    outputs_x: NDArray[np.float64]
    outputs_u: NDArray[np.float64]


class TraceCarry(NamedTuple):
    """State (5) and its sensitivities (5, M) where the next stretch begins; changed in place."""

    state: NDArray[np.float64]
    columns: NDArray[np.float64]


def make_trace(samples: int, extra_inputs: int, columns: int) -> Trace:
    """An empty `Trace` of a stretch."""
    return Trace(
        np.empty((samples, 8)),
        np.empty((samples, 8, columns)),
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
    directions: NDArray[np.float64],
    trace: Trace,
) -> bool:
    """Simulate samples `begin` to `stop` - 1 into `trace` and move `carry` on; False where alpha leaves its limit.

    Parameters
    ----------
    theta : (T,) values of the terms; `free` (F,) the indices of those whose derivatives are wanted.
    directions : (N, E, D) changes of the extra inputs, linear between samples, whose effect is wanted.

    Notes
    -----
    The derivatives are those of the discrete solution itself: the variational equations pass through the same
    Runge-Kutta steps as the state.
    """
    extra = flight.inputs.shape[1] - 8
    terms = theta.shape[0]
    work = make_workspace(extra, terms)
    step = make_step(extra, terms)
    x, columns = carry
    width = columns.shape[1]
    free_count = free.shape[0]
    first = free_count + 5
    direction_count = directions.shape[2]
    moved = np.zeros((5, width))
    samples = flight.time.shape[0]
    # A slow sensor looks back over samples that are missing: of a channel that is recorded every sample is wanted.
    recorded = np.zeros(8, dtype=np.bool_)
    for k in range(samples):
        for i in range(8):
            recorded[i] |= not np.isnan(flight.measured[k, i])
    for k in range(begin, stop):
        row = k - begin
        evaluate(x, flight.inputs[k], theta, table, constants, flight.positions, work, True, True)
        if not abs(work.outputs[1]) < ALPHA_LIMIT:
            return False
        for i in range(8):
            trace.outputs[row, i] = work.outputs[i]
            for a in range(5):
                trace.outputs_x[row, i, a] = work.outputs_x[i, a]
            for j in range(extra):
                trace.outputs_u[row, i, j] = work.outputs_u[i, j]
            if not recorded[i]:
                for c in range(width):
                    trace.columns[row, i, c] = 0.0
                continue
            for c in range(width):
                total = 0.0
                for a in range(4):
                    total += work.outputs_x[i, a] * columns[a, c]
                if i == 7:
                    total += columns[4, c]
                trace.columns[row, i, c] = total
            for c in range(free_count):
                trace.columns[row, i, c] += work.outputs_p[i, free[c]]
            for j in range(extra):
                if work.outputs_u[i, j] != 0.0:
                    for c in range(direction_count):
                        trace.columns[row, i, first + c] += work.outputs_u[i, j] * directions[k, j, c]
        if k + 1 >= samples:
            continue
        advance(
            x,
            flight.inputs[k],
            flight.inputs[k + 1],
            flight.time[k + 1] - flight.time[k],
            flight.substeps,
            theta,
            table,
            constants,
            flight.positions,
            work,
            step,
            True,
        )
        for a in range(5):
            x[a] = step.state[a]
            for b in range(5):
                trace.transition[row, a, b] = step.transition[a, b]
            for j in range(extra):
                trace.start[row, a, j] = step.start[a, j]
                trace.end[row, a, j] = step.end[a, j]
            for c in range(width):
                total = 0.0
                for b in range(5):
                    total += step.transition[a, b] * columns[b, c]
                moved[a, c] = total
            for c in range(free_count):
                moved[a, c] += step.terms[a, free[c]]
            for j in range(extra):
                for c in range(direction_count):
                    moved[a, first + c] += (
                        step.start[a, j] * directions[k, j, c] + step.end[a, j] * directions[k + 1, j, c]
                    )
        columns[:, :] = moved
    return True
