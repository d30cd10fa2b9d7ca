"""Whitening of open-loop residuals: measured inputs' noise as process noise along the simulated flight.

The noise of each sample of a measured surface moves the simulated states in the intervals on both sides of the sample
and, directly, the accelerometers. The filter here knows that path along the simulated flight and turns residuals, and
every column of sensitivities alike, into ones of unit variance without correlation. It is linear: what it does to the
residual it does to a candidate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.signals.input_noise import InputNoise, initial_covariance
from aerosid.signals.sensor_dynamics import SensorStates, read_row
from aerosid.signals.trace import StateSizes, Trace, carry_columns


class WhiteningCarry(NamedTuple):
    """What passes between stretches, changed in place; C columns (the residual first), S = n + E + sensors' states.

    `deviation` (S, C) estimated error of states, inputs and sensors; `covariance` (S, S).
    """

    deviation: NDArray[np.float64]
    covariance: NDArray[np.float64]


def make_whitening_carry(noise: InputNoise, columns: int, trace: Trace, sensors: SensorStates) -> WhiteningCarry:
    """The carry at the first sample: the initial state is a parameter, so that only the inputs are uncertain."""
    states = trace.outputs_x.shape[2]
    covariance = initial_covariance(np.zeros((states, states)), noise, trace, sensors)
    return WhiteningCarry(np.zeros((covariance.shape[0], columns)), covariance)


@njit
def whiten_stretch(
    held: NDArray[np.bool_],
    columns: NDArray[np.float64],
    trace: Trace,
    output_variance: NDArray[np.float64],
    noise: InputNoise,
    sensors: SensorStates,
    carry: WhiteningCarry,
) -> float:
    """Whiten `columns` in place and move `carry` on; returns the sum of the logarithms of the innovation variances.

    Parameters
    ----------
    held : (N, m)
        Which outputs were measured.
    columns : (N, m, C)
        The residual (measured minus simulated) and the derivatives of the simulated outputs.
    trace : Trace
        Linearisation along the simulated stretch.
    output_variance : (m,)
        Noise variance of each output, SI squared.
    sensors : SensorStates
        What the sensors make of the noise on its way.

    Notes
    -----
    Measurements of a sample enter one after the other, so that no matrix is factored.
    """
    extra, size, width = noise.variance.shape[0], carry.covariance.shape[0], columns.shape[2]
    states = len(trace.sizes.coupled) + len(trace.sizes.alone)
    room = Room(
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.zeros((size, width)),
        np.zeros((states, states + extra)),
        np.zeros((size, size)),
        np.zeros((size, size)),
        np.zeros((size, extra)),
    )
    if extra == 1 and size == states + 1:  # one measured surface, sensors at once: loops of known length are unrolled
        return _whiten(held, columns, trace, output_variance, noise, sensors, carry, room, 1, states + 1)
    return _whiten(held, columns, trace, output_variance, noise, sensors, carry, room, extra, size)


class Room(NamedTuple):
    """Room for one sample, of S states in all: `moved` (S, C), `transition` and `half` (S, S), `entry` (S, E)."""

    row: NDArray[np.float64]
    gain: NDArray[np.float64]
    kept: NDArray[np.float64]
    moved: NDArray[np.float64]
    propagated: NDArray[np.float64]
    half: NDArray[np.float64]
    transition: NDArray[np.float64]
    entry: NDArray[np.float64]


@njit_inline
def _whiten(
    held: NDArray[np.bool_],
    columns: NDArray[np.float64],
    trace: Trace,
    output_variance: NDArray[np.float64],
    noise: InputNoise,
    sensors: SensorStates,
    carry: WhiteningCarry,
    room: Room,
    extra: int,
    size: int,
) -> float:
    """As `whiten_stretch`, in work arrays that are given; `extra` inputs, `size` states in all."""
    deviation, cov = carry
    row, gain, kept, moved, propagated, half, transition, entry = room
    width, sizes = columns.shape[2], trace.sizes
    active = False
    for j in range(extra):
        if noise.variance[j] > 0.0:
            active = True
    log_sum = 0.0
    for k in range(columns.shape[0]):
        volume = 1.0  # a few variances: their product is far from the ends of what a number holds
        for i in range(columns.shape[1]):
            if not held[k, i]:
                for c in range(width):
                    columns[k, i, c] = 0.0
                continue
            spread = output_variance[i]
            if active:
                read_row(trace.outputs_x[k], trace.outputs_u[k], i, sensors, row, len(sizes.coupled) + len(sizes.alone))
                for a in range(size):
                    kept[a] = 0.0
                for b in range(size):
                    slope = row[b]
                    if slope != 0.0:
                        for a in range(size):
                            kept[a] += cov[b, a] * slope
                for a in range(size):
                    spread += row[a] * kept[a]
                inverse = 1.0 / spread
                for a in range(size):
                    gain[a] = kept[a] * inverse
                for a in range(size):
                    for b in range(a + 1):
                        left = cov[a, b] - gain[a] * kept[b]
                        cov[a, b] = left
                        cov[b, a] = left
                _take_in(columns[k, i], deviation, row, gain, size, sizes)
            scale = 1.0 / np.sqrt(spread)
            volume *= spread
            for c in range(width):
                columns[k, i, c] *= scale
        log_sum += np.log(volume)
        if not active:
            continue
        if size > len(sizes.coupled) + len(sizes.alone) + extra:
            step_with_sensors(trace, k, noise, sensors, transition, entry)
            _carry_with_sensors(deviation, transition, moved)
            propagate_with_sensors(cov, transition, entry, noise, half)
            continue
        _carry_on(deviation, trace.transition[k], trace.start[k], trace.end[k], noise, moved, extra, sizes)
        propagate(cov, trace.transition[k], trace.start[k], trace.end[k], noise, propagated, extra, sizes)
    return log_sum


@njit_inline
def _take_in(
    column: NDArray[np.float64],
    deviation: NDArray[np.float64],
    row: NDArray[np.float64],
    gain: NDArray[np.float64],
    size: int,
    sizes: StateSizes,
) -> None:
    """Take out of one output's columns (C,) what is known of them, and learn from the rest."""
    width, coupled = column.shape[0], len(sizes.coupled)
    for c in range(width):
        total = row[0] * deviation[0, c]
        for a in range(1, coupled):
            total += row[a] * deviation[a, c]
        column[c] -= total
    for a in range(coupled, size):
        slope = row[a]
        if slope != 0.0:
            for c in range(width):
                column[c] -= slope * deviation[a, c]
    for a in range(size):
        learnt = gain[a]
        if learnt != 0.0:
            for c in range(width):
                deviation[a, c] += learnt * column[c]


