"""Whiten residuals of an open-loop simulation: the noise of measured inputs acts on the aircraft as process noise.

The noise of each sample of a measured surface moves the simulated states in the intervals on both sides of the sample
and, directly, the accelerometers. The filter here knows that path along the simulated flight and turns residuals, and
every column of sensitivities alike, into ones of unit variance without correlation. It is linear: what it does to the
residual it does to a candidate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.response import Trace


class InputNoise(NamedTuple):
    """Noise of the extra inputs: `variance` (E) of each sample, SI squared; `memory` (E) its correlation with the last.

    memory 0 is white (a measured surface); exp(-dt/T) a disturbance with correlation time T that no channel shows.
    """

    variance: NDArray[np.float64]
    memory: NDArray[np.float64]


class WhiteningCarry(NamedTuple):
    """What passes between stretches, changed in place; C columns (the residual first), E inputs.

    `deviation` (5, C) estimated state error caused by input noise; `input_error` (E, C) of the last sample;
    `covariance` (5 + E, 5 + E).
    """

    deviation: NDArray[np.float64]
    input_error: NDArray[np.float64]
    covariance: NDArray[np.float64]


def make_whitening_carry(noise: InputNoise, columns: int) -> WhiteningCarry:
    """The carry at the first sample: the initial state is a parameter, so that only the inputs are uncertain."""
    extra = noise.variance.size
    covariance = np.zeros((5 + extra, 5 + extra))
    covariance[5:, 5:] = np.diag(noise.variance)
    return WhiteningCarry(np.zeros((5, columns)), np.zeros((extra, columns)), covariance)


@njit
def whiten_stretch(
    held: NDArray[np.bool_],
    columns: NDArray[np.float64],
    trace: Trace,
    output_variance: NDArray[np.float64],
    noise: InputNoise,
    carry: WhiteningCarry,
) -> float:
    """Whiten `columns` in place and move `carry` on; returns the sum of the logarithms of the innovation variances.

    Parameters
    ----------
    held : (n, 8)
        Which outputs were measured.
    columns : (n, 8, C)
        The residual (measured minus simulated) and the derivatives of the simulated outputs.
    trace : Trace
        Linearisation along the simulated stretch.
    output_variance : (8,)
        Noise variance of each output, SI squared.

    Notes
    -----
    Measurements of a sample enter one after the other, so that no matrix is factored.
    """
    extra = noise.variance.shape[0]
    size = 5 + extra
    width = columns.shape[2]
    deviation, error, cov = carry
    active = False
    for j in range(extra):
        if noise.variance[j] > 0.0:
            active = True
    gain, row = np.zeros(size), np.zeros(size)
    moved, propagated = np.zeros((5, width)), np.zeros((5, size))
    log_sum = 0.0
    for k in range(columns.shape[0]):
        for i in range(8):
            if not held[k, i]:
                for c in range(width):
                    columns[k, i, c] = 0.0
                continue
            spread = output_variance[i]
            if active:
                for a in range(5):
                    row[a] = trace.outputs_x[k, i, a]
                for j in range(extra):
                    row[5 + j] = trace.outputs_u[k, i, j]
                for a in range(size):
                    total = 0.0
                    for b in range(size):
                        total += cov[a, b] * row[b]
                    gain[a] = total
                for a in range(size):
                    spread += row[a] * gain[a]
                for a in range(5):
                    if row[a] != 0.0:
                        for c in range(width):
                            columns[k, i, c] -= row[a] * deviation[a, c]
                for j in range(extra):
                    if row[5 + j] != 0.0:
                        for c in range(width):
                            columns[k, i, c] -= row[5 + j] * error[j, c]
                for a in range(size):
                    gain[a] /= spread
                for a in range(size):
                    for b in range(size):
                        cov[a, b] -= gain[a] * gain[b] * spread
                for a in range(5):
                    for c in range(width):
                        deviation[a, c] += gain[a] * columns[k, i, c]
                for j in range(extra):
                    for c in range(width):
                        error[j, c] += gain[5 + j] * columns[k, i, c]
            scale = 1.0 / np.sqrt(spread)
            log_sum += np.log(spread)
            for c in range(width):
                columns[k, i, c] *= scale
        if not active:
            continue
        for a in range(5):
            for c in range(width):
                total = 0.0
                for b in range(5):
                    total += trace.transition[k, a, b] * deviation[b, c]
                for j in range(extra):
                    total += (trace.start[k, a, j] + trace.end[k, a, j] * noise.memory[j]) * error[j, c]
                moved[a, c] = total
        deviation[:, :] = moved
        for j in range(extra):
            for c in range(width):
                error[j, c] *= noise.memory[j]
        propagate(cov, trace.transition[k], trace.start[k], trace.end[k], noise, propagated)
    return log_sum


@njit
def propagate(
    cov: NDArray[np.float64],
    transition: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    noise: InputNoise,
    propagated: NDArray[np.float64],
) -> None:
    """Covariance of state and input error at the next sample: eq. (11), the inputs' noise being the model error.

    With w+ = m w + v the state moves as Phi x + (start + m end) w + end v; v has the variance (1 - m^2) of w's own.
    """
    extra = noise.variance.shape[0]
    size = 5 + extra
    for a in range(5):
        for b in range(size):
            total = 0.0
            for c in range(5):
                total += transition[a, c] * cov[c, b]
            for j in range(extra):
                total += (start[a, j] + end[a, j] * noise.memory[j]) * cov[5 + j, b]
            propagated[a, b] = total
    for a in range(5):
        for b in range(a + 1):
            total = 0.0
            for c in range(5):
                total += propagated[a, c] * transition[b, c]
            for j in range(extra):
                fresh = noise.variance[j] * (1.0 - noise.memory[j] * noise.memory[j])
                total += propagated[a, 5 + j] * (start[b, j] + end[b, j] * noise.memory[j])
                total += end[a, j] * fresh * end[b, j]
            cov[a, b] = total
            cov[b, a] = total
    for j in range(extra):
        for i in range(j + 1):
            value = noise.memory[i] * cov[5 + i, 5 + j] * noise.memory[j]
            cov[5 + i, 5 + j] = value
            cov[5 + j, 5 + i] = value
        fresh = noise.variance[j] * (1.0 - noise.memory[j] * noise.memory[j])
        cov[5 + j, 5 + j] += fresh
        for a in range(5):
            value = propagated[a, 5 + j] * noise.memory[j] + end[a, j] * fresh
            cov[a, 5 + j] = value
            cov[5 + j, a] = value
