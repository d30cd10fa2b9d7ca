"""Resampling of unevenly sampled records: anti-alias low-pass with its delay taken out, interpolation within limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ResamplingSettings:
    """How samples are brought to other instants.

    Attributes
    ----------
    passed : float
        Share of the wanted rate up to which nothing is changed; the filter's edge. Short periods and Dutch rolls lie
        below a tenth of any rate that is of use for them.
    stopped : float
        Share of the wanted rate from which nothing passes: its Nyquist frequency, by the sampling theorem.
    attenuation : float
        dB of the stop band, and by Kaiser's formula of the ripple in the pass band: 60 dB is 0.1 %.
    same_rate : float
        Source rate over wanted rate below which no low-pass is needed: what would alias lies in so narrow a band.
    finest_step : float
        Median steps; samples closer than this are averaged before a curve is laid through them, as noise between two
        near-coincident samples would become any slope.
    end_fit : float
        Wanted intervals over which a parabola gives the value that a record is turned about at its ends. Of sines at
        random phases in the half filter's length next to an end, root-mean-square: 40 Hz onto 50 Hz leaves 9 % of
        itself (24 % about the last sample itself), 3 Hz is changed by 0.7 %, 1 Hz by less than 0.1 %.
    """

    passed: float = 0.3
    stopped: float = 0.5
    attenuation: float = 60.0
    same_rate: float = 1.25
    finest_step: float = 0.25
    end_fit: float = 5.0


DEFAULTS = ResamplingSettings()


def median_step(time: FloatArray) -> float:
    """Median of the steps that are no repetition, s; NaN of fewer than two samples.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Stamps, not decreasing, s.
    """
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else float("nan")


def filter_delay(interval: float, settings: ResamplingSettings = DEFAULTS) -> float:
    """Half the length of the low-pass filter's impulse response, s: its delay, which `low_pass_to` takes out.

    Parameters
    ----------
    interval : float
        Wanted sampling interval, s.
    settings : ResamplingSettings
        Its band edges.

    Notes
    -----
    Kaiser's length for a transition band df and attenuation A: (A - 7.95) / (14.36 df), A. V. Oppenheim and
    R. W. Schafer, Discrete-Time Signal Processing, 3rd ed., eq. (7.76).
    """
    band = (settings.stopped - settings.passed) / interval
    return 0.5 * (settings.attenuation - 7.95) / (14.36 * band)


def low_pass_to(
    time: FloatArray, values: FloatArray, wanted: FloatArray, interval: float, settings: ResamplingSettings = DEFAULTS
) -> FloatArray:
    """The values at other, fewer instants, without what would alias there; shape (K,).

    Parameters
    ----------
    time : ndarray, shape (N,)
        Stamps, strictly increasing, s; any jitter.
    values : ndarray, shape (N,)
        Finite samples.
    wanted : ndarray, shape (K,)
        Instants within the record, s.
    interval : float
        Their median distance, s.
    settings : ResamplingSettings
        Band edges and attenuation.

    Notes
    -----
    A cubic spline through the samples is read at half the source's step, so that jitter is no noise; a Kaiser-windowed
    sinc, symmetric and therefore late by half its length only, is applied there and the delay taken out. The record is
    continued beyond its ends by turning it about its end values, which a parabola gives; nearer to an end than half
    the filter's length less is taken out, as no filter without delay can do both there.
    """
    from scipy.interpolate import CubicSpline
    from scipy.signal import oaconvolve

    time, values = _apart(time, values, settings.finest_step * median_step(time))
    count = int(np.ceil((time[-1] - time[0]) / (0.5 * median_step(time)))) + 1
    grid, step = np.linspace(time[0], time[-1], count, retstep=True)
    even = CubicSpline(time, values)(grid)
    half = int(np.ceil(filter_delay(interval, settings) / float(step)))
    cut_off = 0.5 * (settings.passed + settings.stopped) / interval
    lags = step * np.arange(-half, half + 1)
    kernel = np.sinc(2.0 * cut_off * lags) * np.kaiser(2 * half + 1, _kaiser_beta(settings.attenuation))
    fitted = max(3, round(settings.end_fit * interval / float(step)))
    smooth = oaconvolve(_continued(even, half, fitted), kernel / kernel.sum(), mode="valid")
    return np.asarray(CubicSpline(grid, smooth)(wanted), dtype=np.float64)


def _kaiser_beta(attenuation: float) -> float:
    """Shape of the window for an attenuation above 50 dB (Oppenheim and Schafer, eq. 7.75)."""
    return 0.1102 * (attenuation - 8.7)


def _apart(time: FloatArray, values: FloatArray, least: float) -> tuple[FloatArray, FloatArray]:
    """Samples closer than `least` s to the first of their group, averaged."""
    steps = np.diff(time)
    if not np.any(steps < least):
        return time, values
    group = np.concatenate([[0], np.cumsum(steps >= least)])
    count = np.bincount(group)
    return np.bincount(group, time) / count, np.bincount(group, values) / count


def _continued(values: FloatArray, reach: int, fitted: int) -> FloatArray:
    """The values with `reach` more on each side, turned about the end values; flat where the record is too short."""
    reach_held = min(reach, values.size - 1)
    left = 2.0 * _end_value(values[:fitted]) - values[reach_held:0:-1]
    right = 2.0 * _end_value(values[::-1][:fitted]) - values[-2 : -reach_held - 2 : -1]
    short = reach - reach_held
    return np.concatenate([np.full(short, left[0]), left, values, right, np.full(short, right[-1])])


def _end_value(values: FloatArray) -> float:
    """The first value by a parabola through all of them, the nearest weighted most."""
    if values.size < 4:
        return float(values[0])
    away = np.arange(values.size) / values.size
    return float(
        np.polynomial.polynomial.polyfit(away, values, 2, w=np.sqrt(np.kaiser(2 * away.size, 4.0)[away.size :]))[0]
    )


def interpolate_to(time: FloatArray, values: FloatArray, wanted: FloatArray, reach: float) -> FloatArray:
    """The values between samples by straight lines; NaN where the next sample is farther than `reach` s; shape (K,).

    Parameters
    ----------
    time : ndarray, shape (N,)
        Stamps, strictly increasing, s.
    values : ndarray, shape (N,)
        Finite samples.
    wanted : ndarray, shape (K,)
        Instants, s.
    reach : float
        Longest step between samples that is crossed, s.
    """
    right = np.searchsorted(time, wanted, side="left")
    inside = np.clip(right, 1, time.size - 1)
    exact = (right < time.size) & (time[np.minimum(right, time.size - 1)] == wanted)
    crossed = (wanted >= time[0]) & (wanted <= time[-1]) & (time[inside] - time[inside - 1] <= reach)
    return np.where(crossed | exact, np.interp(wanted, time, values), np.nan)


def hold_to(time: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    """The last value at or before each instant; NaN before the first; shape (K,).

    Parameters
    ----------
    time : ndarray, shape (N,)
        Stamps, not decreasing, s.
    values : ndarray, shape (N,)
        Samples of a switch, a mode, a counter.
    wanted : ndarray, shape (K,)
        Instants, s.
    """
    before = np.searchsorted(time, wanted, side="right") - 1
    return np.where(before >= 0, values[np.maximum(before, 0)], np.nan)


def nearest_to_samples(time: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    """A slow channel at the one instant nearest each sample, by straight lines, and NaN between; shape (K,).

    Parameters
    ----------
    time : ndarray, shape (N,)
        Stamps, strictly increasing, s.
    values : ndarray, shape (N,)
        Finite samples.
    wanted : ndarray, shape (K,)
        Instants, denser than the samples, increasing, s.

    Notes
    -----
    So many values stay as were measured: what lies between two samples of a slow sensor is no measurement.
    """
    right = np.clip(np.searchsorted(wanted, time), 1, wanted.size - 1)
    nearest = right - (time - wanted[right - 1] < wanted[right] - time)
    keep = np.unique(nearest[(time >= wanted[0]) & (time <= wanted[-1])])
    found = np.full(wanted.size, np.nan)
    inside = keep[(wanted[keep] >= time[0]) & (wanted[keep] <= time[-1])]
    found[inside] = np.interp(wanted[inside], time, values)
    return found


def without_gaps(time: FloatArray, values: FloatArray) -> FloatArray:
    """Samples (N,) with missing ones on the line between their neighbours in time, level at the ends.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Stamps, increasing, s.
    values : ndarray, shape (N,)
        NaN where missing; one sample at least is there.
    """
    present = np.isfinite(values)
    return np.interp(time, time[present], values[present])


def across_gaps(values: FloatArray) -> FloatArray:
    """Columns (N, K) with missing samples on the line between their neighbours, level at the ends; zero where empty."""
    filled = np.zeros(values.shape)
    place = np.arange(values.shape[0])
    for i, column in enumerate(values.T):
        present = np.isfinite(column)
        if present.any():
            filled[:, i] = np.interp(place, place[present], column[present])
    return filled
