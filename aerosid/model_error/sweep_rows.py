"""Whitened rows of flights with d(t): residuals and sensitivities through one Kalman filter, and d(t) smoothed back.

What the filter of the model error does to the residual it does to the columns of the terms, sensors and controls that
are estimated, and to those that are only asked about.
"""

from __future__ import annotations

from collections.abc import Sequence

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
    traced: Sequence[FlownError],
    entries: Sequence[Entry] = (),
) -> Rows:
    """The innovations and every column through the same filter."""
    targets, knowns, others, lengths, channels = [], [], [], [], []
    log_sum = 0.0
    parts = columns_of(swept, traced, len(entries))
    for n, (flown, columns) in enumerate(zip(traced, parts, strict=True)):
        target, known, asked = columns
        width = known.shape[2]
        block = np.ascontiguousarray(np.concatenate([target[:, :, None], known, asked], axis=2))
        log_sum += whiten(flights, n, flown, block, swept.statistics)
        for i in np.flatnonzero(flown.part.held.any(axis=0)):
            held = flown.part.held[:, i]
            lengths.append(int(held.sum()))
            channels.append((n, int(i)))
            targets.append(block[held, i, 0])
            knowns.append(block[held, i, 1 : 1 + width])
            others.append(block[held, i, 1 + width :])
    return Rows(
        np.concatenate(targets), np.concatenate(knowns), np.concatenate(others), tuple(lengths), log_sum,
        tuple(channels),
    )  # fmt: skip


def columns_of(swept: SweptModel, traced: Sequence[FlownError], asked: int = 0) -> list[tuple[Array, Array, Array]]:
    """Of each flight (N, 8, .): the residual as if no d had acted, known columns in joint places, asked columns."""
    logs, free, slopes = len(traced), len(swept.free), swept.slopes
    found = []
    for n, flown in enumerate(traced):
        block, held = flown.part.block, flown.part.held
        first = 1 + free + asked + STATE_COUNT
        acted, forces = first + slopes, len(flown.offsets) - 1
        target = block[:, :, 0] + block[:, :, acted : acted + forces].sum(axis=2)
        known = np.zeros((*target.shape, free + slopes + STATE_COUNT * logs))
        known[:, :, :free] = block[:, :, 1 : 1 + free]
        known[:, :, free : free + slopes] = block[:, :, first:acted]
        place = free + slopes + STATE_COUNT * n
        known[:, :, place : place + STATE_COUNT] = block[:, :, first - STATE_COUNT : first]
        others = np.concatenate([block[:, :, 1 + free : 1 + free + asked], block[:, :, acted + forces :]], axis=2)
        found.append((np.where(held, target, 0.0), known, others))
    return found


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
    held = np.ascontiguousarray(part.held)
    smooth_inputs(held, residual, trace, statistics.variance, noise, part.sensors, start, errors, variances)
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
