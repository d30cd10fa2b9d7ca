"""Whitened rows of flights with d(t): residuals and sensitivities through one Kalman filter, and d(t) smoothed back.

What the filter of the model error does to the residual it does to the columns of the terms, sensors and controls that
are estimated, and to those that are only asked about.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.model_error.flights_in_error import FlightsInError, FlownError
from aerosid.model_error.swept_model import ErrorStatistics, Rows, SweptModel
from aerosid.signals.smoothing import smooth_inputs
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import (
    InputNoise,
    initial_covariance,
    make_whitening_carry,
    noisy_inputs_alone,
    whiten_stretch,
)

Array = NDArray[np.float64]

STATE_COUNT = len(LONGITUDINAL.integrated)


def whitened_rows(
    flights: FlightsInError,
    swept: SweptModel,
    traced: Iterable[FlownError],
    entries: Sequence[Entry] = (),
) -> Rows:
    """The innovations and every column through the same filter; flights one by one, whose traces need not be kept."""
    found: list[tuple[Array, NDArray[np.bool_]]] = []
    log_sum = 0.0
    for n, flown in enumerate(traced):
        block = columns_of(swept, flown, n, len(entries))
        flown = without_columns(flown)
        log_sum += whiten(flights, n, flown, block, swept.statistics)
        found.append((block, flown.part.held))
    channels = [(n, int(i)) for n, (_, held) in enumerate(found) for i in np.flatnonzero(held.any(axis=0))]
    lengths = tuple(int(found[n][1][:, i].sum()) for n, i in channels)
    total, width = sum(lengths), 1 + known_count(swept)
    target, known, asked = (np.empty((total, c)) for c in (1, width - 1, found[0][0].shape[2] - width))
    first = 0
    for (n, i), length in zip(channels, lengths, strict=True):
        block, held = found[n]
        for whole, part in ((target, slice(1)), (known, slice(1, width)), (asked, slice(width, None))):
            whole[first : first + length] = block[held[:, i], i, part]
        first += length
    return Rows(target[:, 0].copy(), known, asked, lengths, log_sum, tuple(channels))


def known_count(swept: SweptModel) -> int:
    """How many numbers are estimated: free terms, effects' numbers, the initial state of each flight."""
    return len(swept.free) + swept.slopes + STATE_COUNT * len(swept.states)


def columns_of(swept: SweptModel, flown: FlownError, n: int, asked: int = 0) -> Array:
    """Of flight n (N, 8, .): the residual as if no d had acted, known columns in joint places, asked columns."""
    free, slopes, known = len(swept.free), swept.slopes, known_count(swept)
    block, held = flown.part.block, flown.part.held
    first = 1 + free + asked + STATE_COUNT
    acted, forces = first + slopes, len(flown.offsets) - 1
    own = 1 + free + slopes + STATE_COUNT * n
    columns = np.zeros((*held.shape, 1 + known + asked + block.shape[2] - acted - forces))
    columns[:, :, 0] = np.where(held, block[:, :, 0] + block[:, :, acted : acted + forces].sum(axis=2), 0.0)
    columns[:, :, 1 : 1 + free] = block[:, :, 1 : 1 + free]
    columns[:, :, 1 + free : 1 + free + slopes] = block[:, :, first:acted]
    columns[:, :, own : own + STATE_COUNT] = block[:, :, first - STATE_COUNT : first]
    columns[:, :, 1 + known : 1 + known + asked] = block[:, :, 1 + free : 1 + free + asked]
    columns[:, :, 1 + known + asked :] = block[:, :, acted + forces :]
    return columns


def without_columns(flown: FlownError) -> FlownError:
    """The flight with its linearisation alone: its columns, the greater part, may go."""
    nothing = flown.part.block[:0]
    part = replace(flown.part, block=nothing, trace=flown.part.trace._replace(block=nothing))
    return replace(flown, part=part)


def whiten(flights: FlightsInError, n: int, flown: FlownError, block: Array, statistics: ErrorStatistics) -> float:
    """Whiten columns (N, 8, C) of a flight in place; the sum of the logarithms of the innovations' variances."""
    noise, trace = _noise(flights, n, flown, statistics)
    part = flown.part
    carry = make_whitening_carry(noise, block.shape[2], trace, part.sensors)
    return float(whiten_stretch(part.held, block, trace, statistics.variance, noise, part.sensors, carry))


def smoothed_error(
    flights: FlightsInError, n: int, flown: FlownError, residual: Array, statistics: ErrorStatistics
) -> tuple[Array, Array]:
    """d(t) (N, coefficients) of a residual (N, 8, 1), and its deviation."""
    noise, trace = _noise(flights, n, flown, statistics)
    part, samples, inputs = flown.part, residual.shape[0], noise.variance.size
    errors, variances = np.zeros((samples, inputs, 1)), np.zeros((samples, inputs))
    start = initial_covariance(np.zeros((STATE_COUNT, STATE_COUNT)), noise, trace, part.sensors)
    present = np.ascontiguousarray(part.held)
    smooth_inputs(present, residual, trace, statistics.variance, noise, part.sensors, start, errors, variances)
    # What has no noise has no error: the air's velocity where it is taken as still.
    moving = flown.offsets if statistics.gust is not None else flown.offsets[:-1]
    noisy = np.flatnonzero((part.noise.variance > 0.0) | np.isin(np.arange(part.noise.variance.size), moving))
    places = [int(np.flatnonzero(noisy == place)[0]) for place in moving]
    found, deviation = np.zeros((samples, len(flown.offsets))), np.zeros((samples, len(flown.offsets)))
    found[:, : len(places)], deviation[:, : len(places)] = errors[:, places, 0], np.sqrt(variances[:, places])
    return found, deviation


def _noise(flights: FlightsInError, n: int, flown: FlownError, statistics: ErrorStatistics) -> tuple[InputNoise, Trace]:
    """The inputs' noise with that of the coefficients, and the linearisation, of what has noise alone."""
    variance, memory = flown.part.noise.variance.copy(), flown.part.noise.memory.copy()
    offsets, air = list(flown.offsets[:-1]), flown.offsets[-1]
    variance[offsets] = np.square(statistics.spread)
    memory[offsets] = np.exp(-flights.intervals[n] / statistics.memory)
    if statistics.gust is not None:
        variance[air] = statistics.gust[0] ** 2
        memory[air] = np.exp(-flights.airspeeds[n] * flights.intervals[n] / statistics.gust[1])
    return noisy_inputs_alone(InputNoise(variance, memory), flown.part.trace)
