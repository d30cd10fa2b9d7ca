"""Results of the data compatibility check from instrument errors identified by the kinematic equations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from aerosid.compatibility.agreement import (
    Agreement,
    ChannelAgreement,
    InstrumentFinding,
    KinematicConsistency,
    MovingAir,
    findings_sentence,
)
from aerosid.compatibility.settings import USUAL
from aerosid.effects import ActiveEffect
from aerosid.effects.kinds import axes_of
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.alternatives import gains_by_deletion
from aerosid.equation_error.selection.candidates import is_instrument_error
from aerosid.equation_error.selection.competing_alternatives import competing_alternatives
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.wald_tests import effect_estimates
from aerosid.flight_model.constants import GRAVITY
from aerosid.nomenclature import CHANNELS
from aerosid.notation import number
from aerosid.signals.autoregression import correlation_time
from aerosid.signals.fit_statistics import whiteness

OBSERVED_BY = {"w": "alpha", "u": "V"}
"""The sensor that measures turbulence along each body axis."""


def agreement_of(instrument_errors: InstrumentErrors, notes: tuple[str, ...] = ()) -> KinematicConsistency:
    """The data compatibility result from the identified instrument errors of all recordings.

    Residuals are those of the channels in the band of the motion.
    """
    selected = instrument_errors.selected
    found = selected.estimate
    covariance = corrected_covariance(found.design, found.solution)
    tested = len(instrument_errors.hypotheses)
    rows = effect_estimates(found, covariance, selected.chosen, gains_by_deletion(selected))
    findings = tuple(
        _finding(row.hypothesis.kind, row.active, row.value, row.std_error, row.gain, tested) for row in rows
    )
    others: dict[tuple[str, str, str], list[InstrumentFinding]] = {}
    for other in competing_alternatives(
        selected, [hypothesis for hypothesis in instrument_errors.hypotheses if is_instrument_error(hypothesis)]
    ):
        alternative = _finding(other.hypothesis.kind, other.active, other.value, other.std_error, other.gain, tested)
        others.setdefault(other.replaces.label, []).append(alternative)
    groups = tuple(
        (finding, *alternatives)
        for row, finding in zip(rows, findings, strict=True)
        if (alternatives := _named_otherwise(finding, others.get(row.hypothesis.label, [])))
    )
    turbulence = tuple(_moving_air(found))
    air = tuple(each for each in turbulence if each.length <= USUAL.longest_scale)
    notes = (*notes, *(_note_on_drift(each, found) for each in turbulence if each not in air))
    return KinematicConsistency(
        tuple(dict.fromkeys(recording.name for recording in found.problem.recordings)),
        Agreement.CORRECTED if findings else Agreement.CONSISTENT,
        findings,
        groups,
        air,
        tuple(_channels(instrument_errors.declared, found)),
        findings_sentence(findings, groups, air),
        notes,
    )


def _finding(
    kind: str, active: ActiveEffect | None, value: float, std_error: float, gain: float, tested: int
) -> InstrumentFinding:
    assert active is not None  # instrument errors are effects
    effect, parameter = active.effect, active.effect.parameters[0]
    distance = abs(value - parameter.null) / std_error if std_error > 0.0 else np.inf
    chance = float(min(1.0, 2.0 * ndtr(-distance) * tested))
    return InstrumentFinding(
        kind, effect.where, axes_of(active)[:1], value, std_error, parameter.unit, chance, 2.0 * gain
    )


def _named_otherwise(
    finding: InstrumentFinding, alternatives: Sequence[InstrumentFinding]
) -> tuple[InstrumentFinding, ...]:
    """Alternatives named otherwise than the finding: of each name that of largest gain, in the order of first mention.

    A position along one axis alone and along two, of which the first is reported, have one name.
    """
    best: dict[tuple[str, str, str], InstrumentFinding] = {}
    for each in alternatives:
        key = each.kind, each.where, each.axis
        if key not in best or each.likelihood_gain > best[key].likelihood_gain:
            best[key] = each
    best.pop((finding.kind, finding.where, finding.axis), None)
    return tuple(best.values())


def _segments(found: Estimate, channel: str) -> list[int]:
    """The segments in which a channel is compared."""
    return [s for s, (_, name) in enumerate(found.design.segments) if name == channel]


def _moving_air(found: Estimate) -> Iterator[MovingAir]:
    """Turbulence along each axis whose sensor has a residual above noise and of sufficient memory."""
    for axis, channel in OBSERVED_BY.items():
        residuals: list[NDArray[np.float64]] = []
        noise, memories = 0.0, []
        for s in _segments(found, channel):
            recording = found.problem.recordings[found.design.segments[s][0]]
            manoeuvre = recording.manoeuvre
            across = manoeuvre.mean_airspeed if CHANNELS[channel].unit == "rad" else 1.0
            remaining = found.solution.residuals[found.design.rows(s)] * across
            memories.append(correlation_time(remaining, recording.interval * recording.band.step))
            noise = max(noise, float(manoeuvre.noise[manoeuvre.row(channel)]) * across)
            residuals.append(remaining)
        if not residuals:
            continue
        sigma, memory = float(np.std(np.concatenate(residuals))), float(np.median(memories))
        if sigma > USUAL.above_the_noise * noise and memory > USUAL.gusts_last:
            speed = float(np.mean([each.manoeuvre.mean_airspeed for each in found.problem.recordings]))
            yield MovingAir(axis, sigma, memory * speed)


def _note_on_drift(drift: MovingAir, found: Estimate) -> str:
    """Possible causes of a low-frequency drift, too slow for turbulence."""
    causes = {
        "w": "a varying bias of alpha, a_z or q, or vertical wind that changes.",
        "u": f"a varying bias of a_x or theta, or wind that changes. {equivalent_biases(found)}",
    }
    return (
        f"{OBSERVED_BY[drift.axis]} and the path drift apart by {number(drift.sigma, 2)} m/s over "
        f"{number(drift.length, 2)} m: {causes[drift.axis]}"
    )


def equivalent_biases(found: Estimate) -> str:
    """Constant bias of a_x, or of theta, that is equivalent to the mean drift of airspeed of each record.

    The slope s of measured minus integrated airspeed is that of a bias -s of a_x, or s/g of theta.
    """
    equivalent = []
    for s in _segments(found, OBSERVED_BY["u"]):
        recording = found.problem.recordings[found.design.segments[s][0]]
        residual = found.solution.residuals[found.design.rows(s)]
        time = recording.interval * recording.band.step * np.arange(residual.size)
        slope, level = np.polyfit(time, residual, 1)
        share = 1.0 - float(np.var(residual - slope * time - level) / max(float(np.var(residual)), 1e-300))
        equivalent.append(
            f"{number(-slope, 2)} m/s² of a_x or {number(slope / GRAVITY, 2)} rad of theta "
            f"({100.0 * share:.0f} % of the variance of {recording.name})"
        )
    return f"A constant bias equivalent to the mean drift: {'; '.join(equivalent)}."


def _channels(before: Estimate, after: Estimate) -> Iterator[ChannelAgreement]:
    """Each channel of each log, all its stretches together."""
    for log, channel in dict.fromkeys((after.problem.recordings[n].name, name) for n, name in after.design.segments):
        own = [
            s for s in _segments(after, channel) if after.problem.recordings[after.design.segments[s][0]].name == log
        ]
        manoeuvre = after.problem.recordings[after.design.segments[own[0]][0]].manoeuvre
        before_rms, after_rms = (
            float(np.sqrt(np.mean(np.concatenate([at.solution.residuals[at.design.rows(s)] for s in own]) ** 2)))
            for at in (before, after)
        )
        tests = [whiteness(after.solution.whitened[after.design.rows(s)]) for s in own]
        white = all(each is None or each.p_value >= USUAL.coloured for each in tests)
        noise = float(manoeuvre.noise[manoeuvre.row(channel)])
        yield ChannelAgreement(log, channel, CHANNELS[channel].unit, before_rms, after_rms, noise, white)
