"""Operators on sampled signals: delay, first-order lag, rate limit and dead band."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline


def delayed(time: NDArray[np.float64], values: NDArray[np.float64], delay: float) -> NDArray[np.float64]:
    """The signal `delay` s later: value at t is that of t - delay, (N, C); before the record its first value.

    Cubic interpolation through the four samples around t - delay, so that the operator is linear in the samples.

    Parameters
    ----------
    time : (N,) s, strictly increasing.
    values : (N, C) samples.
    delay : s, of either sign; past the end the last value is held.
    """
    if time.size < 4:
        wanted = _before(time, delay)
        return np.column_stack([np.interp(wanted, time, column) for column in values.T])
    first, weights = _places_before(time, float(delay))
    return _interpolated(np.ascontiguousarray(values), first, weights)


def refined(
    time: NDArray[np.float64], values: NDArray[np.float64], parts: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Instants and samples of a signal (N,) of at least four at every part of an interval, cubic as `delayed`."""
    places = np.arange(parts * (time.size - 1) + 1) / parts
    instants = np.interp(places, np.arange(time.size), time)
    return instants, _interpolated(np.ascontiguousarray(values)[:, None], *_interpolation(time, instants))[:, 0]


def _before(time: NDArray[np.float64], delay: float) -> NDArray[np.float64]:
    """The instants less a delay, those outside the record at its ends."""
    return np.clip(time - delay, time[0], time[-1])


KEPT_DELAYS = 8
"""Numerical: delays whose interpolation is kept; a search comes back to the same few."""

LONGEST_KEPT = 20_000
"""Numerical: samples of a record up to which it is kept, 40 bytes for each."""

_kept: list[tuple[NDArray[np.float64], float, NDArray[np.int64], NDArray[np.float64]]] = []


def _places_before(time: NDArray[np.float64], delay: float) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """As `_interpolation`, that of the same instants and delay computed once."""
    for instants, known, first, weights in tuple(_kept):
        if instants is time and known == delay:
            return first, weights
    first, weights = _interpolation(time, _before(time, delay))
    if time.size <= LONGEST_KEPT:
        _kept.insert(0, (time, delay, first, weights))
        del _kept[KEPT_DELAYS:]
    return first, weights


@njit
def _interpolation(
    time: NDArray[np.float64], instants: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """First of the four samples around each of M instants in order, (M,), and their Lagrangian weights, (M, 4)."""
    samples, count = time.shape[0], instants.shape[0]
    places, weights = np.empty(count, dtype=np.int64), np.ones((count, 4))
    after = 0
    for k in range(count):
        wanted = instants[k]
        while after < samples and time[after] <= wanted:
            after += 1
        first = min(max(after - 2, 0), samples - 4)
        places[k] = first
        for i in range(4):
            for j in range(4):
                if j != i:
                    weights[k, i] *= (wanted - time[first + j]) / (time[first + i] - time[first + j])
    return places, weights


@njit
def _interpolated(
    values: NDArray[np.float64], first: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Sums of four samples from `first` (N,) on with `weights` (N, 4), (N, C)."""
    result = np.empty((first.shape[0], values.shape[1]))
    for k in range(first.shape[0]):
        n = first[k]
        for c in range(values.shape[1]):
            earlier = weights[k, 0] * values[n, c] + weights[k, 1] * values[n + 1, c]
            result[k, c] = earlier + weights[k, 2] * values[n + 2, c] + weights[k, 3] * values[n + 3, c]
    return result


def advanced(time: NDArray[np.float64], values: NDArray[np.float64], lead: float) -> NDArray[np.float64]:
    """The signal `lead` s earlier, (N,): value at t is that of t + lead; NaN where the record does not reach."""
    moved = delayed(time, values[:, None], -lead)[:, 0]
    moved[(time + lead < time[0]) | (time + lead > time[-1])] = np.nan
    return moved


def delayed_linear(time: NDArray[np.float64], values: NDArray[np.float64], delay: float) -> NDArray[np.float64]:
    """As `delayed`, (N,), with linear interpolation: for inputs, which are linear between samples and have corners."""
    return np.asarray(np.interp(time - delay, time, values))


@njit_inline
def lag_weights(interval: float, constant: float) -> tuple[float, float, float]:
    """Weights of the last result, the last value and this one in a first-order lag, exact for values linear between."""
    if constant <= 0.0:
        return 0.0, 0.0, 1.0
    decay = np.exp(-interval / constant)
    ramp = constant * (1.0 - decay) / interval
    return decay, ramp - decay, 1.0 - ramp


@njit_inline
def lag_slopes(interval: float, constant: float) -> tuple[float, float, float]:
    """How `lag_weights` move with the time constant, 1/s; at zero the limit from above."""
    if constant <= 1e-3 * interval:
        return 0.0, 1.0 / interval, -1.0 / interval
    decay = np.exp(-interval / constant)
    decaying = decay * interval / constant**2
    ramping = (1.0 - decay - constant * decaying) / interval
    return decaying, ramping - decaying, -ramping


@njit
def lagged(time: NDArray[np.float64], values: NDArray[np.float64], constant: float) -> NDArray[np.float64]:
    """The signal through a first-order lag, y' = (x - y)/constant, (N, C), exact for x linear between samples.

    It starts in the steady state of the first sample. A constant of zero or below gives the signal itself.
    """
    result = values.copy()
    if constant <= 0.0:
        return result
    for k in range(1, time.shape[0]):
        decay, before, here = lag_weights(time[k] - time[k - 1], constant)
        for c in range(values.shape[1]):
            result[k, c] = decay * result[k - 1, c] + before * values[k - 1, c] + here * values[k, c]
    return result


@njit
def rate_limited(time: NDArray[np.float64], values: NDArray[np.float64], limit: float) -> NDArray[np.float64]:
    """The signal followed by a surface that moves no faster than `limit` per second, (N,)."""
    result = values.copy()
    for k in range(1, time.shape[0]):
        reach = limit * (time[k] - time[k - 1])
        step = values[k] - result[k - 1]
        result[k] = result[k - 1] + min(max(step, -reach), reach)
    return result


@njit
def _median_of_five(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The median of each sample and two on either side, (N,); the ends are held.

    Both pairs without the middle are sorted; the least of the lower and the greatest of the upper ends are not it.
    """
    smooth, last = np.empty(values.shape[0]), values.shape[0] - 1
    for k in range(values.shape[0]):
        a, b, c = values[max(k - 2, 0)], values[max(k - 1, 0)], values[k]
        d, e = values[min(k + 1, last)], values[min(k + 2, last)]
        low, high = max(min(a, b), min(d, e)), min(max(a, b), max(d, e))
        smooth[k] = max(min(low, high), min(max(low, high), c))
    return smooth


def deadbanded(values: NDArray[np.float64], width: float, at_rest: float = 0.0) -> NDArray[np.float64]:
    """The signal without its excursions of up to `width` either side of its neutral position, (N,).

    The neutral position is the mean of the samples before the signal leaves its first value by more than `at_rest`: a
    single sample would shift the surface by its noise whenever the control is within the band, which is a false step of
    trim. The band acts on a five-sample median, and the rest of the signal passes: noise must not be cut by the band,
    or a band as wide as the noise would look like an improvement of every record. A mean would round the edges of
    steps.
    """
    smooth = _median_of_five(np.ascontiguousarray(values))
    moved = np.abs(smooth - smooth[0]) > at_rest
    neutral = values[: int(np.argmax(moved)) if moved.any() else values.size].mean()
    return np.asarray(values - np.clip(smooth - neutral, -width, width))
