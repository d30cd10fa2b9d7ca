"""Low-pass prefilters, and one cut-off for all channels that meet in an equation.

One filter for all, inputs included: a linear equation between channels survives a linear operator that is applied to
each of them alike, whatever the operator takes away.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.nomenclature import is_surface
from aerosid.notation import number, plain
from aerosid.signals.recursive_filter import (
    butterworth_poles,
    butterworth_sections,
    filtered_from_rest,
    filtered_from_steady,
    turned_at_ends,
)
from aerosid.signals.settings import PREFILTER

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Butterworth:
    """A low-pass with maximally flat pass band.

    Attributes
    ----------
    order : int
        Of the filter as designed, 1 to 10; run both ways it attenuates as one of twice the order.
    cut_off_hz : float
        Half-power frequency of the filter as designed, Hz; run both ways a quarter of the power is left there.
    zero_phase : bool
        True: forward and backward, no lag. False: causal, as in a recursion that runs in flight, with lag.
    """

    order: int
    cut_off_hz: float
    zero_phase: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.order <= 10:
            raise ValueError(f"the filter's order is {self.order}, expected 1 to 10")
        if not 0.0 < self.cut_off_hz < math.inf:
            raise ValueError(f"the cut-off is {self.cut_off_hz} Hz, expected a positive number")


@dataclass(frozen=True)
class CutOff:
    """The common cut-off and how it came about.

    Attributes
    ----------
    cut_off_hz : float or None
        For all channels, Hz; None where no filtering is worth it.
    per_channel : mapping of str to float or None
        Above it each channel holds no signal worth keeping, Hz, without margin; None where it has no noise at all.
    explanations : tuple of str
        One sentence for each channel and one for the choice, for the report.
    """

    cut_off_hz: float | None
    per_channel: Mapping[str, float | None]
    explanations: tuple[str, ...]

    def butterworth(self, *, order: int = 4, zero_phase: bool = True) -> Butterworth | None:
        """The filter with this cut-off; None where no filtering is worth it."""
        return None if self.cut_off_hz is None else Butterworth(order, self.cut_off_hz, zero_phase)


def choose_cut_off(
    time: FloatArray,
    channels: Mapping[str, FloatArray],
    noise: Mapping[str, float],
    *,
    inputs: Collection[str] | None = None,
    lost_share: float = 1e-4,
) -> CutOff:
    """The one cut-off frequency above which no response channel holds signal worth its noise.

    Parameters
    ----------
    time : (N,) array
        Sample times, s.
    channels : mapping of str to (N,) array
        All channels that meet in an equation; NaN where missing.
    noise : mapping of str to float
        Standard deviation of each channel's white noise, in its unit; 0 or absent where there is none.
    inputs : collection of str, optional
        Channels that drive; those called `delta_...` by default. They are filtered too, but do not raise the cut-off:
        a step of the elevator has corners at any frequency, and what matters of them shows in the responses.
    lost_share : float
        Share of a channel's signal power that may be filtered away although it stands above the noise, dimensionless.
        The corners of a precise accelerometer reach to any frequency; a ten-thousandth of the power (1 % in
        amplitude) carries no information about slow motion, and all channels lose it alike. 0 keeps all.

    Returns
    -------
    CutOff

    Notes
    -----
    The sine coefficients b_k of a channel without the line through its ends have the noise's variance s^2 each, plus
    the signal. Keeping the first n of them costs n s^2 of noise and all signal above; an unbiased estimate of that
    error is, up to a constant, 2 n s^2 + sum_(k > n) b_k^2, and the channel's frequency is where it is least: beyond,
    the signal adds less power than the noise, or, if that is lower, where only `lost_share` of the sum of b_k^2 - s^2
    is left above. The common cut-off is 1.5 times the highest of the responses.
    The record is interpolated onto a uniform grid for this choice only; the filter itself is not.

    References
    ----------
    Klein & Morelli (2006), Aircraft System Identification: global Fourier smoothing, whose cut-off is
    drawn by eye; here it minimises Mallows' criterion.
    """
    instants = np.asarray(time, dtype=np.float64)
    driving = {name for name in channels if is_surface(name)} if inputs is None else set(inputs)
    interval = float(np.median(np.diff(instants))) if instants.size > 1 else math.nan
    per_channel: dict[str, float | None] = {}
    explanations: list[str] = []
    for name, values in channels.items():
        deviation = noise.get(name, 0.0)
        sinks = _sinking_frequency(instants, np.asarray(values, dtype=np.float64), deviation, interval, lost_share)
        per_channel[name] = sinks
        role = " (input, does not raise the cut-off)" if name in driving else ""
        explanations.append(
            f"{name}: no noise to tell the signal from{role}"
            if sinks is None
            else f"{name}: no signal worth keeping above {number(sinks)} Hz, with noise of {number(deviation)}{role}"
        )
    counting = {name: f for name, f in per_channel.items() if f is not None and name not in driving}
    if not counting:
        explanations.append("not filtered: no response channel holds noise")
        return CutOff(None, per_channel, tuple(explanations))
    leading = max(counting, key=lambda name: counting[name])
    cut_off = PREFILTER.margin * counting[leading]
    nyquist = 0.5 / interval
    # As for a brick wall: the share of the noise's deviation that passes is the root of the share of the band.
    if cut_off >= PREFILTER.worth**2 * nyquist:
        explanations.append(
            f"not filtered: {leading} holds signal up to {number(counting[leading])} Hz of {number(nyquist)} Hz that "
            "the sampling resolves, so that a filter would take away next to nothing but signal"
        )
        return CutOff(None, per_channel, tuple(explanations))
    explanations.append(
        f"one cut-off for all channels: {plain(PREFILTER.margin)} times the highest, {leading}, makes "
        f"{number(cut_off)} Hz"
    )
    return CutOff(cut_off, per_channel, tuple(explanations))


def apply(butterworth: Butterworth, time: FloatArray, values: FloatArray) -> FloatArray:
    """One channel low-passed, (N,), in its own unit.

    Parameters
    ----------
    butterworth : Butterworth
        The filter.
    time : (N,) array
        Sample times, s, strictly increasing.
    values : (N,) array
        The channel; NaN where missing. Missing samples stay missing.

    Raises
    ------
    ValueError
        Where the sampling does not resolve the cut-off.

    Notes
    -----
    Uniform sampling: second-order sections of the bilinear transform. Any other sampling: the continuous filter,
    solved mode by mode without approximation for an input that is linear in time between the samples, so that neither
    needs an even grid. A missing sample is bridged by the line between its neighbours while filtering; a gap longer
    than half a period of the cut-off splits the record.

    The causal filter starts in the steady state of its first sample. The zero-phase filter runs on beyond both ends
    over the record turned by 180 degrees about the end value of a quadratic fitted over one period of the cut-off:
    the ends carry no transient, but about the noise of one unfiltered sample.
    """
    instants = np.asarray(time, dtype=np.float64)
    samples = np.asarray(values, dtype=np.float64)
    result = np.full(samples.shape, np.nan)
    present = np.flatnonzero(np.isfinite(samples))
    if present.size == 0:
        return result
    interval = float(np.median(np.diff(instants))) if instants.size > 1 else math.inf
    if butterworth.cut_off_hz * interval >= 0.5:
        raise ValueError(
            f"a cut-off of {butterworth.cut_off_hz:g} Hz cannot be had from samples every {interval:g} s: "
            f"choose one below {0.5 / interval:g} Hz or leave the filter off"
        )
    longest = max(PREFILTER.gap_periods / butterworth.cut_off_hz, 2.5 * interval)
    breaks = np.flatnonzero(np.diff(instants[present]) > longest) + 1
    for chosen in np.split(present, breaks):
        result[chosen] = _filter_segment(butterworth, instants[chosen], samples[chosen], interval)
    return result


def noise_gain(butterworth: Butterworth, interval: float) -> float:
    """The standard deviation of white noise after the filter over that before, for samples `interval` s apart.

    Notes
    -----
    The root of the sum of the squared impulse response, away from the ends of the record. What is left is no longer
    white: its samples are correlated over about 1/(2 cut-off) s.
    """
    # Long enough for the slowest pole: it decays by sin(pi/(2 order)) * 2 pi cut-off a second.
    slowest = 2.0 * math.pi * butterworth.cut_off_hz * math.sin(0.5 * math.pi / butterworth.order)
    length = 8 + math.ceil(40.0 / (slowest * interval))
    impulse = np.zeros(length)
    impulse[0] = 1.0
    response = filtered_from_rest(_sections(butterworth, interval), impulse)
    if butterworth.zero_phase:
        # Forward and backward: the impulse response is the autocorrelation of the one-way response.
        spectrum = np.abs(scipy.fft.rfft(response, 2 * length)) ** 2
        response = scipy.fft.irfft(spectrum, 2 * length)
    return float(np.linalg.norm(response))


def _sinking_frequency(
    time: FloatArray, values: FloatArray, deviation: float, interval: float, lost_share: float
) -> float | None:
    """Where Mallows' criterion is least or only the lost share is above, Hz; None without noise or with few samples."""
    present = np.isfinite(values)
    if not deviation > 0.0 or np.count_nonzero(present) < 10:
        return None
    grid = np.arange(time[present][0], time[present][-1] + 0.5 * interval, interval)
    samples = np.interp(grid, time[present], values[present])
    samples -= np.linspace(samples[0], samples[-1], samples.size)
    power = scipy.fft.dst(samples[1:-1], type=1, norm="ortho") ** 2
    tail = np.concatenate((np.cumsum(power[::-1])[::-1], [0.0]))
    criterion = 2.0 * deviation**2 * np.arange(tail.size) + tail
    kept = max(int(np.argmin(criterion)), 1)
    below = tail[0] - tail[: kept + 1] - deviation**2 * np.arange(kept + 1)  # signal power below each frequency
    kept = max(int(np.argmax(below >= (1.0 - lost_share) * below[-1])), 1)
    return kept / (2.0 * interval * (samples.size - 1))


