"""Is the log good enough: sampling, gaps, spikes, stuck channels, noise, excitation, and what is missing."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from aerosid.logs.flight_log import FlightLog, FloatArray
from aerosid.logs.log_consistency import answer_to_elevator, pitch_factor
from aerosid.nomenclature import CHANNELS
from aerosid.signals.noise import estimate_noise

GAP = 2.5  # median intervals without a sample
UNEVEN = 0.02  # spread of the intervals over their median
SPIKE = 10.0  # noise standard deviations off both neighbours, and so many times what the neighbourhood does
STUCK_SHARE = 0.2  # of the record without a change, in a channel that otherwise moves
STUCK_SAMPLES = 20
SATURATED_SAMPLES = 5  # in a row at the channel's own extreme
EXCITED = 3.0  # variation over noise
WRONG_ANSWER = 0.3  # the right sign gives -0.4 to -0.85 on doublets and 3-2-1-1 of five aircraft
BANKED = math.radians(10.0)
NEEDED = ("V", "alpha", "q")  # what the estimation cannot do without, beside a moving control
HELPFUL = ("theta", "a_x", "a_z")


class Problem(enum.Enum):
    """What can be wrong with a log, each as a sentence that a user can act on."""

    LACKING = "close-loop needs this channel: add the column, or map it in a channel map"
    NO_CONTROL = "no control surface (delta_e ...) is in the log: add the column, or map it in a channel map"
    CONTROL_AT_REST = (
        "no control surface moves by more than its noise: fly a doublet or a 3-2-1-1, or choose another span"
    )
    EMPTY = "every sample is missing: correct the channel map or leave the channel out"
    HELPFUL = "not recorded: close-loop works without it, and attributes effects less surely"
    GAPS = "the recording has gaps: the simulation runs through them, but choose a span without where you can"
    UNEVEN = "the sampling is uneven: it is used as it is, nothing is resampled"
    MISSING = "samples are missing: they are skipped"
    SPIKES = "single samples stand far off both neighbours: leave these fields empty if they are no motion"
    STUCK = "the channel stands still while others move: check the sensor, or leave the channel out"
    CONSTANT = "the channel never changes: check the sensor, or leave the channel out"
    SATURATED = "the channel is cut at its own extreme: check the sensor's range, or leave the channel out"
    COARSE = "the resolution is coarser than the noise: small effects drown in the steps"
    WEAK = "the channel varies by less than three times its noise: its derivatives will be poor"
    LATERAL = "the manoeuvre is not longitudinal alone: keep phi, p and r in the log, the equations use them"
    ANGLE_UNIT = "theta' and q differ by about 57: one of them is in degrees, correct its unit"
    ANGLE_SIGN = "theta' and q have opposite signs: correct one of them in a channel map"
    CONTROL_SIGN = (
        "q rises where delta_e does, but positive is trailing edge down: correct one of the signs in a channel map"
    )
    LOAD_FACTOR = "a_z is not about -9.81 m/s^2 on the mean: check its unit, sign and offset (specific force, z down)"


_BLOCKING = frozenset({Problem.LACKING, Problem.NO_CONTROL, Problem.CONTROL_AT_REST})


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong.

    Attributes
    ----------
    problem : Problem
        What it is and what to do.
    subject : str
        The channel, or `time`.
    detail : str
        How much, where.
    """

    problem: Problem
    subject: str
    detail: str = ""

    @property
    def blocking(self) -> bool:
        """Whether close-loop cannot work on this log."""
        return self.problem in _BLOCKING

    def __str__(self) -> str:
        """The finding as one sentence."""
        detail = f" ({self.detail})" if self.detail else ""
        return f"{self.subject}{detail}: {self.problem.value}."


@dataclass(frozen=True)
class ChannelQuality:
    """What one channel is worth.

    Attributes
    ----------
    name, unit : str
        The channel and the unit of the numbers below.
    minimum, maximum : float
        Over the samples that are there; NaN where there are none.
    missing : float
        Share of samples that are missing.
    spikes : int
        Samples far off both neighbours.
    stuck : float
        Longest time without a change, s.
    quantum : float
        Resolution; 0 where none is visible.
    noise : float
        Standard deviation of the white measurement noise.
    excitation : float
        Root-mean-square variation without the noise, over the noise; infinite without noise.
    """

    name: str
    unit: str
    minimum: float
    maximum: float
    missing: float
    spikes: int
    stuck: float
    quantum: float
    noise: float
    excitation: float


@dataclass(frozen=True)
class LogQuality:
    """What a log is worth.

    Attributes
    ----------
    name, path : str
        The log.
    samples : int
        Number of samples.
    start, stop : float
        First and last time, s.
    interval : float
        Median sampling interval, s.
    unevenness : float
        Spread of the intervals, gaps aside, over the median.
    gaps : tuple of (float, float)
        Start, s, and length, s, of each gap.
    channels : tuple of ChannelQuality
        In the log's order.
    findings : tuple of Finding
        What is wrong, the blocking ones first.
    notes : tuple of str
        What was done to the data on reading.
    """

    name: str
    path: str
    samples: int
    start: float
    stop: float
    interval: float
    unevenness: float
    gaps: tuple[tuple[float, float], ...]
    channels: tuple[ChannelQuality, ...]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]

    @property
    def usable(self) -> bool:
        """Whether close-loop can work on this log."""
        return not any(finding.blocking for finding in self.findings)


