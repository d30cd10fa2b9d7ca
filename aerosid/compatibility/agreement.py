"""Results of the data compatibility check, as values and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from aerosid.compatibility.contradiction import Contradiction
from aerosid.notation import number, with_deviation


class Agreement(Enum):
    """Whether the channels agree; each value is a sentence for a person."""

    CONSISTENT = "The channels agree with each other as kinematics demand."
    CORRECTED = "The channels agree with each other once the instruments named here are corrected."
    INCONSISTENT = "The channels contradict each other, and no fault of an instrument reconciles them."


@dataclass(frozen=True)
class InstrumentFinding:
    """One thing that is wrong with an instrument, from kinematics alone.

    Attributes
    ----------
    kind, where : str
        As in result.json: sensor_bias, sensor_scale, sensor_delay, sensor_lag, sensor_position; the channel.
    axis : str
        x or z of the body axes, of a position; else empty.
    value, std_error : float
        In `unit`: bias = measured - true, scale = measured/true, delays and lags positive when late, a position's
        distance from where it was taken to be. The deviation is corrected for coloured residuals.
    unit : str
        SI.
    p_value : float
        Of its being none; counts how many faults were asked after.
    likelihood_gain : float
        Rise of -2 ln L when it is struck out.
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
    """Air that moves along one body axis (u or w), further and longer than the noise of the sensor that sees it.

    `sigma` standard deviation, m/s; `length` scale of the correlation, m.
    """

    axis: str
    sigma: float
    length: float


@dataclass(frozen=True)
class ChannelAgreement:
    """How one channel of one log agrees with the path that a_x, a_z and q give.

    `before` and `after`: root-mean-square of measured minus integrated, in `unit`, without and with the findings;
    `noise` that of the channel's own white noise; `white`: whether what the findings and gusts leave is white.
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
    """What kinematics alone say about the instruments of one or several logs.

    Attributes
    ----------
    logs : tuple of str
        The logs that could be checked.
    verdict : Agreement
        Whether the channels agree.
    findings : tuple of InstrumentFinding
        What is wrong for certain, most certain first.
    inseparable : tuple of tuple of InstrumentFinding
        Groups of faults that these flights cannot tell apart: a finding, then what could stand in its place, each with
        the number that it would have.
    air : tuple of MovingAir
        Gusts that the channels show.
    channels : tuple of ChannelAgreement
        Each channel that sees the path, on each log.
    sentence : str
        The verdict for a person.
    notes : tuple of str
        What was left out.
    contradictions : tuple of Contradiction
        What no fault of an instrument reconciles; where there is one nothing else is judged.
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
        """Whether the air moves along w."""
        return any(gust.axis == "w" for gust in self.air)


def told(
    findings: Sequence[InstrumentFinding],
    groups: Sequence[tuple[InstrumentFinding, ...]],
    air: Sequence[MovingAir],
) -> str:
    """What was found, for a person."""
    if not findings and not air:
        return Agreement.CONSISTENT.value
    parts = []
    for finding in findings:
        said = describe(finding)
        others = next((group[1:] for group in groups if group[0] == finding), ())
        if others:
            said += f" (or {', or '.join(describe(other) for other in others)}: these flights cannot tell)"
        parts.append(said)
    parts += [
        f"turbulence, sigma_{gust.axis} = {number(gust.sigma, 2)} m/s, scale length {number(gust.length, 2)} m"
        for gust in air
    ]
    return f"From kinematics alone: {'; '.join(parts)}."


def describe(finding: InstrumentFinding) -> str:
    """A finding with its number, as a person writes it."""
    unit = "" if finding.unit == "1" else f" {finding.unit}"
    kind = finding.kind.removeprefix("sensor_").replace("_", " ")
    axis = f" along {finding.axis}" if finding.axis else ""
    return f"{kind} of {finding.where}{axis} {with_deviation(finding.value, finding.std_error)}{unit}"
