"""Fixed-interval smoothing of input errors along a simulated flight.

Along a simulated flight, linearised, the errors of the inputs (a disturbance, an unmodelled force) with a memory from
sample to sample move states and outputs. From all measurements of the record follow the input errors of every sample
and their covariance. The operator is linear: what it does to the residual it does to any other column.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.signals.adjoint import information_before_measurement, information_before_step
from aerosid.signals.array_elements import copy_rows, multiply_in_place
from aerosid.signals.input_noise import InputNoise
from aerosid.signals.sensor_dynamics import SensorStates, read_row
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import propagate, propagate_with_sensors, step_with_sensors


@njit
def smooth_inputs(
    held: NDArray[np.bool_],
    columns: NDArray[np.float64],
    trace: Trace,
    output_variance: NDArray[np.float64],
    noise: InputNoise,
    sensors: SensorStates,
    start: NDArray[np.float64],
    errors: NDArray[np.float64],
    variances: NDArray[np.float64],
) -> None:
    """Write the smoothed input errors (N, E, C) and their variances (N, E) of a whole record.

    Parameters
    ----------
    held : (N, m)
        Which outputs were measured.
    columns : (N, m, C)
        Differences from the simulated outputs, in SI.
    trace : Trace
        Linearisation along the simulated record.
    output_variance : (m,)
        Noise variance of each output, SI squared.
    noise : InputNoise
        Variance and memory of each input's error.
    sensors : SensorStates
        What the sensors make of the errors on their way.
    start : (S, S)
        Covariance at the first sample of the states, the input errors and the sensors' states.

    Notes
    -----
    Filter forward, adjoint backward (the modified Bryson-Frazier form: Bierman, Automatica 9, 1973): no covariance is
    inverted, so that inputs without noise and states without error are no obstacle. The costate is that of
    Parameswaran & Raol 1994, eqs. (6)-(8), with lambda = 0 at the record's end.
    """
    samples, outputs, width = columns.shape
    states, extra = trace.outputs_x.shape[2], noise.variance.shape[0]
    plain, size = states + extra, start.shape[0]
    before = np.zeros((samples, size, size))
    predicted = np.zeros((samples, size, width))
    gains = np.zeros((samples, outputs, size))
    spreads = np.zeros((samples, outputs))
    innovations = np.zeros((samples, outputs, width))
    cov = start.copy()
    x, moved = np.zeros((size, width)), np.zeros((states, width))
    propagated, row = np.zeros((states, plain)), np.zeros(size)
    transition, half, entry = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, extra))
    product, along = np.zeros((size, width)), np.zeros(size)
    for k in range(samples):
        copy_rows(before[k], cov)
        copy_rows(predicted[k], x)
        for i in range(outputs):
            if not held[k, i]:
                continue
            read_row(trace.outputs_x[k], trace.outputs_u[k], i, sensors, row, states)
            spread = output_variance[i]
            for a in range(size):
                total = 0.0
                for b in range(size):
                    total += cov[a, b] * row[b]
                gains[k, i, a] = total
                spread += row[a] * total
            spreads[k, i] = spread
            for c in range(width):
                total = columns[k, i, c]
                for a in range(size):
                    total -= row[a] * x[a, c]
                innovations[k, i, c] = total
            for a in range(size):
                gains[k, i, a] /= spread
            for a in range(size):
                for b in range(size):
                    cov[a, b] -= gains[k, i, a] * gains[k, i, b] * spread
                for c in range(width):
                    x[a, c] += gains[k, i, a] * innovations[k, i, c]
        if k + 1 == samples:
            break
        if size > plain:
            step_with_sensors(trace, k, noise, sensors, transition, entry)
            multiply_in_place(transition, x, product)
            propagate_with_sensors(cov, transition, entry, noise, half)
            continue
        for a in range(states):
            for c in range(width):
                total = 0.0
                for b in range(states):
                    total += trace.transition[k, a, b] * x[b, c]
                for j in range(extra):
                    total += (trace.start[k, a, j] + trace.end[k, a, j] * noise.memory[j]) * x[states + j, c]
                moved[a, c] = total
        copy_rows(x, moved)
        for j in range(extra):
            for c in range(width):
                x[states + j, c] *= noise.memory[j]
        propagate(cov, trace.transition[k], trace.start[k], trace.end[k], noise, propagated, extra, trace.sizes)
    costate, information = np.zeros((size, width)), np.zeros((size, size))
    for back in range(samples):
        k = samples - 1 - back
        for turn in range(outputs):
            i = outputs - 1 - turn
            if not held[k, i]:
                continue
            read_row(trace.outputs_x[k], trace.outputs_u[k], i, sensors, row, states)
            _take_measurement(row, gains[k, i], spreads[k, i], innovations[k, i], costate, information, along)
        for j in range(extra):
            place = states + j
            for c in range(width):
                total = predicted[k, place, c]
                for a in range(size):
                    total -= before[k, place, a] * costate[a, c]
                errors[k, j, c] = total
            variance = before[k, place, place]
            for a in range(size):
                for b in range(size):
                    variance -= before[k, place, a] * information[a, b] * before[k, b, place]
            variances[k, j] = max(variance, 0.0)
        if k > 0:
            step_with_sensors(trace, k - 1, noise, sensors, transition, entry)
            multiply_in_place(transition.T, costate, product)
            information_before_step(transition, information, half)


@njit
def _take_measurement(
    row: NDArray[np.float64],
    gain: NDArray[np.float64],
    spread: float,
    innovation: NDArray[np.float64],
    costate: NDArray[np.float64],
    information: NDArray[np.float64],
    through: NDArray[np.float64],
) -> None:
    """Carry costate (S, C) and information (S, S) back over one measurement, in place.

    lambda <- (I - K h)' lambda - h e / s; `through` (S,) is work space.
    """
    size, width = costate.shape
    for c in range(width):
        along = 0.0
        for a in range(size):
            along += gain[a] * costate[a, c]
        along += innovation[c] / spread
        for a in range(size):
            costate[a, c] -= row[a] * along
    information_before_measurement(row, gain, spread, information, through)