def check_log(log: FlightLog) -> LogQuality:
    """The quality of a log: its sampling, each channel's worth, and what to do about what is wrong.

    Parameters
    ----------
    log : FlightLog
        Measured channels, SI.
    """
    interval = log.interval
    steps = np.diff(log.time)
    gap_at = np.flatnonzero(steps > GAP * interval)
    gaps = tuple((float(log.time[k]), float(steps[k])) for k in gap_at)
    even = steps[steps <= GAP * interval]
    unevenness = float((even.max() - even.min()) / interval)
    channels = tuple(_channel_quality(log, name) for name in log.channels)
    by_name = {channel.name: channel for channel in channels}
    findings = [*_needs(by_name), *_sampling_findings(log, gaps, unevenness)]
    for channel in channels:
        findings += _channel_findings(log, channel)
    findings += _motion_findings(log)
    findings.sort(key=lambda finding: not finding.blocking)
    return LogQuality(
        log.name,
        log.path,
        log.samples,
        float(log.time[0]),
        float(log.time[-1]),
        interval,
        unevenness,
        gaps,
        channels,
        tuple(findings),
        log.notes,
    )


def _channel_quality(log: FlightLog, name: str) -> ChannelQuality:
    values = log[name]
    there = np.isfinite(values)
    held = values[there]
    unit = log.units.get(name, "")
    missing = 1.0 - held.size / values.size
    if held.size == 0:
        return ChannelQuality(name, unit, math.nan, math.nan, 1.0, 0, 0.0, 0.0, 0.0, 0.0)
    noise = estimate_noise(log.time, values)
    variation = math.sqrt(max(float(np.var(held)) - noise**2, 0.0))
    excitation = variation / noise if noise > 0.0 else (math.inf if variation > 0.0 else 0.0)
    return ChannelQuality(
        name,
        unit,
        float(held.min()),
        float(held.max()),
        missing,
        int(spikes(values, noise).size),
        _longest_stand(log.time[there], held),
        _quantum(held),
        noise,
        excitation,
    )


