"""One-step prediction with whitened innovations and their sensitivities: the filter-error recursion.

One recursion serves three uses. With no noise on the inputs the gain is zero and the prediction is the open-loop
simulation: its residuals are those of output error. With noise on a measured surface, or on a pseudo-input of an
unmodelled force, it is the discrete filter (9)-(12) and the residuals are innovations: filter error. The sensitivities
pass through the same gains and are therefore the regressors of the score test for any candidate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import Flight, within_limit
from aerosid.flight_model.layout import leading_columns, output_count, state_count
from aerosid.flight_model.sampling_interval import Step, advance, hold_columns, inputs_at_end, make_step
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.workspace import Workspace, make_workspace


class Carry(NamedTuple):
    """State of the recursion passed from one stretch of a record to the next; changed in place.

    `state` (n); `columns` (n, M) its sensitivities; `input_error` (E) and `input_columns` (E, M) of the last sample;
    `covariance` (n + E, n + E) of both.
    """

    state: NDArray[np.float64]
    columns: NDArray[np.float64]
    input_error: NDArray[np.float64]
    input_columns: NDArray[np.float64]
    covariance: NDArray[np.float64]


def start_carry(state: NDArray[np.float64], flight: Flight, free: int) -> Carry:
    """The `Carry` at the first sample: initial state (n,) a free parameter, so its covariance is zero."""
    n, extra = state.size, flight.input_variance.shape[0]
    columns = np.zeros((n, free + n))
    columns[:, free:] = np.eye(n)
    covariance = np.zeros((n + extra, n + extra))
    covariance[n:, n:] = np.diag(flight.input_variance)
    return Carry(state.copy(), columns, np.zeros(extra), np.zeros((extra, columns.shape[1])), covariance)


@njit
def predict_stretch(
    start: int,
    stop: int,
    carry: Carry,
    flight: Flight,
    parameters: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    variance: NDArray[np.float64],
    predicted: NDArray[np.float64],
    white: NDArray[np.float64],
    white_columns: NDArray[np.float64],
) -> tuple[bool, float]:
    """Predict samples `start` to `stop` - 1; write results at rows 0 ... and advance `carry` to `stop`.

    Parameters
    ----------
    parameters : (T,) values of all terms; `free` (F,) the indices of those whose sensitivities are computed.
    variance : (m,) of the output noise of each sample, SI squared.
    predicted : (N, m) receives the outputs predicted from the samples before.
    white : (N, m) receives innovations over their standard deviation, NaN where nothing was measured.
    white_columns : (N, m, M) receives the derivatives of the predicted outputs over the same standard deviation,
        columns in the order free terms, initial state (n).

    Returns
    -------
    Whether the prediction stayed within the angle-of-attack limit, and the sum of the logarithms of the innovations'
    variances.

    Notes
    -----
    Measurements of one sample enter one after the other, so that no matrix is factored and the innovations come out
    whitened. The error of a measured surface at a sample is a state of its own: it acts in the intervals on both
    sides of the sample and, through the direct term, on the accelerometers. Gains are held fixed when sensitivities
    pass: the estimating equations stay unbiased, the innovations being white at the true parameters.
    """
    layout = constants.layout
    states, extra = state_count(layout), flight.inputs.shape[1] - leading_columns(layout)
    work, step = make_workspace(extra, table, layout), make_step(extra, parameters.shape[0], layout)
    size, width = states + extra, carry.columns.shape[1]
    room = SampleWorkspace(
        np.zeros(size), np.zeros(size), np.zeros(states), np.zeros(width), np.zeros((states, width)),
        np.zeros(flight.inputs.shape[1]), np.zeros(flight.inputs.shape[1]), np.zeros((states, size)),
    )  # fmt: skip
    return _predict(
        start, stop, carry, flight, parameters, free, table, constants, variance, predicted, white,
        white_columns, work, step, room,
    )  # fmt: skip


class SampleWorkspace(NamedTuple):
    """Work arrays for one sample of `predict_stretch`."""

    gain: NDArray[np.float64]
    row: NDArray[np.float64]
    moved: NDArray[np.float64]
    sensitivity: NDArray[np.float64]
    next_columns: NDArray[np.float64]
    corrected_input: NDArray[np.float64]
    last_input: NDArray[np.float64]
    propagated: NDArray[np.float64]


@njit_inline
def _predict(
    start: int,
    stop: int,
    carry: Carry,
    flight: Flight,
    parameters: NDArray[np.float64],
    free: NDArray[np.int64],
    table: TermTable,
    constants: Constants,
    variance: NDArray[np.float64],
    predicted: NDArray[np.float64],
    white: NDArray[np.float64],
    white_columns: NDArray[np.float64],
    work: Workspace,
    step: Step,
    room: SampleWorkspace,
) -> tuple[bool, float]:
    """As `predict_stretch`, in work arrays that are given."""
    layout = constants.layout
    states, leading = state_count(layout), leading_columns(layout)
    extra = flight.inputs.shape[1] - leading
    x, columns, error, error_columns, cov = carry
    width = columns.shape[1]
    free_count = free.shape[0]
    size = states + extra
    filtering = False
    for j in range(extra):
        if flight.input_variance[j] > 0.0:
            filtering = True
    gain, row, moved, sensitivity, next_columns, corrected_input, last_input, propagated = room
    log_sum = 0.0
    samples = flight.time.shape[0]
    for k in range(start, stop):
        evaluate(x, flight.inputs[k], parameters, table, constants, flight.positions, work, True, True)
        if not within_limit(work.outputs, layout):
            return False, np.inf
        for a in range(states):
            moved[a] = 0.0
        for i in range(output_count(layout)):
            predicted[k - start, i] = work.outputs[i]
            if np.isnan(flight.measured[k, i]):
                white[k - start, i] = np.nan
                for c in range(width):
                    white_columns[k - start, i, c] = 0.0
                continue
            value = work.outputs[i]
            for a in range(states):
                row[a] = work.outputs_x[i, a]
                value += row[a] * moved[a]
            for j in range(extra):
                row[states + j] = work.outputs_u[i, j]
                value += row[states + j] * error[j]
            for c in range(width):
                total = 0.0
                for a in range(states):
                    total += row[a] * columns[a, c]
                sensitivity[c] = total
            for c in range(free_count):
                sensitivity[c] += work.outputs_p[i, free[c]]
            for j in range(extra):
                if row[states + j] != 0.0:
                    for c in range(width):
                        sensitivity[c] += row[states + j] * error_columns[j, c]
            innovation_variance = variance[i]
            if filtering:
                for a in range(size):
                    total = 0.0
                    for b in range(size):
                        total += cov[a, b] * row[b]
                    gain[a] = total
                for a in range(size):
                    innovation_variance += row[a] * gain[a]
            innovation = flight.measured[k, i] - value
            scale = 1.0 / np.sqrt(innovation_variance)
            log_sum += np.log(innovation_variance)
            white[k - start, i] = innovation * scale
            for c in range(width):
                white_columns[k - start, i, c] = sensitivity[c] * scale
            if filtering:
                for a in range(size):
                    gain[a] /= innovation_variance
                for a in range(size):
                    for b in range(size):
                        cov[a, b] -= gain[a] * gain[b] * innovation_variance
                for a in range(states):
                    moved[a] += gain[a] * innovation
                    for c in range(width):
                        columns[a, c] -= gain[a] * sensitivity[c]
                for j in range(extra):
                    error[j] += gain[states + j] * innovation
                    for c in range(width):
                        error_columns[j, c] -= gain[states + j] * sensitivity[c]
        if k + 1 >= samples:
            continue
        for a in range(states):
            x[a] += moved[a]
        for j in range(leading + extra):
            corrected_input[j] = flight.inputs[k, j]
        for j in range(extra):
            corrected_input[leading + j] += error[j]
        inputs_at_end(corrected_input, flight.inputs[k + 1], flight.held, flight.ramp, last_input)
        advance(
            x,
            corrected_input,
            last_input,
            flight.time[k + 1] - flight.time[k],
            flight.substeps,
            parameters,
            table,
            constants,
            flight.positions,
            work,
            step,
            True,
        )
        hold_columns(step.start, step.end, flight.held, flight.ramp, leading)
        for a in range(states):
            x[a] = step.state[a]
            for c in range(width):
                total = 0.0
                for b in range(states):
                    total += step.transition[a, b] * columns[b, c]
                for j in range(extra):
                    total += step.start[a, j] * error_columns[j, c]
                next_columns[a, c] = total
            for c in range(free_count):
                next_columns[a, c] += step.terms[a, free[c]]
        for a in range(states):
            for c in range(width):
                columns[a, c] = next_columns[a, c]
        if filtering:
            _propagate_covariance(cov, step.transition, step.start, step.end, flight.input_variance, propagated, states)
        for j in range(extra):
            error[j] = 0.0
            for c in range(width):
                error_columns[j, c] = 0.0
    return True, log_sum


@njit_inline
def _propagate_covariance(
    cov: NDArray[np.float64],
    transition: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    input_variance: NDArray[np.float64],
    propagated: NDArray[np.float64],
    states: int,
) -> None:
    """Covariance of state and input error at the next sample: eq. (11) with the inputs' noise as model error."""
    extra = input_variance.shape[0]
    size = states + extra
    for a in range(states):
        for b in range(size):
            total = 0.0
            for c in range(states):
                total += transition[a, c] * cov[c, b]
            for j in range(extra):
                total += start[a, j] * cov[states + j, b]
            propagated[a, b] = total
    for a in range(states):
        for b in range(a + 1):
            total = 0.0
            for c in range(states):
                total += propagated[a, c] * transition[b, c]
            for j in range(extra):
                total += propagated[a, states + j] * start[b, j]
                total += end[a, j] * input_variance[j] * end[b, j]
            cov[a, b] = total
            cov[b, a] = total
        for j in range(extra):
            cov[a, states + j] = end[a, j] * input_variance[j]
            cov[states + j, a] = cov[a, states + j]
    for j in range(extra):
        for i in range(extra):
            cov[states + i, states + j] = 0.0
        cov[states + j, states + j] = input_variance[j]
