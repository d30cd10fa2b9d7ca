"""Low-pass and decimation to the band in which the motion exceeds its noise, identical for all compared signals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.signals.decimation import decimated, windowed_sinc
from aerosid.signals.moving_window import moving_mean
from aerosid.signals.recursive_filter import turned_at_ends

Array = NDArray[np.float64]

HALF_LENGTH = 5
"""Numerical: half the filter's length in samples after decimation; the transition is then a fifth of the band."""

CUT_AT_ENDS = 2
"""Numerical: samples after decimation left out at either end, where the filter relies on the record's reflection."""

FLOOR_SHARE = 0.2
"""Numerical: fraction of all frequencies, 1, the highest, whose median power is the noise floor."""


@dataclass(frozen=True)
class Band:
    """Every `step`-th sample of a symmetric low-pass with the given `weights`."""

    step: int
    weights: Array

    def rows(self, samples: int) -> NDArray[np.int64]:
        """Indices of the retained samples of a record of given length."""
        first = CUT_AT_ENDS * self.step if self.step > 1 else 0
        return np.arange(first, samples - first, self.step, dtype=np.int64)

    def __call__(self, values: Array) -> Array:
        """The series (N,) or (N, K) in the band, decimated.

        A linear operation: linear relations between columns are preserved. Ends are reflected through their values.
        """
        if self.step == 1:
            return values
        half = self.weights.size // 2
        whole = turned_at_ends(values, values[0], values[-1], half, half)
        first = CUT_AT_ENDS * self.step
        rows = self.rows(values.shape[0])
        columns = np.ascontiguousarray(whole[first:], dtype=np.float64).reshape(whole.shape[0] - first, -1)
        return decimated(self.weights, columns, self.step)[: rows.size].reshape(rows.size, *values.shape[1:])


def band_end(
    rates: Sequence[Array], interval: float, ratio: float, depth: float, limits: tuple[float, float, float]
) -> float:
    """The frequency, Hz, up to which the pitch rate's power exceeds its noise floor.

    Parameters
    ----------
    rates : sequence of ndarray, shape (N,)
        Pitch rate of each record, at a constant `interval`, s.
    ratio : float
        Power over the floor that counts as above.
    depth : float
        Fraction of the maximum power below which a frequency contains no motion: a record smoothed after the flight has
        no noise floor, and beyond its smoothing only rounding.
    limits : (float, float, float)
        Lowest and highest upper edge of the band, Hz, and its highest fraction of the sampling frequency.
    """
    lowest, highest, share = limits
    highest = min(highest, share / interval)
    ends = [_end(rate, interval, ratio, depth) for rate in rates]
    return float(np.clip(np.median(ends), min(lowest, highest), highest))


def band_up_to(end: float, interval: float) -> Band:
    """The low-pass and decimation to a frequency, Hz, of samples at an interval, s."""
    step = max(1, int(0.5 / (interval * end) + 1e-9))
    if step == 1:
        return Band(1, np.ones(1))
    return Band(step, windowed_sinc(2 * HALF_LENGTH * step + 1, 0.9 / step))


def _end(rate: Array, interval: float, ratio: float, depth: float) -> float:
    """Frequency, Hz, from which on the smoothed periodogram stays near its floor."""
    line = np.linspace(rate[0], rate[-1], rate.size)
    power = np.abs(np.fft.rfft((rate - line) * np.hanning(rate.size))) ** 2
    smooth = moving_mean(power, max(3, power.size // 40), "edge")
    frequency = np.fft.rfftfreq(rate.size, interval)
    floor = float(np.median(smooth[-max(3, int(FLOOR_SHARE * smooth.size)) :]))
    above = np.flatnonzero(smooth > max(ratio * floor, depth * float(smooth.max())))
    return float(frequency[above[-1]]) if above.size else 0.0
