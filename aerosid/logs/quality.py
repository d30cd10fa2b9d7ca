"""Data quality: sampling, gaps, spikes, stuck channels, noise, excitation, missing channels."""

from __future__ import annotations

import enum
import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from aerosid.logs.channel_noise import channel_noise
from aerosid.logs.constant_channels import dead_channel, is_constant
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.log_consistency import answer_to_elevator, pitch_factor
from aerosid.logs.physical_values import first_not_positive, longest_hole
from aerosid.logs.sample_patterns import cut_at, longest_stand, quantum, spike_times, spikes
from aerosid.logs.settings import QUALITY
from aerosid.nomenclature import CHANNELS, is_surface
from aerosid.notation import number

NEEDED = ("V", "alpha", "q")  # required by the estimation, in addition to a moving control
HELPFUL = ("theta", "a_x", "a_z")

_MOVING = ("V", "alpha", "beta", "p", "q", "r", "phi", "theta", "psi", "a_x", "a_y", "a_z", "q_dot", "h")
"""Channels that move in any manoeuvre."""


class Problem(enum.Enum):
    """Problems of a log, each as a sentence with its remedy."""

    LACKING = "close-loop needs this channel: add the column, or map it in a channel map"
    NO_CONTROL = "no control surface (delta_e ...) is in the log: add the column, or map it in a channel map"
    CONTROL_AT_REST = (
        "no control surface moves by more than its noise, nothing is excited: fly a doublet or a 3-2-1-1, or choose "
        "another span"
    )
    CONTROL_CONSTANT = "no control surface moves: fly a doublet or a 3-2-1-1, check the sensor, or choose another span"
    NOT_POSITIVE = "it has to be positive: leave those fields empty, correct the column or choose another span"
    CONTROL_HOLE = "no response can be simulated without the control: choose a span without that hole, or fill it"
    TOO_FAST = "no flight recorder samples that fast: correct the unit of time"
    EMPTY = "every sample is missing: correct the channel map or leave the channel out"
    HELPFUL = "not recorded: close-loop works without it, but attributes effects less reliably"
    GAPS = "the recording has gaps: the simulation runs through them, but choose a span without where you can"
    UNEVEN = "the sampling is uneven: it is used as it is, nothing is resampled"
    MISSING = "samples are missing: simulations skip them, the equations bridge them by a line"
    FILLED = "samples are missing: the control is interpolated linearly between the others"
    SPIKES = "single samples differ strongly from both neighbours: leave these fields empty if they are not motion"
    STUCK = "the channel is constant while others move: check the sensor, or leave the channel out"
    DEAD = "the quantity moved and the channel did not: correct the column or the channel map, or use another recording"
    CONSTANT = "the channel never changes: check the sensor, or leave the channel out"
    SATURATED = "the channel is clipped at its extreme: check the sensor's range, or leave the channel out"
    COARSE = "the resolution is coarser than the noise: small effects are lost in the quantisation"
    NOISE_UNKNOWN = (
        "the noise cannot be estimated, and multiples of the noise are meaningless: give `noise = ` or "
        "`resolution = ` in the channel map or the aircraft file"
    )
    WEAK = "the channel varies by less than three times its noise: its derivatives will be poor"
    LATERAL = "the manoeuvre is not longitudinal alone: keep phi, p and r in the log, for the equations use them"
    ANGLE_UNIT = "theta' and q differ by about 57: one of them is in degrees, correct its unit"
    RATE_UNIT = "theta' and q differ by more than a unit of angle: check their units and that of time"
    DEGREES = "the value is too large for an aircraft: it is in degrees and read as radians, correct its unit"
    ANGLE_SIGN = "theta' and q have opposite signs: correct one of them in a channel map"
    CONTROL_SIGN = (
        "q increases with delta_e, but positive is trailing edge down: correct one of the signs, or a late clock, in a "
        "channel map"
    )
    LOAD_FACTOR = "the mean of a_z is not about -9.81 m/s^2: check its unit, sign and offset (specific force, z down)"


_BLOCKING = frozenset(
    {
        Problem.DEAD,
        Problem.DEGREES,
        Problem.LACKING,
        Problem.NO_CONTROL,
        Problem.CONTROL_CONSTANT,
        Problem.NOT_POSITIVE,
        Problem.CONTROL_HOLE,
        Problem.TOO_FAST,
    }
)
"""Problems with which close-loop refuses a log."""

NOT_COMPARABLE = frozenset({Problem.DEAD, Problem.DEGREES, Problem.NOT_POSITIVE, Problem.TOO_FAST})
"""Problems that contradict every other channel: a search for instrument errors would be slow and futile."""