def _sections(butterworth: Butterworth, interval: float) -> FloatArray:
    return butterworth_sections(butterworth.order, butterworth.cut_off_hz, interval)


def _filter_segment(butterworth: Butterworth, time: FloatArray, samples: FloatArray, interval: float) -> FloatArray:
    """One stretch without long gaps, all samples present at the given times."""
    if samples.size == 1:
        return samples.copy()
    steps = np.rint(np.diff(time) / interval)
    # Against the grid and not step by step: samples that are merely left out keep the rest on its grid.
    offset = time - time[0] - interval * np.concatenate(([0.0], np.cumsum(steps)))
    if np.min(steps) >= 1.0 and np.ptp(offset - np.linspace(0.0, offset[-1], offset.size)) <= PREFILTER.even * interval:
        positions = np.concatenate(([0], np.cumsum(steps.astype(np.int64))))
        grid = np.arange(positions[-1] + 1)
        even = np.interp(grid, positions, samples)
        sections = _sections(butterworth, interval)
        if not butterworth.zero_phase:
            return filtered_from_steady(sections, even)[positions]
        _, padded, start = _turned_ends(butterworth, grid * interval, even)
        both_ways = filtered_from_steady(sections, filtered_from_steady(sections, padded)[::-1])[::-1]
        return both_ways[start : start + even.size][positions]
    poles, residues = _modes(butterworth)
    if not butterworth.zero_phase:
        return _run_modes(poles, residues, time, samples)
    padded_time, padded, start = _turned_ends(butterworth, time, samples)
    forward = _run_modes(poles, residues, padded_time, padded)
    backward = _run_modes(poles, residues, -padded_time[::-1], forward[::-1])[::-1]
    return backward[start : start + samples.size]


