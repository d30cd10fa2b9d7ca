"""Results of the data compatibility check, as values and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from aerosid.notation import listed, number, with_deviation


class Agreement(Enum):
    """Whether the channels agree; each value is a sentence for the report."""

    CONSISTENT = "The channels agree with each other as kinematics demand."
    CORRECTED = "The channels agree with each other once the instruments named here are corrected."
    INCONSISTENT = "The channels contradict each other, and no instrument error reconciles them."


@dataclass(frozen=True)
class Contradiction:
    """Channels of one log that cannot belong to one motion.

    Attributes
    ----------
    log : str
        The log.
    channels : tuple of str
        The single inconsistent channel, those with spikes, or those that contradict the integrated motion.
    remedy : str
        The correction with which they agree, as words after "it agrees"; empty where none was found.
    misfit : float
        Largest unexplained fraction of a channel's variation.
    clocks : tuple of (str, float)
        The corrections of one channel's clock alone, where no other kind explains as much: the channel and the time by
        which it is late, s, negative when early.
    """

    log: str
    channels: tuple[str, ...]
    remedy: str
    misfit: float
    clocks: tuple[tuple[str, float], ...] = ()

    @property
    def sentence(self) -> str:
        """The contradiction in words."""
        fraction = f"{100.0 * min(self.misfit, 9.99):.0f} % of the variation is unexplained"
        if self.remedy:
            several = len(self.channels) > 1
            contradict, agree = ("contradict", "they agree") if several else ("contradicts", "it agrees")
            return (
                f"{self.log}: {listed(self.channels)} {contradict} the other channels ({fraction}); {agree} "
                f"{self.remedy}."
            )
        if len(self.channels) == 1:
            return (
                f"{self.log}: {self.channels[0]} contradicts the other channels, which agree without it ({fraction}); "
                "check that it belongs to this flight and has the same clock."
            )
        return (
            f"{self.log}: {', '.join(self.channels)} contradict the motion integrated from a_x, a_z and q "
            f"({fraction}); check that all of them belong to this flight, and their signs, units and clocks."
        )


@dataclass(frozen=True)
class InstrumentFinding:
    """One instrument error, from kinematics alone.

    Attributes
    ----------
    kind, where : str
        As in result.json: sensor_bias, sensor_scale, sensor_delay, sensor_lag, sensor_position; the channel.
    axis : str
        x or z of the body axes, of a position; else empty.
    value, std_error : float
        In `unit`: bias = measured - true, scale = measured/true, delays and lags positive when late, a position's
        distance from the declared one. The standard error is corrected for coloured residuals.
    unit : str
        SI.
    p_value : float
        Under the null hypothesis, times the number of errors tested (Bonferroni).
    likelihood_gain : float
        Rise of -2 ln L when it is removed.
    """

    kind: str
    where: str
    axis: str
    value: float
    std_error: float
    unit: str
    p_value: float
    likelihood_gain: float


@dataclass(frozen=True)
class MovingAir:
    """Turbulence along one body axis (u or w), above the noise of the sensor that measures it and of longer memory.

    `sigma` standard deviation, m/s; `length` scale of the correlation, m.
    """

    axis: str
    sigma: float
    length: float


@dataclass(frozen=True)
class ChannelAgreement:
    """Agreement of one channel of one log with the path integrated from a_x, a_z and q.

    `before` and `after`: root-mean-square of measured minus integrated, in `unit`, without and with the findings;
    `noise` that of the channel's own white noise; `white`: whether the residual with findings and gusts is white.
    """

    log: str
    channel: str
    unit: str
    before: float
    after: float
    noise: float
    white: bool


@dataclass(frozen=True)
class KinematicConsistency:
    """Result of the data compatibility check of one or several logs.

    Attributes
    ----------
    logs : tuple of str
        The logs that could be checked.
    verdict : Agreement
        Whether the channels agree.
    findings : tuple of InstrumentFinding
        The identified instrument errors, most significant first.
    inseparable : tuple of tuple of InstrumentFinding
        Groups of indistinguishable errors: a finding, then its alternatives, each with its own estimate.
    air : tuple of MovingAir
        Gusts that the channels show.
    channels : tuple of ChannelAgreement
        Each channel that is compared with the path, on each log.
    sentence : str
        The verdict in words.
    notes : tuple of str
        Exclusions and remarks.
    contradictions : tuple of Contradiction
        Channels that no instrument error reconciles; where there are any nothing else is tested.
    """

    logs: tuple[str, ...]
    verdict: Agreement
    findings: tuple[InstrumentFinding, ...]
    inseparable: tuple[tuple[InstrumentFinding, ...], ...]
    air: tuple[MovingAir, ...]
    channels: tuple[ChannelAgreement, ...]
    sentence: str
    notes: tuple[str, ...] = ()
    contradictions: tuple[Contradiction, ...] = ()

    @property
    def is_gusty(self) -> bool:
        """Whether there are gusts along w."""
        return any(gust.axis == "w" for gust in self.air)


def findings_sentence(
    findings: Sequence[InstrumentFinding],
    groups: Sequence[tuple[InstrumentFinding, ...]],
    air: Sequence[MovingAir],
) -> str:
    """The findings in words."""
    if not findings and not air:
        return Agreement.CONSISTENT.value
    parts = []
    for finding in findings:
        sentence = describe(finding)
        others = next((group[1:] for group in groups if group[0] == finding), ())
        if others:
            sentence += (
                f" (or {', or '.join(describe(other) for other in others)}: not distinguishable on these flights)"
            )
        parts.append(sentence)
    parts += [
        f"turbulence, sigma_{gust.axis} = {number(gust.sigma, 2)} m/s, scale length {number(gust.length, 2)} m"
        for gust in air
    ]
    return f"From kinematics alone: {'; '.join(parts)}."


def describe(finding: InstrumentFinding) -> str:
    """A finding with its value in words."""
    unit = "" if finding.unit == "1" else f" {finding.unit}"
    kind = finding.kind.removeprefix("sensor_").replace("_", " ")
    axis = f" along {finding.axis}" if finding.axis else ""
    return f"{kind} of {finding.where}{axis} {with_deviation(finding.value, finding.std_error)}{unit}"
