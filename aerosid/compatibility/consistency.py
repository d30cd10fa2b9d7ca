"""Data compatibility of one recording or several: faults, agreement, verdict.

What kinematics alone say of a log, and of several of one installation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from aerosid.compatibility.contradiction import Contradiction, contradictions
from aerosid.compatibility.estimate import Fit
from aerosid.compatibility.fault_search import DEFAULT, Named, Searched, SearchSettings, search
from aerosid.compatibility.likelihood import simulate, whiten
from aerosid.compatibility.recording import MOST_SAMPLES, Recording, lacking, read_recording
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS
from aerosid.notation import number, with_deviation
from aerosid.signals.fit_statistics import whiteness


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
    """Gusts along one body axis (u or w): standard deviation, m/s, and scale length, m."""

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
    is_gusty : bool
        Whether the air moves along w, further and longer than a vane's own noise could pretend.
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
    is_gusty: bool = False


def check_kinematics(logs: Sequence[FlightLog], settings: SearchSettings = DEFAULT) -> KinematicConsistency | None:
    """What the kinematics of these logs say about their instruments; None where too few channels are there.

    Parameters
    ----------
    logs : sequence of FlightLog
        Flights with the same instruments: one joint estimate.
    settings : SearchSettings
        Thresholds of the search.

    Notes
    -----
    Flight-path reconstruction: u, w, theta and h follow from a_x, a_z and q without any aerodynamics, so that what V,
    alpha, theta and h show beside them is the instruments' and the air's. Klein & Morelli, Aircraft System
    Identification, chapter 10; Jategaonkar, Flight Vehicle System Identification, 2nd ed., chapter 10.
    """
    recordings, notes = _compared(logs)
    if not recordings:
        return None
    return _opposed(recordings, notes, settings) or _reconciled(recordings, notes, settings)


def reconciled(logs: Sequence[FlightLog], settings: SearchSettings = DEFAULT) -> KinematicConsistency | None:
    """As `check_kinematics`, of logs in which `contradicting` found nothing."""
    recordings, notes = _compared(logs)
    return _reconciled(recordings, notes, settings) if recordings else None


def _reconciled(
    recordings: Sequence[Recording], notes: tuple[str, ...], settings: SearchSettings
) -> KinematicConsistency:
    """The faults of instruments that reconcile the channels."""
    found = search(recordings, settings)
    findings = tuple(_finding(named) for named in found.named)
    groups = tuple(
        (_finding(named), *map(_finding, others))
        for named, others in zip(found.named, found.instead, strict=True)
        if others
    )
    air = _air(found.final)
    verdict = Agreement.CORRECTED if findings else Agreement.CONSISTENT
    return KinematicConsistency(
        tuple(recording.log.name for recording in recordings),
        verdict,
        findings,
        groups,
        air,
        _channels(recordings, found, settings),
        told(findings, groups, air),
        notes,
        is_gusty=_is_gusty(recordings, air, settings),
    )


def contradicting(logs: Sequence[FlightLog], settings: SearchSettings = DEFAULT) -> KinematicConsistency | None:
    """What no fault of an instrument reconciles; None where there is nothing of the kind, or too few channels."""
    recordings, notes = _compared(logs)
    return _opposed(recordings, notes, settings) if recordings else None


def _compared(logs: Sequence[FlightLog]) -> tuple[list[Recording], tuple[str, ...]]:
    """The logs as arrays, and what was left out of them."""
    read = [(log, read_recording(log)) for log in logs]
    recordings = [recording for _, recording in read if recording is not None]
    notes = tuple(_left_out(log) for log, recording in read if recording is None)
    notes += tuple(
        f"{r.log.name}: the liveliest {r.compared_samples} of {r.log.samples} samples are looked at."
        for r in recordings
        if r.log.samples > MOST_SAMPLES
    )
    return recordings, notes


def _opposed(
    recordings: Sequence[Recording], notes: tuple[str, ...], settings: SearchSettings
) -> KinematicConsistency | None:
    opposed = contradictions(recordings, settings=settings.contradiction)
    if not opposed:
        return None
    names = tuple(recording.log.name for recording in recordings)
    sentence = " ".join(each.sentence for each in opposed)
    return KinematicConsistency(names, Agreement.INCONSISTENT, (), (), (), (), sentence, notes, opposed)


def _left_out(log: FlightLog) -> str:
    absent = lacking(log)
    why = f"it lacks {', '.join(absent)}" if absent else "no stretch of 3 s is without gaps"
    return f"{log.name}: its instruments cannot be compared by kinematics, {why}."


def _finding(named: Named) -> InstrumentFinding:
    fault = named.fault
    return InstrumentFinding(
        fault.kind, fault.channel, fault.axis, named.value, named.std_error, fault.unit, named.p_value, named.gain
    )


def _air(at: Fit) -> tuple[MovingAir, ...]:
    gust = at.structure.gust
    pairs = (("w", gust.sigma_w, gust.length_w), ("u", gust.sigma_u, gust.length_u))
    return tuple(MovingAir(*pair) for pair in pairs if pair[1] > 0.0)


def _is_gusty(recordings: Sequence[Recording], air: Sequence[MovingAir], settings: SearchSettings) -> bool:
    speed = max(recording.airspeed for recording in recordings)
    vane = max(recording.noise["alpha"] * recording.airspeed for recording in recordings)
    least, length = settings.above_the_vane * vane, settings.gusts_last * speed
    return any(gust.axis == "w" and gust.sigma > least and gust.length > length for gust in air)


def _channels(
    recordings: Sequence[Recording], found: Searched, settings: SearchSettings
) -> tuple[ChannelAgreement, ...]:
    raw = [_raw(recordings, at) for at in (found.null, found.final)]
    white = _whiteness(recordings, found.final, settings)
    rows = []
    for n, recording in enumerate(recordings):
        for name in recording.outputs:
            i = LONGITUDINAL.outputs.index(name)
            before, after = (float(np.sqrt(np.nanmean(part[n][:, i] ** 2))) for part in raw)
            noise = recording.noise[name]
            rows.append(
                ChannelAgreement(recording.log.name, name, CHANNELS[name].unit, before, after, noise, white[n, name])
            )
    return tuple(rows)


def _raw(recordings: Sequence[Recording], at: Fit) -> list[np.ndarray[tuple[int, int], np.dtype[np.float64]]]:
    """Measured minus integrated, (n, 8) for each recording, NaN where nothing is compared."""
    parts: list[list[np.ndarray[tuple[int, int], np.dtype[np.float64]]]] = [[] for _ in recordings]
    for stretch in simulate(recordings, at.structure, at.states):
        parts[stretch.recording].append(np.where(stretch.held, stretch.block[:, :, 0], np.nan))
    return [np.concatenate(part) for part in parts]


def _whiteness(recordings: Sequence[Recording], at: Fit, settings: SearchSettings) -> dict[tuple[int, str], bool]:
    """Whether each channel's whitened residual is white in every stretch of each recording."""
    white = {(n, name): True for n, recording in enumerate(recordings) for name in recording.outputs}
    stretches = simulate(recordings, at.structure, at.states)
    for part in whiten(recordings, stretches, at.structure.gust, at.variance):
        for name in recordings[part.recording].outputs:
            residual = part.residual[:, LONGITUDINAL.outputs.index(name)]
            said = whiteness(residual[np.isfinite(residual)])
            if said is not None and said.p_value < settings.coloured:
                white[part.recording, name] = False
    return white


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