@njit_inline
def _carry_on(
    deviation: NDArray[np.float64],
    transition: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    noise: InputNoise,
    moved: NDArray[np.float64],
    extra: int,
    sizes: StateSizes,
) -> None:
    """The estimated errors at the next sample, in place; `moved` is room to work."""
    width, states = deviation.shape[1], len(sizes.coupled) + len(sizes.alone)
    carry_columns(transition, deviation, moved, sizes)
    for a in range(states):
        for j in range(extra):
            push = start[a, j] + end[a, j] * noise.memory[j]
            if push != 0.0 and noise.variance[j] > 0.0:
                for c in range(width):
                    moved[a, c] += push * deviation[states + j, c]
        for c in range(width):
            deviation[a, c] = moved[a, c]
    for j in range(extra):
        memory = noise.memory[j]
        for c in range(width):
            deviation[states + j, c] *= memory


@njit_inline
def _carry_with_sensors(
    deviation: NDArray[np.float64], transition: NDArray[np.float64], moved: NDArray[np.float64]
) -> None:
    """The estimated errors of states, inputs and sensors at the next sample, in place; `moved` is room to work."""
    size, width = deviation.shape
    for a in range(size):
        for c in range(width):
            moved[a, c] = 0.0
        for b in range(size):
            share = transition[a, b]
            if share != 0.0:
                for c in range(width):
                    moved[a, c] += share * deviation[b, c]
    for a in range(size):
        for c in range(width):
            deviation[a, c] = moved[a, c]