def _turned_ends(butterworth: Butterworth, time: FloatArray, samples: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    """The record continued at both ends by itself, turned by 180 degrees about its smoothed end values."""
    slowest = 2.0 * math.pi * butterworth.cut_off_hz * math.sin(0.5 * math.pi / butterworth.order)
    settling = 10.0 / slowest  # s; e^-10 of a transient is left
    before = min(int(np.searchsorted(time, time[0] + settling)), time.size - 1)
    after = min(time.size - int(np.searchsorted(time, time[-1] - settling)), time.size - 1)
    first = _end_value(time - time[0], samples, 1.0 / butterworth.cut_off_hz)
    last = _end_value(time[-1] - time[::-1], samples[::-1], 1.0 / butterworth.cut_off_hz)
    turned_time = turned_at_ends(time, time[0], time[-1], before, after)
    return turned_time, turned_at_ends(samples, first, last, before, after), before


def _end_value(distance: FloatArray, samples: FloatArray, reach: float) -> float:
    """Value at distance 0 of the quadratic through the samples within reach; the sample itself where they are few."""
    count = int(np.searchsorted(distance, reach, side="right"))
    if count < 6:
        return float(samples[0])
    ratio = distance[:count] / distance[count - 1]
    powers = np.column_stack((np.ones(count), ratio, ratio**2))
    return float(np.linalg.lstsq(powers, samples[:count], rcond=None)[0][0])


def _modes(butterworth: Butterworth) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Poles (rad/s) in the upper half plane and the residues of the continuous filter; a conjugate counts double."""
    cut_off = 2.0 * math.pi * butterworth.cut_off_hz
    poles = cut_off * butterworth_poles(butterworth.order)
    residues = np.array(
        [cut_off**butterworth.order / np.prod(pole - np.delete(poles, i)) for i, pole in enumerate(poles)]
    )
    upper = poles.imag > 1e-9 * abs(poles)
    real = abs(poles.imag) <= 1e-9 * abs(poles)
    return (
        np.concatenate((poles[upper], poles[real])).astype(np.complex128),
        np.concatenate((2.0 * residues[upper], residues[real])).astype(np.complex128),
    )


@njit
def _run_modes(
    poles: NDArray[np.complex128], residues: NDArray[np.complex128], time: FloatArray, samples: FloatArray
) -> FloatArray:
    """The continuous filter's output at the samples, its input linear between them; started in steady state.

    Each mode obeys x' = p x + u. Over a step h with z = p h and u going from u0 to u1:
    x1 = e^z x0 + h [ (phi1 - phi2) u0 + phi2 u1 ], phi1 = (e^z - 1)/z, phi2 = (e^z - 1 - z)/z^2.
    """
    result = np.zeros(samples.size)
    for k in range(poles.size):
        pole = poles[k]
        state = -samples[0] / pole
        result[0] += (residues[k] * state).real
        for n in range(1, samples.size):
            step = time[n] - time[n - 1]
            z = pole * step
            growth = np.exp(z)
            if abs(z) < 0.01:
                # The closed forms lose their digits for short steps.
                phi1 = 1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0 * (1.0 + z / 5.0 * (1.0 + z / 6.0))))
                phi2 = 0.5 + z / 6.0 * (1.0 + z / 4.0 * (1.0 + z / 5.0 * (1.0 + z / 6.0 * (1.0 + z / 7.0))))
            else:
                phi1 = (growth - 1.0) / z
                phi2 = (phi1 - 1.0) / z
            state = growth * state + step * ((phi1 - phi2) * samples[n - 1] + phi2 * samples[n])
            result[n] += (residues[k] * state).real
    return result
