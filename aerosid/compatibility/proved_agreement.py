"""Results of the data compatibility check from sensor faults that the kinematic equations prove."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from aerosid.compatibility.agreement import (
    Agreement,
    ChannelAgreement,
    InstrumentFinding,
    KinematicConsistency,
    MovingAir,
    told,
)
from aerosid.compatibility.settings import USUAL, CompatibilitySettings
from aerosid.effects import ActiveEffect, PositionEffect
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.alternatives import alternatives_of, gains_by_deletion
from aerosid.equation_error.selection.candidates import is_instrument_error
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.wald_tests import effect_estimates
from aerosid.nomenclature import CHANNELS
from aerosid.notation import number
from aerosid.signals.fit_statistics import whiteness

SEES = {"w": "alpha", "u": "V"}
"""The sensor that sees the air move along each body axis."""


def agreement_of(
    faults: InstrumentErrors, settings: CompatibilitySettings = USUAL, notes: tuple[str, ...] = ()
) -> KinematicConsistency:
    """What the proved faults say of the instruments of all recordings.

    Residuals are those of the channels in the band of the motion.
    """
    selected = faults.selected
    found = selected.estimate
    covariance = corrected_covariance(found.design, found.solution)
    asked = len(faults.hypotheses)
    rows = effect_estimates(found, covariance, selected.chosen, gains_by_deletion(selected))
    findings = tuple(
        _finding(row.hypothesis.kind, row.active, row.value, row.std_error, row.gain, asked) for row in rows
    )
    others: dict[tuple[str, str, str], list[InstrumentFinding]] = {}
    for other in alternatives_of(
        selected, [hypothesis for hypothesis in faults.hypotheses if is_instrument_error(hypothesis)]
    ):
        said = _finding(other.hypothesis.kind, other.active, other.value, other.std_error, other.gain, asked)
        others.setdefault(other.replaces.label, []).append(said)
    groups = tuple(
        (finding, *others[row.hypothesis.label])
        for row, finding in zip(rows, findings, strict=True)
        if row.hypothesis.label in others
    )
    moving = tuple(_moving_air(found, settings))
    air = tuple(each for each in moving if each.length <= settings.longest_scale)
    notes = (*notes, *(_told_of_drift(each) for each in moving if each not in air))
    return KinematicConsistency(
        tuple(dict.fromkeys(recording.name for recording in found.problem.recordings)),
        Agreement.CORRECTED if findings else Agreement.CONSISTENT,
        findings,
        groups,
        air,
        tuple(_channels(faults.declared, found, settings)),
        told(findings, groups, air),
        notes,
    )


def _finding(
    kind: str, active: ActiveEffect | None, value: float, std_error: float, gain: float, asked: int
) -> InstrumentFinding:
    assert active is not None  # faults of instruments are effects
    effect, parameter = active.effect, active.effect.parameters[0]
    distance = abs(value - parameter.null) / std_error if std_error > 0.0 else np.inf
    chance = float(min(1.0, 2.0 * ndtr(-distance) * asked))
    axis = effect.axes[0] if isinstance(effect, PositionEffect) else ""
    return InstrumentFinding(kind, effect.where, axis, value, std_error, parameter.unit, chance, 2.0 * gain)


def _segments(found: Estimate, channel: str) -> list[int]:
    """The segments in which a channel is compared."""
    return [s for s, (_, name) in enumerate(found.design.segments) if name == channel]


def _moving_air(found: Estimate, settings: CompatibilitySettings) -> Iterator[MovingAir]:
    """The air along each axis where what its sensor leaves over the path is more than noise and lasts."""
    for axis, channel in SEES.items():
        seen: list[NDArray[np.float64]] = []
        noise, memories = 0.0, []
        for s in _segments(found, channel):
            recording = found.problem.recordings[found.design.segments[s][0]]
            manoeuvre = recording.manoeuvre
            across = manoeuvre.mean_airspeed if CHANNELS[channel].unit == "rad" else 1.0
            left = found.solution.residuals[found.design.rows(s)] * across
            kept = float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-300)
            step = recording.interval * recording.band.step
            memories.append(-step / float(np.log(np.clip(kept, 1e-3, 0.999))))
            noise = max(noise, float(manoeuvre.noise[manoeuvre.row(channel)]) * across)
            seen.append(left)
        if not seen:
            continue
        sigma, memory = float(np.std(np.concatenate(seen))), float(np.median(memories))
        if sigma > settings.above_the_noise * noise and memory > settings.gusts_last:
            speed = float(np.mean([each.manoeuvre.mean_airspeed for each in found.problem.recordings]))
            yield MovingAir(axis, sigma, memory * speed)


def _told_of_drift(slow: MovingAir) -> str:
    """What wanders too slowly for turbulence may be."""
    why = {
        "w": "a zero of alpha, a_z or q that changes, or air that rises and sinks.",
        "u": "a zero of a_x or theta that is no constant fault's, or wind that changes.",
    }
    return (
        f"{SEES[slow.axis]} and the path drift apart by {number(slow.sigma, 2)} m/s over {number(slow.length, 2)} m: "
        f"{why[slow.axis]}"
    )


def _channels(before: Estimate, after: Estimate, settings: CompatibilitySettings) -> Iterator[ChannelAgreement]:
    """Each channel of each log, all its stretches together."""
    for log, channel in dict.fromkeys((after.problem.recordings[n].name, name) for n, name in after.design.segments):
        own = [
            s for s in _segments(after, channel) if after.problem.recordings[after.design.segments[s][0]].name == log
        ]
        manoeuvre = after.problem.recordings[after.design.segments[own[0]][0]].manoeuvre
        alone, corrected = (
            float(np.sqrt(np.mean(np.concatenate([at.solution.residuals[at.design.rows(s)] for s in own]) ** 2)))
            for at in (before, after)
        )
        said = [whiteness(after.solution.whitened[after.design.rows(s)]) for s in own]
        white = all(each is None or each.p_value >= settings.coloured for each in said)
        noise = float(manoeuvre.noise[manoeuvre.row(channel)])
        yield ChannelAgreement(log, channel, CHANNELS[channel].unit, alone, corrected, noise, white)
