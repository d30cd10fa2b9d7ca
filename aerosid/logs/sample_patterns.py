"""Detection of spikes, and of stuck, quantised and saturated samples of one channel."""

from __future__ import annotations

import numpy as np

from aerosid.logs.flight_log import FloatArray
from aerosid.logs.settings import QUALITY
from aerosid.notation import plain


def spikes(values: FloatArray, noise: float) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Indices of single samples that deviate from both neighbours to the same side.

    Parameters
    ----------
    values : ndarray, shape (N,)
        One channel; NaN where a sample is missing.
    noise : float
        Standard deviation of its noise.

    Notes
    -----
    The smaller distance to the two neighbours is used. It must exceed the noise, the median of the same distance of
    the eight surrounding samples, and a tenth of the channel's range, so that a peak of fast motion is no spike.
    """
    if values.size < 10 or not np.isfinite(values).any():
        return np.empty(0, dtype=np.intp)
    before, after = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    with np.errstate(invalid="ignore"):
        height = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    low, high = np.nanpercentile(values, [0.5, 99.5])
    candidates = np.flatnonzero(height > max(QUALITY.spike * noise, QUALITY.spike_share * float(high - low), 1e-12)) + 1
    kept = []
    for k in candidates:
        around = np.concatenate([values[max(k - 5, 0) : k], values[k + 1 : k + 6]])
        local = np.abs(np.diff(around))
        local = local[np.isfinite(local)]
        if local.size and height[k - 1] > QUALITY.spike * float(np.median(local)):
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def spike_times(time: FloatArray, places: np.ndarray[tuple[int], np.dtype[np.intp]]) -> str:
    """Number and times of spikes in words, the first three of them."""
    times = ", ".join(plain(float(time[k]), 6) for k in places[:3])
    return f"{places.size} at {times}{' ...' if places.size > 3 else ''} s"


def _runs(values: FloatArray) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]:
    """First and last index of each run of equal values."""
    change = np.flatnonzero(np.diff(values) != 0.0)
    return np.concatenate([[0], change + 1]), np.concatenate([change, [values.size - 1]])


def longest_stand(time: FloatArray, values: FloatArray) -> float:
    """The longest time, s, during which the value does not change."""
    first, last = _runs(values)
    return float(np.max(time[last] - time[first]))


def quantum(values: FloatArray) -> float:
    """The step of which all values are multiples, or 0.0 where none is discernible.

    Recorded numbers are rounded when printed, so multiples are only required to within a few hundredths of the step.
    """
    levels = np.unique(values)
    if levels.size < 3 or levels.size > values.size / 3:
        return 0.0
    distance = np.diff(levels)
    # Values that differ in their last printed digit count as one level.
    distance = distance[distance > 1e-3 * float(np.median(distance))]
    step = float(distance.min())
    multiple = distance / step
    return step if bool(np.all(np.abs(multiple - np.round(multiple)) < 0.05 + 0.01 * multiple)) else 0.0


def cut_at(values: FloatArray) -> float | None:
    """The extreme at which a channel rests repeatedly, in contrast to its other values, or None."""
    present = values[np.isfinite(values)]
    first, last = _runs(present)
    length = last - first + 1
    for extreme in (float(present.min()), float(present.max())):
        here = present[first] == extreme
        longest_here = int(length[here].max())
        longest_elsewhere = int(length[~here].max(initial=1))
        if longest_here >= QUALITY.saturated_samples and longest_here > 2 * longest_elsewhere:
            return extreme
    return None