@dataclass(frozen=True)
class Finding:
    """One problem of a log.

    Attributes
    ----------
    problem : Problem
        The problem and its remedy.
    subject : str
        The channel, or `time`.
    detail : str
        Extent and location.
    """

    problem: Problem
    subject: str
    detail: str = ""

    @property
    def blocking(self) -> bool:
        """Whether the problem prevents close-loop on this log."""
        return self.problem in _BLOCKING

    def __str__(self) -> str:
        """The finding as one sentence."""
        detail = f" ({self.detail})" if self.detail else ""
        return f"{self.subject}{detail}: {self.problem.value}."


@dataclass(frozen=True)
class ChannelQuality:
    """Quality of one channel.

    Attributes
    ----------
    name, unit : str
        The channel, and the unit of the numbers below.
    minimum, maximum : float
        Of the valid samples; NaN where there are none.
    missing : float
        Fraction of samples that are missing.
    spikes : int
        Number of samples far from both neighbours.
    stuck : float
        Longest time without a change, s.
    quantum : float
        Resolution; 0 where none is discernible.
    noise : float
        Standard deviation of the white measurement noise.
    excitation : float
        Root-mean-square variation without the noise, divided by the noise; infinite without noise.
    declared : bool
        Whether the channel map or the aircraft file gives the noise.
    doubt : str
        Why the estimated noise is not reliable; empty where it is.
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
    declared: bool = False
    doubt: str = ""


@dataclass(frozen=True)
class LogQuality:
    """Quality of a log.

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
        Range of the intervals, without gaps, divided by the median.
    gaps : tuple of (float, float)
        Start, s, and length, s, of each gap.
    channels : tuple of ChannelQuality
        In the order of the log.
    findings : tuple of Finding
        The problems, blocking ones first.
    notes : tuple of str
        Conversions of the data on reading.
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
    """The quality of a log: its sampling, each channel's quality, and the problems with their remedies.

    Parameters
    ----------
    log : FlightLog
        Measured channels, SI.
    """
    interval = log.interval
    steps = np.diff(log.time)
    gap_at = np.flatnonzero(steps > QUALITY.gap * interval)
    gaps = tuple((float(log.time[k]), float(steps[k])) for k in gap_at)
    even = steps[steps <= QUALITY.gap * interval]
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
    present = values[there]
    unit = log.units.get(name, "")
    missing = 1.0 - present.size / values.size
    if present.size == 0:
        return ChannelQuality(name, unit, math.nan, math.nan, 1.0, 0, 0.0, 0.0, 0.0, 0.0)
    known = channel_noise(log, name)
    noise = known.deviation
    # The variance of equal numbers is not always zero.
    power = 0.0 if is_constant(values) else float(np.var(present))
    variation = math.sqrt(max(power - noise**2, 0.0))
    excitation = variation / noise if noise > 0.0 else (math.inf if variation > 0.0 else 0.0)
    return ChannelQuality(
        name,
        unit,
        float(present.min()),
        float(present.max()),
        missing,
        int(spikes(values, noise).size),
        longest_stand(log.time[there], present),
        quantum(present),
        noise,
        excitation,
        known.declared,
        known.doubt,
    )


def _needs(channels: dict[str, ChannelQuality]) -> list[Finding]:
    """Channels that close-loop requires and the log lacks."""
    there = {name for name, channel in channels.items() if channel.missing < 1.0}
    findings = [Finding(Problem.LACKING, name, _lacking(name, there)) for name in NEEDED if name not in there]
    controls = [channels[name] for name in there if is_surface(name)]
    if not controls:
        findings.append(Finding(Problem.NO_CONTROL, "controls"))
    elif not any(control.excitation > QUALITY.excited for control in controls):
        constant = all(control.minimum == control.maximum for control in controls)
        problem = Problem.CONTROL_CONSTANT if constant else Problem.CONTROL_AT_REST
        findings.append(Finding(problem, ", ".join(control.name for control in controls)))
    findings += [Finding(Problem.HELPFUL, name, CHANNELS[name].name) for name in HELPFUL if name not in channels]
    return findings


def _lacking(name: str, there: Collection[str]) -> str:
    """The channel's meaning, and the channel of the log that differs in capital letters alone."""
    alike = next((other for other in there if other.lower() == name.lower()), None)
    return f"{CHANNELS[name].name}; is {alike} meant?" if alike else CHANNELS[name].name


def _sampling_findings(log: FlightLog, gaps: tuple[tuple[float, float], ...], unevenness: float) -> list[Finding]:
    findings = []
    if log.interval < QUALITY.shortest_interval:
        findings.append(Finding(Problem.TOO_FAST, "time", f"every {number(log.interval)} s"))
    if gaps:
        start, length = max(gaps, key=lambda gap: gap[1])
        longest = f"{number(length)} s after {number(start, 6)} s"
        detail = f"{len(gaps)} of more than {QUALITY.gap:g} intervals, the longest {longest}"
        findings.append(Finding(Problem.GAPS, "time", detail))
    if unevenness > QUALITY.uneven:
        detail = f"intervals of {log.interval:.4g} s scatter by {100.0 * unevenness:.3g} %"
        findings.append(Finding(Problem.UNEVEN, "time", detail))
    return findings


