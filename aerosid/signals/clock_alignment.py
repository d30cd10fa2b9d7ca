"""Offset and drift between two clocks by least squares on a signal that both recorded, with standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.signals.resampling import low_pass_to, median_step

FloatArray = NDArray[np.float64]

WORST_CONDITION = 1e7
"""Numerical: condition number of scaled columns from which rounding decides what they determine."""


@dataclass(frozen=True)
class AlignmentSettings:
    """How two records of one signal are laid over each other.

    Attributes
    ----------
    largest_offset : float
        s; offsets up to this are tried.
    least_correlation : float
        Of the records laid over each other; below, they do not show the same thing.
    least_motion : float
        Standard deviation where the records overlap over that of the whole record; below, the signal is still there.
    rounds : int
        At most so many Gauss-Newton steps; they end far earlier.
    """

    largest_offset: float = 30.0
    least_correlation: float = 0.5
    least_motion: float = 1e-3
    rounds: int = 30


@dataclass(frozen=True)
class ClockFit:
    """How one clock runs against another: t_other = t + offset + drift * (t - at).

    Attributes
    ----------
    offset, offset_std : float
        What the other clock shows more at `at`, s, and its standard error.
    drift, drift_std : float
        What it gains, s/s, and its standard error.
    at : float
        Middle of what both hold, s of the first clock; offset and drift are least correlated there.
    gain : float
        Of the other record over the first.
    correlation : float
        Between the two, laid over each other.
    """

    offset: float
    offset_std: float
    drift: float
    drift_std: float
    at: float
    gain: float
    correlation: float

    def other(self, time: FloatArray) -> FloatArray:
        """What the other clock shows at `time` of the first, s; shape (N,)."""
        return time + self.offset + self.drift * (time - self.at)

    def first(self, other: FloatArray) -> FloatArray:
        """What the first clock shows where the other shows `other`, s; shape (N,)."""
        return self.at + (other - self.at - self.offset) / (1.0 + self.drift)


def fit_clocks(
    time: FloatArray,
    values: FloatArray,
    other_time: FloatArray,
    other_values: FloatArray,
    settings: AlignmentSettings | None = None,
) -> ClockFit | None:
    """Offset and drift of the other record's clock against the first's; None where the two do not agree or tell none.

    Parameters
    ----------
    time, values : ndarray, shape (N,)
        One record of the signal, strictly increasing stamps, s; finite.
    other_time, other_values : ndarray, shape (M,)
        Another, on its own clock, of any gain and zero.
    settings : AlignmentSettings, optional
        What is tried.

    Notes
    -----
    Both are low-passed to the slower one's band. The largest cross-correlation starts Gauss-Newton on
    y(s) - g x(t(s)) - c over offset, drift, g and c. The slope of y is the instrument for that of x: the noise in a
    slope would otherwise count as signal and make deviations too small. What is left over is coloured, so the
    covariance is the sandwich of W. K. Newey and K. D. West (Econometrica 55, 1987, pp. 703-708, eq. 5) with the lag of
    their 1994 rule of thumb, widened to where the residual's correlation dies out.
    """
    from scipy.interpolate import CubicSpline

    settings = settings or AlignmentSettings()
    step = max(median_step(time), median_step(other_time))
    low, high = (
        max(time[0], other_time[0] - settings.largest_offset),
        min(time[-1], other_time[-1] + settings.largest_offset),
    )
    if not high - low > 20.0 * step or not min(np.ptp(values), np.ptp(other_values)) > 0.0:
        return None
    first = CubicSpline(*_even(time, values, step))
    grid, target = _even(other_time, other_values, step)
    second = CubicSpline(grid, target)
    offset = _coarse_offset(time, values, grid, target, step, settings.largest_offset)
    at = 0.5 * (max(time[0], grid[0] - offset) + min(time[-1], grid[-1] - offset))
    drift = 0.0
    for _ in range(settings.rounds):
        mine = at + (grid - at - offset) / (1.0 + drift)
        inside = (mine >= time[0]) & (mine <= time[-1])
        if np.count_nonzero(inside) < 20:
            return None
        x, slope = first(mine[inside]), first(mine[inside], 1)
        parts = (np.std(x) / np.std(values), np.std(target[inside]) / np.std(target))
        if min(parts) < settings.least_motion:
            return None  # a signal that is still agrees with any other
        gain, bias = np.polynomial.polynomial.polyfit(x, target[inside], 1)[::-1]
        residual = target[inside] - gain * x - bias
        from_middle = mine[inside] - at
        design = np.column_stack([-gain * slope, -gain * slope * from_middle, x, np.ones_like(x)])
        turned = second(grid[inside], 1)
        instruments = np.column_stack([-turned, -turned * from_middle, x, np.ones_like(x)])
        if not _is_determined(design):
            return None  # as of a ramp, which is itself at any offset
        change = np.linalg.solve(instruments.T @ design, instruments.T @ residual)
        offset, drift = offset + change[0], drift + change[1]
        if abs(change[0]) < 1e-9 and abs(change[1]) < 1e-12:
            break
    correlation = float(np.corrcoef(x, target[inside])[0, 1])
    if abs(correlation) < settings.least_correlation:
        return None
    offset_std, drift_std = np.sqrt(np.diag(_sandwich(design, instruments, residual))[:2])
    return ClockFit(
        float(offset), float(offset_std), float(drift), float(drift_std), float(at), float(gain), correlation
    )


def _is_determined(design: FloatArray) -> bool:
    """Whether a least-squares problem (N, K) determines all of its unknowns, whatever their units."""
    size = np.linalg.norm(design, axis=0)
    return bool(np.all(size > 0.0)) and np.linalg.cond(design / size) < WORST_CONDITION


def _even(time: FloatArray, values: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """The record every `step` s, low-passed where it holds more."""
    grid = time[0] + step * np.arange(int((time[-1] - time[0]) / step) + 1)
    return grid, low_pass_to(time, values, grid, step)


def _coarse_offset(
    time: FloatArray, values: FloatArray, grid: FloatArray, target: FloatArray, step: float, largest: float
) -> float:
    """The lag, a multiple of the step, of the largest correlation, s; each lag weighed by what overlaps."""
    from scipy.signal import correlate, correlation_lags

    start, stop = min(time[0], grid[0]), max(time[-1], grid[-1])
    common = start + step * np.arange(int((stop - start) / step) + 1)
    mine = np.interp(common, time, values - values.mean(), left=0.0, right=0.0)
    theirs = np.interp(common, grid, target - target.mean(), left=0.0, right=0.0)
    score = np.abs(correlate(theirs, mine, method="fft"))
    lags = correlation_lags(theirs.size, mine.size) * step
    allowed = np.abs(lags) <= largest
    return float(lags[allowed][np.argmax(score[allowed])])


def _sandwich(design: FloatArray, instruments: FloatArray, residual: FloatArray) -> FloatArray:
    """Covariance of instrumental variables under coloured, unevenly large errors, shape (P, P)."""
    bread = np.linalg.inv(instruments.T @ design)
    scores = instruments * residual[:, None]
    lag = max(int(4.0 * (residual.size / 100.0) ** (2.0 / 9.0)), _memory(residual))
    middle = scores.T @ scores
    for shift in range(1, lag + 1):
        product = scores[shift:].T @ scores[:-shift]
        middle += (1.0 - shift / (lag + 1.0)) * (product + product.T)
    freedom = residual.size / max(residual.size - design.shape[1], 1)
    return np.asarray(freedom * bread @ middle @ bread.T)


def _memory(residual: FloatArray) -> int:
    """Twice the first lag at which the residual's correlation is no longer larger than by chance."""
    count = residual.size
    centred = residual - residual.mean()
    power = np.abs(np.fft.rfft(centred, 2 * count)) ** 2
    correlation = np.fft.irfft(power)[: count // 4]
    below = np.flatnonzero(correlation < 2.0 / np.sqrt(count) * correlation[0])
    return 2 * int(below[0]) if below.size else count // 4
