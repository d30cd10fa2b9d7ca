"""Steady-state detection: trim points, turns and steady turns."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from aerosid.manoeuvres.found import Stretch
from aerosid.manoeuvres.record import BoolArray, FlightRecord, FloatArray, runs, travel
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["steady_turns", "trim_points", "turns"]


def trim_points(record: FlightRecord, free: BoolArray, settings: FinderSettings) -> list[Stretch]:
    """The steadiest part of every stretch of steady flight.

    Parameters
    ----------
    record : FlightRecord
    free : ndarray of bool, shape (N,)
        Samples that no other manoeuvre holds.

    Notes
    -----
    A window is steady where every quantity that a trim holds stays within its limit. Of a stretch of such windows that
    one is taken, at most a phugoid period long, over which the sum of the squares of these quantities over their
    limits is least.
    """
    shortest = max(2, round(settings.trim_least / record.interval))
    if record.time.size < shortest:
        return []
    cost = _unsteadiness(record, shortest, settings)
    whole = np.flatnonzero(_all_within(free & record.airborne, shortest))
    steady = np.zeros(record.time.size, dtype=np.bool_)
    steady[whole] = cost[whole] <= 1.0
    candidates: list[tuple[float, Stretch]] = []
    for first, last in runs(steady):
        candidates += _steadiest(record, cost, shortest, (first, last), settings)
    taken = np.zeros(record.time.size, dtype=np.bool_)
    found = []
    # Stretches that are steady each may overlap by a window: the longer and steadier of them stays.
    for _, stretch in sorted(candidates, key=lambda entry: entry[0]):
        if not taken[stretch.first : stretch.last + 1].any():
            taken[stretch.first : stretch.last + 1] = True
            found.append(stretch)
    return sorted(found, key=lambda stretch: stretch.first)


def _steadiest(
    record: FlightRecord, cost: FloatArray, shortest: int, centres: tuple[int, int], settings: FinderSettings
) -> list[tuple[float, Stretch]]:
    """The steadiest windows of at most a phugoid period between two window centres, each with its rank."""
    half = shortest // 2
    begin, end = centres[0] - half, centres[1] + (shortest - 1 - half)
    # The ends of a stretch hold the arrival at the condition and the departure from it.
    middle = round(settings.trim_middle * (end - begin + 1))
    length = max(shortest, min(middle, record.samples(settings.trim_length, centres[0])))
    detail = {"steady_from": float(record.time[begin]), "steady_to": float(record.time[end])}
    # The cost of a longer window is that of the short ones in it.
    starts = length - shortest + 1
    sums = np.concatenate([[0.0], np.cumsum(cost[centres[0] : centres[1] + 1])])
    means = (sums[starts:] - sums[:-starts]) / starts
    found = []
    for _ in range((end - begin + 1) // length):
        best = int(np.argmin(means))
        if not np.isfinite(means[best]):
            break
        stretch = Stretch("trim", begin + best, begin + best + length - 1, detail=detail)
        found.append((float(means[best]) / length, stretch))
        means[max(0, best - length + 1) : best + length] = np.inf
    return found


def _unsteadiness(record: FlightRecord, window: int, settings: FinderSettings) -> FloatArray:
    """The largest of the quantities that a trim holds over its limit, in windows centred at each sample, (N,)."""
    speed = record.averaged(record["V"], 0.1)
    mean = np.maximum(uniform_filter1d(speed, window, mode="nearest"), 1e-3)
    acceleration = np.gradient(mean, record.interval) / 9.80665
    pitch = np.sqrt(uniform_filter1d(record.averaged(record.pitch, 0.05) ** 2, window, mode="nearest"))
    parts = [
        travel(speed, window) / (settings.trim_speed * mean),
        np.abs(acceleration) / settings.trim_acceleration,
        pitch / settings.trim_pitch,
        maximum_filter1d(np.abs(record.get("phi")), window) / settings.trim_bank,
    ]
    if "h" in record:
        climb = record.averaged(np.gradient(record.averaged(record["h"], 0.3), record.interval), 0.5)
        parts.append(travel(climb / np.maximum(mean, 1.0), window) / settings.trim_climb)
    elevator = record.surfaces.get("delta_e")
    if elevator is not None:
        limit = max(settings.trim_travel * elevator.largest, elevator.rest)
        parts.append(travel(elevator.deflection, window) / max(limit, 1e-9))
    worst: FloatArray = np.max(parts, axis=0)
    # The mean of the squares tells windows apart that are all within the limits.
    even: FloatArray = np.sqrt(np.mean(np.square(parts), axis=0))
    return np.where(worst <= 1.0, even, np.maximum(worst, 1.0 + 1e-9))


def _all_within(mask: BoolArray, window: int) -> BoolArray:
    """Where the window centred at a sample lies within `mask` and the record, (N,)."""
    inside = minimum_filter1d(mask.astype(np.int8), window, mode="constant", cval=0) > 0
    half = window // 2
    inside[:half] = False
    inside[inside.size - (window - 1 - half) :] = False
    return inside


def turns(record: FlightRecord, free: BoolArray, settings: FinderSettings) -> list[Stretch]:
    """Stretches of bank to one side."""
    if "phi" not in record:
        return []
    bank = record.averaged(record["phi"], 0.1)
    found = []
    for side in (1.0, -1.0):
        for first, last in runs((side * bank > settings.turn_bank) & record.airborne & free):
            if last - first + 1 < record.samples(settings.turn_least, first):
                continue
            peak = float(np.max(side * bank[first : last + 1]))
            begin, end = _down_to(side * bank, first, last, 0.15 * settings.turn_bank)
            begin, end = _keep_free(free, begin, first, last, end)
            found.append(Stretch("turn", begin, end, detail={"bank": side * peak}))
    return sorted(found, key=lambda stretch: stretch.first)


def steady_turns(record: FlightRecord, free: BoolArray, settings: FinderSettings) -> list[Stretch]:
    """Longest stretches of constant bank within a turn."""
    if "phi" not in record:
        return []
    bank = record.averaged(record["phi"], 0.05)
    found = []
    for first, last in runs((np.abs(bank) > settings.turn_bank) & record.airborne & free):
        begin, end = _longest_level(bank[first : last + 1], settings.steady_bank)
        if end - begin + 1 >= record.samples(settings.steady_least, first):
            middle = float(np.mean(bank[first + begin : first + end + 1]))
            found.append(Stretch("steady_turn", first + begin, first + end, detail={"bank": middle}))
    return found


def _longest_level(values: FloatArray, span: float) -> tuple[int, int]:
    """First and last index of the longest window whose range is at most `span`: two pointers, monotone queues."""
    from collections import deque

    high: deque[int] = deque()
    low: deque[int] = deque()
    best, start = (0, 0), 0
    for k, value in enumerate(values):
        while high and values[high[-1]] <= value:
            high.pop()
        while low and values[low[-1]] >= value:
            low.pop()
        high.append(k)
        low.append(k)
        while values[high[0]] - values[low[0]] > span:
            start += 1
            if high[0] < start:
                high.popleft()
            if low[0] < start:
                low.popleft()
        if k - start > best[1] - best[0]:
            best = start, k
    return best


def _down_to(values: FloatArray, first: int, last: int, level: float) -> tuple[int, int]:
    """The span widened to where the values come down to the level, or turn."""
    while first > 0 and values[first - 1] > level and values[first - 1] <= values[first] + 1e-9:
        first -= 1
    while last < values.size - 1 and values[last + 1] > level and values[last + 1] <= values[last] + 1e-9:
        last += 1
    return first, last


def _keep_free(free: BoolArray, begin: int, first: int, last: int, end: int) -> tuple[int, int]:
    """The widened span without what another manoeuvre holds."""
    taken_before = np.flatnonzero(~free[begin:first])
    taken_after = np.flatnonzero(~free[last + 1 : end + 1])
    if taken_before.size:
        begin += int(taken_before[-1]) + 1
    if taken_after.size:
        end = last + int(taken_after[0])
    return begin, end