def _channel_findings(log: FlightLog, channel: ChannelQuality) -> list[Finding]:
    """Problems of one channel by itself."""
    name = channel.name
    if channel.missing == 1.0:
        return [Finding(Problem.EMPTY, name)]
    values = log[name]
    findings = []
    if found := first_not_positive(log, name):
        findings.append(Finding(Problem.NOT_POSITIVE, name, found))
    if (hole := longest_hole(log, name)) is not None:
        findings.append(Finding(Problem.CONTROL_HOLE, name, f"lacks {hole}"))
    elif channel.missing > 0.0:
        problem = Problem.FILLED if is_surface(name) else Problem.MISSING
        findings.append(Finding(problem, name, f"{number(100.0 * channel.missing)} %"))
    if channel.spikes:
        findings.append(Finding(Problem.SPIKES, name, spike_times(log.time, spikes(values, channel.noise))))
    # Controls and slowly varying quantities may be constant; motion channels may not.
    if name in _MOVING and channel.minimum == channel.maximum:
        dead = dead_channel(log, name)
        if dead is not None and name in NEEDED:
            return [*findings, Finding(Problem.DEAD, name, str(dead))]
        found = str(dead) if dead is not None else f"{number(channel.minimum, 4)} {channel.unit}"
        return [*findings, Finding(Problem.CONSTANT, name, found)]
    if name not in CHANNELS or CHANNELS[name].kind != "output" or name == "h":
        return findings
    # Of a channel with coarse resolution at least the steps are known; they are reported below.
    coarse = channel.quantum > 2.0 * channel.noise
    if channel.doubt and not coarse:
        findings.append(Finding(Problem.NOISE_UNKNOWN, name, channel.doubt))
    duration = float(log.time[-1] - log.time[0])
    if channel.stuck > max(QUALITY.stuck_share * duration, QUALITY.stuck_samples * log.interval):
        findings.append(Finding(Problem.STUCK, name, f"for {number(channel.stuck)} s"))
    elif cut := cut_at(values):
        findings.append(Finding(Problem.SATURATED, name, f"{number(cut, 4)} {channel.unit}"))
    if coarse:
        findings.append(Finding(Problem.COARSE, name, f"steps of {number(channel.quantum)} {channel.unit}"))
    if channel.excitation < QUALITY.excited:
        findings.append(Finding(Problem.WEAK, name, f"{number(channel.excitation, 2)} times"))
    return findings


def degrees_findings(log: FlightLog) -> list[Finding]:
    """The angles whose values exceed any attitude of an aircraft in radians."""
    return [
        Finding(Problem.DEGREES, name, f"99 % within {most:.3g} rad")
        for name in log.channels
        if (most := _most_radians(log, name)) > QUALITY.most_radians.get(name, QUALITY.most_deflection)
    ]


def _most_radians(log: FlightLog, name: str) -> float:
    """Bound of 99 % of the samples' magnitude of an angle, rad; 0 for any other channel."""
    angle = name in QUALITY.most_radians or is_surface(name)
    if not angle or log.units.get(name) != "rad" or not np.isfinite(log[name]).any():
        return 0.0
    return float(np.nanquantile(np.abs(log[name]), 0.99))


def _motion_findings(log: FlightLog) -> list[Finding]:
    """Problems between channels: lateral motion, units, signs."""
    findings = []
    if "phi" in log and np.isfinite(log["phi"]).any():
        bank = float(np.nanmax(np.abs(log["phi"])))
        if bank > QUALITY.banked:
            findings.append(Finding(Problem.LATERAL, "phi", f"bank reaches {math.degrees(bank):.0f} deg"))
    findings += degrees_findings(log)
    slope = pitch_factor(log)
    if slope is not None and slope < QUALITY.opposite:
        findings.append(Finding(Problem.ANGLE_SIGN, "theta, q", f"factor {slope:.3g}"))
    elif slope is not None and (slope > QUALITY.other_unit[1] or 0.0 < slope < QUALITY.other_unit[0]):
        degrees = max(slope, 1.0 / slope) < QUALITY.most_other_unit
        problem = Problem.ANGLE_UNIT if degrees else Problem.RATE_UNIT
        findings.append(Finding(problem, "theta, q", f"factor {slope:.3g}"))
    answer = answer_to_elevator(log)
    if answer is not None and answer > QUALITY.wrong_answer:
        findings.append(Finding(Problem.CONTROL_SIGN, "delta_e, q", f"correlation {answer:.2g}"))
    if "a_z" in log and np.isfinite(log["a_z"]).any():
        mean = float(np.nanmean(log["a_z"]))
        if not QUALITY.level_load[0] < mean < QUALITY.level_load[1]:
            findings.append(Finding(Problem.LOAD_FACTOR, "a_z", f"mean {mean:.3g} m/s^2"))
    return findings
