"""Sensor faults that kinematic and coefficient equations show together, neither of them by itself.

In moving air a vane's lateness, a pitot tube's bias or the place of a lateral accelerometer is a small part of what its
kinematic equation leaves, and a large part of what the coefficients leave. Coefficients alone accuse no instrument: a
lift that follows late looks the same to them. Where the kinematics show the fault too, with the same numbers, the
likelihoods of both are one product (independent measurements; Klein & Morelli, Aircraft System Identification,
eq. 5.31). A bias of airspeed alone is asked for where kinematics say nothing of it, and has to agree with them: it
bends every coefficient by one number, for which terms would need one each. The place of the lateral accelerometer is
asked of the coefficients alone where no vane shows sideslip: there its path is the accelerometer's own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from aerosid.compiled.cores import mapped
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.channels import MEASURED_BY, VANE_OF
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.candidates import (
    distinct_name,
    effect_candidates,
    linearised,
    score_candidates,
    with_hypothesis,
    within_limits,
)
from aerosid.equation_error.selection.joint_time_delays import DELAY_KINDS
from aerosid.equation_error.selection.penalties import KinematicEvidence, Name
from aerosid.equation_error.selection.redundancy import non_redundant
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.flight_model.axes import LONGITUDINAL, Axes

SIDE_FORCE = "C_Y"
"""The coefficient that the place of its accelerometer bends, and that of the vane."""


def kinematic_evidence(identified: SelectedStructure, sensors: Sequence[Hypothesis]) -> dict[Name, KinematicEvidence]:
    """What kinematics see of sensors' faults beside the proven ones, by what tells these apart."""
    base, support = identified.estimate, identified.estimate.problem.settings.support
    axes = base.point.model.axes
    eligible = non_redundant([h for h in sensors if _is_eligible(h, axes)], identified.chosen)
    candidates = effect_candidates(base.problem, base, eligible)
    best: dict[Name, int] = {}
    gains = score_candidates(base, candidates).gains
    for n in np.argsort(-gains):
        if gains[n] >= 0.5 * support or affects_all_coefficients(candidates[n].hypothesis):
            best.setdefault(distinct_name(candidates[n].hypothesis), int(n))

    def fitted(n: int) -> KinematicEvidence | None:
        trial, hypothesis = linearised(base, candidates[n])
        found = estimate(base.problem, with_hypothesis(base.point, hypothesis), trial.weights, steps=5)
        active, gain = found.point.effects[-1], found.gain_over(base)
        covariance = corrected_covariance(found.design, found.solution)
        covariance = covariance[-len(active.values) :, -len(active.values) :]
        distance = active.values[0] - active.effect.parameters[0].null
        # Nothing is early; a place may lie along any axis, and its gain counts them together.
        distance = distance if hypothesis.kind in DELAY_KINDS else abs(distance)
        is_significant = _is_lateral_position(hypothesis) or distance > support * float(np.sqrt(covariance[0, 0]))
        is_significant = (is_significant and gain > support) or affects_all_coefficients(hypothesis)
        if not (is_significant and within_limits(found, hypothesis)):
            return None
        # A lift that follows late looks like a late vane: a timing pays its price in the coefficients by itself.
        return KinematicEvidence(active.values, covariance, gain, 0.0 if hypothesis.kind in DELAY_KINDS else gain)

    fits = mapped(fitted, list(best.values()))
    evidence = {name: fit for name, fit in zip(best, fits, strict=True) if fit is not None}
    return _fewest_axes(evidence, support) | _unobserved_positions(identified, eligible)


def _unobserved_positions(
    identified: SelectedStructure, eligible: Sequence[Hypothesis]
) -> dict[Name, KinematicEvidence]:
    """Places of the lateral accelerometer where no vane shows sideslip: kinematics can say nothing of them."""
    if VANE_OF[SIDE_FORCE] in {channel for _, channel in identified.estimate.design.segments}:
        return {}
    found = {}
    for hypothesis in eligible:
        if hypothesis.where == MEASURED_BY[SIDE_FORCE]:
            values = hypothesis.effects[0].values
            unbounded = np.diag(np.full(len(values), np.inf))
            found[distinct_name(hypothesis)] = KinematicEvidence(values, unbounded, 0.0, 0.0)
    return found


def affects_all_coefficients(hypothesis: Hypothesis) -> bool:
    """Whether a fault bends every coefficient by one number, as no term does: all are forces over dynamic pressure."""
    return (hypothesis.kind, hypothesis.where) == ("sensor_bias", "V")


def _is_eligible(hypothesis: Hypothesis, axes: Axes) -> bool:
    """Whether coefficients may be asked of a fault.

    Where sideslip is compared, lateness and the places of its instruments alone: the wind bends the rest.
    """
    aside = SIDE_FORCE in axes.coefficients and _is_lateral_position(hypothesis)
    return axes == LONGITUDINAL or hypothesis.kind in DELAY_KINDS or aside


def _fewest_axes(evidence: Mapping[Name, KinematicEvidence], support: float) -> dict[Name, KinematicEvidence]:
    """Of each instrument the place along the fewest axes that kinematics show as well, within a gain in ln L."""
    retained: dict[Name, KinematicEvidence] = {}
    for name, row in sorted(evidence.items(), key=lambda item: (len(item[1].values), -item[1].gain)):
        if all(k[:3] != name[:3] or row.gain > other.gain + support for k, other in retained.items()):
            retained[name] = row
    return retained


def _is_lateral_position(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis says where the lateral accelerometer or the vane of sideslip is."""
    where = (MEASURED_BY[SIDE_FORCE], VANE_OF[SIDE_FORCE])
    return hypothesis.where in where and isinstance(hypothesis.effects[0].effect, PositionEffect)
