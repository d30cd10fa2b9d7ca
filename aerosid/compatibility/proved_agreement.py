"""Data compatibility from the kinematic equations that decide: the proved faults told as the instruments' agreement."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from aerosid.compatibility.consistency import (
    Agreement,
    ChannelAgreement,
    InstrumentFinding,
    KinematicConsistency,
    told,
)
from aerosid.compatibility.fault_search import DEFAULT, SearchSettings
from aerosid.effects import ActiveEffect, PositionEffect
from aerosid.equation_error.alternatives import alternatives_of, worth_of
from aerosid.equation_error.candidates import of_sensors
from aerosid.equation_error.deviations import corrected_covariance
from aerosid.equation_error.estimate import Estimate, estimate
from aerosid.equation_error.evidence import findings_of
from aerosid.equation_error.proved_faults import ProvedFaults
from aerosid.nomenclature import CHANNELS
from aerosid.signals.fit_statistics import whiteness


def agreement_of(faults: ProvedFaults, settings: SearchSettings = DEFAULT) -> KinematicConsistency:
    """What the proved faults say of the instruments of all recordings, in the terms of the instruments' check.

    Residuals are those of the channels in the band of the motion; moving air is told by vane and lift together, which
    are not asked here.
    """
    selected = faults.selected
    found = selected.estimate
    covariance = corrected_covariance(found.design, found.solution)
    asked = len(faults.asked)
    rows = findings_of(found, covariance, selected.chosen, worth_of(selected))
    findings = tuple(
        _finding(row.hypothesis.kind, row.active, row.value, row.std_error, row.gain, asked) for row in rows
    )
    others: dict[tuple[str, str, str], list[InstrumentFinding]] = {}
    for other in alternatives_of(selected, [hypothesis for hypothesis in faults.asked if of_sensors(hypothesis)]):
        said = _finding(other.hypothesis.kind, other.active, other.value, other.std_error, other.gain, asked)
        others.setdefault(other.instead_of.label, []).append(said)
    groups = tuple(
        (finding, *others[row.hypothesis.label])
        for row, finding in zip(rows, findings, strict=True)
        if row.hypothesis.label in others
    )
    return KinematicConsistency(
        tuple(recording.name for recording in found.frame.recordings),
        Agreement.CORRECTED if findings else Agreement.CONSISTENT,
        findings,
        groups,
        (),
        _channels(estimate(found.frame, faults.start), found, settings),
        told(findings, groups, ()),
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


def _channels(before: Estimate, after: Estimate, settings: SearchSettings) -> tuple[ChannelAgreement, ...]:
    rows = []
    for s, (place, name) in enumerate(after.design.segments):
        manoeuvre = after.frame.recordings[place].manoeuvre
        alone, corrected = (
            float(np.sqrt(np.mean(at.solution.residuals[at.design.rows(s)] ** 2))) for at in (before, after)
        )
        said = whiteness(after.solution.whitened[after.design.rows(s)])
        rows.append(
            ChannelAgreement(
                manoeuvre.name,
                name,
                CHANNELS[name].unit,
                alone,
                corrected,
                float(manoeuvre.noise[manoeuvre.row(name)]),
                said is None or said.p_value >= settings.coloured,
            )
        )
    return tuple(rows)