def spikes(values: FloatArray, noise: float) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Indices of single samples that stand off both neighbours on the same side.

    Parameters
    ----------
    values : ndarray, shape (N,)
        One channel; NaN where a sample is missing.
    noise : float
        Standard deviation of its noise.

    Notes
    -----
    The smaller of the distances to the two neighbours counts. It must exceed the noise, the median of what the eight
    samples around do, and a tenth of the channel's range, so that a peak of fast motion is no spike.
    """
    if values.size < 10 or not np.isfinite(values).any():
        return np.empty(0, dtype=np.intp)
    before, after = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    with np.errstate(invalid="ignore"):
        height = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    low, high = np.nanpercentile(values, [0.5, 99.5])
    candidates = np.flatnonzero(height > max(SPIKE * noise, 0.1 * float(high - low), 1e-12)) + 1
    kept = []
    for k in candidates:
        around = np.concatenate([values[max(k - 5, 0) : k], values[k + 1 : k + 6]])
        local = np.abs(np.diff(around))
        local = local[np.isfinite(local)]
        if local.size and height[k - 1] > SPIKE * float(np.median(local)):
            kept.append(k)
    return np.array(kept, dtype=np.intp)


def _runs(values: FloatArray) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]:
    """First and last index of each run of equal values."""
    change = np.flatnonzero(np.diff(values) != 0.0)
    return np.concatenate([[0], change + 1]), np.concatenate([change, [values.size - 1]])


def _longest_stand(time: FloatArray, values: FloatArray) -> float:
    """The longest time, s, over which the value does not change."""
    first, last = _runs(values)
    return float(np.max(time[last] - time[first]))


def _quantum(values: FloatArray) -> float:
    """The step that all values are multiples of, or 0.0 where there is none that shows.

    Recorded numbers are rounded when printed, so multiples are only required within a few hundredths of the step.
    """
    levels = np.unique(values)
    if levels.size < 3 or levels.size > values.size / 3:
        return 0.0
    distance = np.diff(levels)
    # Two values that differ in their last printed digit are one level.
    distance = distance[distance > 1e-3 * float(np.median(distance))]
    step = float(distance.min())
    multiple = distance / step
    return step if bool(np.all(np.abs(multiple - np.round(multiple)) < 0.05 + 0.01 * multiple)) else 0.0


def _needs(channels: dict[str, ChannelQuality]) -> list[Finding]:
    """What close-loop needs and the log lacks."""
    there = {name for name, channel in channels.items() if channel.missing < 1.0}
    findings = [Finding(Problem.LACKING, name, CHANNELS[name].name) for name in NEEDED if name not in there]
    controls = [channels[name] for name in there if name.startswith("delta_")]
    if not controls:
        findings.append(Finding(Problem.NO_CONTROL, "controls"))
    elif not any(control.excitation > EXCITED for control in controls):
        findings.append(Finding(Problem.CONTROL_AT_REST, ", ".join(control.name for control in controls)))
    findings += [Finding(Problem.HELPFUL, name, CHANNELS[name].name) for name in HELPFUL if name not in channels]
    return findings


def _sampling_findings(log: FlightLog, gaps: tuple[tuple[float, float], ...], unevenness: float) -> list[Finding]:
    findings = []
    if gaps:
        start, length = max(gaps, key=lambda gap: gap[1])
        detail = f"{len(gaps)} of more than {GAP:g} intervals, the longest {length:.3g} s after {start:.6g} s"
        findings.append(Finding(Problem.GAPS, "time", detail))
    if unevenness > UNEVEN:
        detail = f"intervals of {log.interval:.4g} s spread by {100.0 * unevenness:.3g} %"
        findings.append(Finding(Problem.UNEVEN, "time", detail))
    return findings


def _channel_findings(log: FlightLog, channel: ChannelQuality) -> list[Finding]:
    """What is wrong with one channel by itself."""
    name = channel.name
    if channel.missing == 1.0:
        return [Finding(Problem.EMPTY, name)]
    values = log[name]
    findings = []
    if channel.missing > 0.0:
        findings.append(Finding(Problem.MISSING, name, f"{100.0 * channel.missing:.3g} %"))
    if channel.spikes:
        times = ", ".join(f"{log.time[k]:.6g}" for k in spikes(values, channel.noise)[:3])
        more = " ..." if channel.spikes > 3 else ""
        findings.append(Finding(Problem.SPIKES, name, f"{channel.spikes} at {times}{more} s"))
    # Controls and slow quantities rightly rest; what moves with the aircraft does not.
    if name not in CHANNELS or CHANNELS[name].kind != "output" or name == "h":
        return findings
    if channel.minimum == channel.maximum:
        return [*findings, Finding(Problem.CONSTANT, name, f"{channel.minimum:.4g} {channel.unit}")]
    duration = float(log.time[-1] - log.time[0])
    if channel.stuck > max(STUCK_SHARE * duration, STUCK_SAMPLES * log.interval):
        findings.append(Finding(Problem.STUCK, name, f"for {channel.stuck:.3g} s"))
    elif cut := _cut_at(values):
        findings.append(Finding(Problem.SATURATED, name, f"{cut:.4g} {channel.unit}"))
    if channel.quantum > 2.0 * channel.noise:
        findings.append(Finding(Problem.COARSE, name, f"steps of {channel.quantum:.3g} {channel.unit}"))
    if channel.excitation < EXCITED:
        findings.append(Finding(Problem.WEAK, name, f"{channel.excitation:.2g} times"))
    return findings


def _cut_at(values: FloatArray) -> float | None:
    """The extreme at which a channel rests repeatedly and unlike at its other values, or None."""
    held = values[np.isfinite(values)]
    first, last = _runs(held)
    length = last - first + 1
    for extreme in (float(held.min()), float(held.max())):
        here = held[first] == extreme
        longest_here = int(length[here].max())
        longest_elsewhere = int(length[~here].max(initial=1))
        if longest_here >= SATURATED_SAMPLES and longest_here > 2 * longest_elsewhere:
            return extreme
    return None


def _motion_findings(log: FlightLog) -> list[Finding]:
    """What the channels say about each other: lateral motion, units, signs."""
    findings = []
    if "phi" in log and np.isfinite(log["phi"]).any():
        bank = float(np.nanmax(np.abs(log["phi"])))
        if bank > BANKED:
            findings.append(Finding(Problem.LATERAL, "phi", f"bank reaches {math.degrees(bank):.0f} deg"))
    slope = pitch_factor(log)
    if slope is not None and slope < -0.3:
        findings.append(Finding(Problem.ANGLE_SIGN, "theta, q", f"factor {slope:.3g}"))
    elif slope is not None and (slope > 20.0 or 0.0 < slope < 0.05):
        findings.append(Finding(Problem.ANGLE_UNIT, "theta, q", f"factor {slope:.3g}"))
    answer = answer_to_elevator(log)
    if answer is not None and answer > WRONG_ANSWER:
        findings.append(Finding(Problem.CONTROL_SIGN, "delta_e, q", f"correlation {answer:.2g}"))
    if "a_z" in log and np.isfinite(log["a_z"]).any():
        mean = float(np.nanmean(log["a_z"]))
        if not -25.0 < mean < -4.0:
            findings.append(Finding(Problem.LOAD_FACTOR, "a_z", f"mean {mean:.3g} m/s^2"))
    return findings
