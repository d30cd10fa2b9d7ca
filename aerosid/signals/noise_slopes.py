"""Slopes of the likelihood with respect to the noise of outputs and of inputs, along one simulated flight.

Differences need a whitening for each number: of six forces with a spread and a memory each, and of ten outputs, twenty
a step. One filter and its adjoint give all slopes, in the time of three whitenings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.signals.adjoint import information_before_measurement, information_before_step
from aerosid.signals.array_elements import copy_row
from aerosid.signals.input_noise import InputNoise, initial_covariance, initial_error
from aerosid.signals.sensor_dynamics import SensorStates, read_row
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import propagate, propagate_with_sensors, step_with_sensors

Array = NDArray[np.float64]


class NoiseSlopes(NamedTuple):
    """-2 ln L of a residual but for a constant, and its slopes.

    `cost`; `by_output` (m,) with respect to the outputs' variances; `by_variance` and `by_memory` (E,) with respect to
    the inputs' as `InputNoise` has them.
    """

    cost: float
    by_output: Array
    by_variance: Array
    by_memory: Array


def noise_slopes(
    held: NDArray[np.bool_],
    residual: Array,
    trace: Trace,
    output_variance: Array,
    noise: InputNoise,
    sensors: SensorStates,
) -> NoiseSlopes:
    """The cost of a whole record's residual and its slopes; the initial state is known, as a parameter is.

    Parameters
    ----------
    held : (N, m) bool
        Which outputs were measured.
    residual : (N, m)
        Measured minus simulated, SI.
    trace : Trace
        Linearisation along the simulated record.
    output_variance : (m,)
        Noise variance of each output, SI squared.
    noise : InputNoise
        Of E inputs.
    sensors : SensorStates
        What the sensors make of the inputs' noise on its way.

    Notes
    -----
    Koopman & Shephard, Biometrika 79, 1992: with the adjoint lambda, Lambda of the filter (modified Bryson-Frazier
    form), d ln L / d P = (lambda lambda' - Lambda) / 2 for every covariance that enters, and d ln L / d x = -lambda.
    With w+ = m w + v the memory acts where v does: the fresh part v has the variance (1 - m^2) of w's own.
    """
    states = trace.outputs_x.shape[2]
    start = initial_covariance(np.zeros((states, states)), noise, trace, sensors)
    first = initial_error(trace, sensors)
    outputs, extra = residual.shape[1], noise.variance.size
    by_output, by_fresh, by_start, by_step = np.zeros(outputs), *(np.zeros(extra) for _ in range(3))
    # Contiguous whatever they are slices of: a kernel is compiled anew for each layout.
    measured = np.ascontiguousarray(held), np.ascontiguousarray(residual)
    cost = _slopes(
        *measured, trace, output_variance, noise, sensors, start, first, by_output, by_fresh, by_start, by_step
    )
    by_variance = (1.0 - noise.memory**2) * by_fresh + by_start
    by_memory = by_step - 2.0 * noise.memory * noise.variance * by_fresh
    return NoiseSlopes(float(cost), by_output, by_variance, by_memory)


@njit
def _slopes(
    held: NDArray[np.bool_],
    residual: Array,
    trace: Trace,
    output_variance: Array,
    noise: InputNoise,
    sensors: SensorStates,
    start: Array,
    first: Array,
    by_output: Array,
    by_fresh: Array,
    by_start: Array,
    by_step: Array,
) -> float:
    """-2 ln L; adds its slopes: by the variances of the outputs and of v, of w at the start, and by a step's memory.

    `start` (S, S) is the covariance at the first sample, `first` (S, E) what each input's error is in it.
    """
    samples, outputs = residual.shape
    states, extra, size = trace.outputs_x.shape[2], noise.variance.shape[0], start.shape[0]
    gains, spreads = np.zeros((samples, outputs, size)), np.zeros((samples, outputs))
    innovations = np.zeros((samples, outputs))
    errors, covariances = np.zeros((samples, extra)), np.zeros((samples, extra, size))
    cov, x, row = start.copy(), np.zeros(size), np.zeros(size)
    transition, half, entry = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, extra))
    propagated, moved = np.zeros((states, states + extra)), np.zeros(size)
    cost = 0.0
    for k in range(samples):
        for i in range(outputs):
            if held[k, i]:
                read_row(trace.outputs_x[k], trace.outputs_u[k], i, sensors, row, states)
                spread, innovation = _measured(row, output_variance[i], residual[k, i], cov, x, gains[k, i])
                spreads[k, i], innovations[k, i] = spread, innovation
                cost += np.log(spread) + innovation * innovation / spread
        for j in range(extra):
            errors[k, j] = x[states + j]
            for a in range(size):
                covariances[k, j, a] = cov[a, states + j]
        if k + 1 < samples:
            step_with_sensors(trace, k, noise, sensors, transition, entry)
            _apply(transition, x, moved)
            copy_row(x, moved)
            if size > states + extra:
                propagate_with_sensors(cov, transition, entry, noise, half)
            else:
                propagate(cov, trace.transition[k], trace.start[k], trace.end[k], noise, propagated, extra, trace.sizes)
    costate, information = np.zeros(size), np.zeros((size, size))
    for back in range(samples):
        k = samples - 1 - back
        for turn in range(outputs):
            i = outputs - 1 - turn
            if held[k, i]:
                read_row(trace.outputs_x[k], trace.outputs_u[k], i, sensors, row, states)
                known = gains[k, i], spreads[k, i], innovations[k, i]
                by_output[i] += _taken_back(row, *known, costate, information, moved)
        if k == 0:
            break
        step_with_sensors(trace, k - 1, noise, sensors, transition, entry)
        for j in range(extra):
            by_fresh[j] += _curvature(entry[:, j], costate, information, entry[:, j])
            # The error of this input just before, carried to here.
            _apply(transition, covariances[k - 1, j], moved)
            along = 0.0
            for a in range(size):
                along += entry[a, j] * costate[a]
            by_step[j] += 2.0 * along * errors[k - 1, j]
            by_step[j] += 2.0 * _curvature(entry[:, j], costate, information, moved)
        _carry_back(transition, costate, information, moved, half)
    for j in range(extra):
        by_start[j] += _curvature(first[:, j], costate, information, first[:, j])
    return cost


@njit_inline
def _measured(row: Array, variance: float, residual: float, cov: Array, x: Array, gain: Array) -> tuple[float, float]:
    """Take in one measurement with a `gain` (S,), which is written; variance and value of its innovation."""
    size = row.shape[0]
    spread, innovation = variance, residual
    for a in range(size):
        gain[a] = 0.0
    for b in range(size):
        slope = row[b]
        if slope != 0.0:
            innovation -= slope * x[b]
            for a in range(size):
                gain[a] += slope * cov[b, a]
    for a in range(size):
        spread += row[a] * gain[a]
    for a in range(size):
        gain[a] /= spread
    for a in range(size):
        for b in range(size):
            cov[a, b] -= spread * gain[a] * gain[b]
        x[a] += gain[a] * innovation
    return spread, innovation


@njit_inline
def _taken_back(
    row: Array, gain: Array, spread: float, innovation: float, costate: Array, information: Array, through: Array
) -> float:
    """Carry costate (S,) and information (S, S) back over one measurement; slope of -2 ln L by its noise variance."""
    along = innovation / spread
    for a in range(row.shape[0]):
        along += gain[a] * costate[a]
    for a in range(row.shape[0]):
        costate[a] -= row[a] * along
    quadratic = information_before_measurement(row, gain, spread, information, through)
    return quadratic - along * along


@njit_inline
def _curvature(left: Array, costate: Array, information: Array, right: Array) -> float:
    """Of left' (Lambda - lambda lambda') right."""
    size = costate.shape[0]
    total, by_left, by_right = 0.0, 0.0, 0.0
    for a in range(size):
        if left[a] != 0.0:
            inner = 0.0
            for b in range(size):
                inner += information[a, b] * right[b]
            total += left[a] * inner
            by_left += left[a] * costate[a]
        by_right += right[a] * costate[a]
    return total - by_left * by_right


@njit_inline
def _apply(matrix: Array, vector: Array, product: Array) -> None:
    """Write the product of a square matrix and a vector to `product`, another vector."""
    for a in range(vector.shape[0]):
        total = 0.0
        for b in range(vector.shape[0]):
            total += matrix[a, b] * vector[b]
        product[a] = total


@njit_inline
def _carry_back(transition: Array, costate: Array, information: Array, moved: Array, half: Array) -> None:
    """Costate and information one sample earlier: Phi' lambda and Phi' Lambda Phi, in place."""
    _apply(transition.T, costate, moved)
    copy_row(costate, moved)
    information_before_step(transition, information, half)
