"""Whitened rows of flights with d(t): residuals and sensitivities through one Kalman filter, and d(t) smoothed back.

What the filter of the model error does to the residual it does to the columns of the terms, sensors and controls that
are estimated, and to those that are only asked about.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import NoiseEffect
from aerosid.estimation.effect_columns import air_columns
from aerosid.flight_model.aerodynamics import Entry
from aerosid.model_error.flight_sweeps.flights_in_error import FlightsInError, FlownError
from aerosid.model_error.flight_sweeps.swept_model import ErrorStatistics, Rows, SweptModel
from aerosid.signals.input_noise import InputNoise, initial_covariance, noisy_inputs_alone
from aerosid.signals.smoothing import smooth_inputs
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import make_whitening_carry, whiten_stretch

Array = NDArray[np.float64]


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
    return len(swept.free) + swept.slopes + sum(state.size for state in swept.states)


def columns_of(swept: SweptModel, flown: FlownError, n: int, asked: int = 0) -> Array:
    """Of flight n (N, outputs, .): the residual as if no d had acted, known columns in joint places, asked columns."""
    free, slopes, known = len(swept.free), swept.slopes, known_count(swept)
    block, held, states = flown.part.block, flown.part.held, swept.states[n].size
    first = 1 + free + asked + states
    acted, forces = first + slopes, len(flown.offsets)
    own = 1 + free + slopes + states * n
    columns = np.zeros((*held.shape, 1 + known + asked + block.shape[2] - acted - forces))
    columns[:, :, 0] = np.where(held, block[:, :, 0] + block[:, :, acted : acted + forces].sum(axis=2), 0.0)
    columns[:, :, 1 : 1 + free] = block[:, :, 1 : 1 + free]
    columns[:, :, 1 + free : 1 + free + slopes] = block[:, :, first:acted]
    columns[:, :, own : own + states] = block[:, :, first - states : first]
    columns[:, :, 1 + known : 1 + known + asked] = block[:, :, 1 + free : 1 + free + asked]
    columns[:, :, 1 + known + asked :] = block[:, :, acted + forces :]
    return columns


def without_columns(flown: FlownError) -> FlownError:
    """The flight with its linearisation alone: its columns, the greater part, may go."""
    nothing = flown.part.block[:0]
    part = replace(flown.part, block=nothing, trace=flown.part.trace._replace(block=nothing))
    return replace(flown, part=part)


def whiten(flights: FlightsInError, n: int, flown: FlownError, block: Array, statistics: ErrorStatistics) -> float:
    """Whiten columns (N, outputs, C) of a flight in place; the sum of the logarithms of the innovations' variances."""
    noise, trace = _noise(flights, n, flown, statistics)
    part = flown.part
    carry = make_whitening_carry(noise, block.shape[2], trace, part.sensors)
    return float(whiten_stretch(part.held, block, trace, statistics.variance, noise, part.sensors, carry))


def smoothed_error(
    flights: FlightsInError, n: int, flown: FlownError, residual: Array, statistics: ErrorStatistics
) -> tuple[Array, Array]:
    """d(t) (N, coefficients) of a residual (N, outputs, 1), and its deviation; the moving air's after it."""
    noise, trace = _noise(flights, n, flown, statistics)
    part, samples, inputs = flown.part, residual.shape[0], noise.variance.size
    errors, variances = np.zeros((samples, inputs, 1)), np.zeros((samples, inputs))
    still = np.zeros((flights.state_count, flights.state_count))
    start = initial_covariance(still, noise, trace, part.sensors)
    present = np.ascontiguousarray(part.held)
    smooth_inputs(present, residual, trace, statistics.variance, noise, part.sensors, start, errors, variances)
    # What has no noise has no error: the air's velocity where it is taken as still.
    moving = (*flown.offsets, *(place for place, _, _ in _air(flights, n, flown, statistics)))
    noisy = np.flatnonzero((part.noise.variance > 0.0) | np.isin(np.arange(part.noise.variance.size), moving))
    places = [int(np.flatnonzero(noisy == place)[0]) for place in moving]
    return errors[:, places, 0], np.sqrt(variances[:, places])


def _noise(flights: FlightsInError, n: int, flown: FlownError, statistics: ErrorStatistics) -> tuple[InputNoise, Trace]:
    """The inputs' noise with that of the coefficients, and the linearisation, of what has noise alone."""
    variance, memory = flown.part.noise.variance.copy(), flown.part.noise.memory.copy()
    offsets = list(flown.offsets)
    variance[offsets] = np.square(statistics.spread)
    memory[offsets] = np.exp(-flights.intervals[n] / statistics.memory)
    for place, spread, remembered in _air(flights, n, flown, statistics):
        variance[place], memory[place] = spread, remembered
    return noisy_inputs_alone(InputNoise(variance, memory), flown.part.trace)


def _air(
    flights: FlightsInError, n: int, flown: FlownError, statistics: ErrorStatistics
) -> list[tuple[int, float, float]]:
    """Place, variance and memory from sample to sample of each velocity of the air that moves."""
    if statistics.gust is None:
        return []
    effect = statistics.gust.effect
    assert isinstance(effect, NoiseEffect)
    numbers = effect.noise(statistics.gust.values, flights.intervals[n], flights.airspeeds[n])
    places = dict(zip(air_columns(flights.axes), flown.air, strict=True))
    rows = zip(effect.columns, *numbers, strict=True)
    return [(places[column], spread, remembered) for column, spread, remembered in rows]