@njit_inline
def step_with_sensors(
    trace: Trace,
    k: int,
    noise: InputNoise,
    sensors: SensorStates,
    transition: NDArray[np.float64],
    entry: NDArray[np.float64],
) -> None:
    """Write the step of states, input errors and sensors from sample k: z+ = `transition` z + `entry` v.

    v (E,) is the fresh part of the inputs' errors. After the last sample of a stretch the outputs' slopes are kept.
    """
    extra = noise.variance.shape[0]
    states = trace.outputs_x.shape[2]
    plain = states + extra
    after = min(k + 1, trace.outputs_x.shape[0] - 1)
    for a in range(transition.shape[0]):
        for b in range(transition.shape[0]):
            transition[a, b] = 0.0
        for j in range(extra):
            entry[a, j] = 0.0
    for a in range(states):
        for b in range(states):
            transition[a, b] = trace.transition[k, a, b]
        for j in range(extra):
            transition[a, states + j] = trace.start[k, a, j] + trace.end[k, a, j] * noise.memory[j]
            entry[a, j] = trace.end[k, a, j]
    for j in range(extra):
        transition[states + j, states + j] = noise.memory[j]
        entry[states + j, j] = 1.0
    for m in range(sensors.source.shape[0]):
        i = sensors.source[m]
        for b in range(plain):
            before = trace.outputs_x[k, i, b] if b < states else trace.outputs_u[k, i, b - states]
            transition[plain + m, b] += sensors.old[m] * before
            slope = trace.outputs_x[after, i, b] if b < states else trace.outputs_u[after, i, b - states]
            if slope != 0.0:
                for c in range(plain):
                    transition[plain + m, c] += sensors.new[m] * slope * transition[b, c]
                for j in range(extra):
                    entry[plain + m, j] += sensors.new[m] * slope * entry[b, j]
        for other in range(sensors.source.shape[0]):
            transition[plain + m, plain + other] = sensors.memory[m, other]


@njit_inline
def propagate(
    cov: NDArray[np.float64],
    transition: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    noise: InputNoise,
    propagated: NDArray[np.float64],
    extra: int,
    sizes: StateSizes,
) -> None:
    """Covariance of state and input error at the next sample: eq. (11), `extra` inputs' noise being the model error.

    With w+ = m w + v the state moves as Phi x + (start + m end) w + end v; v has the variance (1 - m^2) of w's own.
    """
    states = len(sizes.coupled) + len(sizes.alone)
    size = states + extra
    for a in range(states):
        for b in range(size):
            total = 0.0
            for c in range(states):
                total += transition[a, c] * cov[c, b]
            for j in range(extra):
                total += (start[a, j] + end[a, j] * noise.memory[j]) * cov[states + j, b]
            propagated[a, b] = total
    for a in range(states):
        for b in range(a + 1):
            total = 0.0
            for c in range(states):
                total += propagated[a, c] * transition[b, c]
            for j in range(extra):
                fresh = noise.variance[j] * (1.0 - noise.memory[j] * noise.memory[j])
                total += propagated[a, states + j] * (start[b, j] + end[b, j] * noise.memory[j])
                total += end[a, j] * fresh * end[b, j]
            cov[a, b] = total
            cov[b, a] = total
    for j in range(extra):
        for i in range(j + 1):
            value = noise.memory[i] * cov[states + i, states + j] * noise.memory[j]
            cov[states + i, states + j] = value
            cov[states + j, states + i] = value
        fresh = noise.variance[j] * (1.0 - noise.memory[j] * noise.memory[j])
        cov[states + j, states + j] += fresh
        for a in range(states):
            value = propagated[a, states + j] * noise.memory[j] + end[a, j] * fresh
            cov[a, states + j] = value
            cov[states + j, a] = value


@njit_inline
def propagate_with_sensors(
    cov: NDArray[np.float64],
    transition: NDArray[np.float64],
    entry: NDArray[np.float64],
    noise: InputNoise,
    half: NDArray[np.float64],
) -> None:
    """Covariance of states, input errors and sensors at the next sample: eq. (11) again; `half` is room to work."""
    size = cov.shape[0]
    for a in range(size):
        for b in range(size):
            half[a, b] = 0.0
        for c in range(size):
            if transition[a, c] != 0.0:
                for b in range(size):
                    half[a, b] += transition[a, c] * cov[c, b]
    for a in range(size):
        for b in range(size):
            total = 0.0
            for c in range(size):
                total += half[a, c] * transition[b, c]
            cov[a, b] = total
    for j in range(noise.variance.shape[0]):
        fresh = noise.variance[j] * (1.0 - noise.memory[j] * noise.memory[j])
        for a in range(cov.shape[0]):
            for b in range(cov.shape[0]):
                cov[a, b] += entry[a, j] * fresh * entry[b, j]
