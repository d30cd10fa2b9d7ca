"""Faults of instruments that kinematics support without proving them, so that the coefficients may.

In moving air a vane's lateness, or the place of a lateral accelerometer, is a small part of what its kinematic equation
leaves, and a large part of what the coefficients leave. Coefficients alone accuse no instrument: a lift that follows
late looks the same to them, and a term of C_Y. Where the kinematics show the fault too, by two of their deviations and
with the same numbers, both together do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.candidates import (
    effect_candidates,
    joined,
    scores,
    to_first_order,
    told_apart,
    within_limits,
)
from aerosid.equation_error.channels import MEASURED_BY, VANE_OF
from aerosid.equation_error.deviations import corrected_covariance
from aerosid.equation_error.estimate import Estimate, estimate
from aerosid.equation_error.joint_timing import LATE
from aerosid.equation_error.selection import Selected, is_told

Array = NDArray[np.float64]

FORCE_ASIDE = "C_Y"
"""The coefficient that the place of its accelerometer bends, and that of the vane."""


@dataclass(frozen=True)
class SupportedFault:
    """The numbers of a fault as kinematics see them, (k,), SI, their covariance (k, k), and what they gain in ln L."""

    hypothesis: Hypothesis
    values: Array
    covariance: Array
    gain: float

    @property
    def credit(self) -> float:
        """Gain in ln L of kinematics that counts beside that of the coefficients; timings are joined later."""
        return 0.0 if self.hypothesis.kind in LATE else self.gain

    def agrees(self, found: Estimate) -> bool:
        """Whether the last effect of an estimate of the coefficients has the same numbers."""
        apart = np.array(found.point.effects[-1].values) - self.values
        return float(apart @ np.linalg.solve(self.covariance, apart)) <= found.frame.settings.agreement**2


def supported_faults(proved: Selected, sensors: Sequence[Hypothesis]) -> tuple[SupportedFault, ...]:
    """What kinematics see of instruments' lateness and of lateral instruments' places beside the proven faults."""
    base, support = proved.estimate, proved.estimate.frame.settings.support
    taken = {each.hypothesis.label for each in proved.chosen}
    aside = FORCE_ASIDE in base.point.model.axes.coefficients
    open_ = [
        h
        for h in sensors
        if (h.kind in LATE or (aside and _is_place_aside(h))) and h.label not in taken and not is_told(h, proved.chosen)
    ]
    candidates = effect_candidates(base.frame, base, open_)
    best: dict[tuple[str, ...], int] = {}
    gains = scores(base, candidates).gains
    for n in np.argsort(-gains):
        if gains[n] >= 0.5 * support:
            best.setdefault(told_apart(candidates[n].hypothesis), int(n))
    rows = []
    for n in best.values():
        trial, hypothesis = to_first_order(base, candidates[n])
        found = estimate(base.frame, joined(base.point, hypothesis), trial.weights, steps=5)
        active = found.point.effects[-1]
        covariance = corrected_covariance(found.design, found.solution)
        covariance = covariance[-len(active.values) :, -len(active.values) :]
        values, null = np.array(active.values), active.effect.parameters[0].null
        # Nothing is early; a place may lie to either side.
        shown = _is_place_aside(hypothesis) or values[0] - null > support * float(np.sqrt(covariance[0, 0]))
        if shown and within_limits(found, hypothesis) and found.gain_over(base) > support:
            rows.append(SupportedFault(candidates[n].hypothesis, values, covariance, found.gain_over(base)))
    return _fewest_axes(rows, support)


def _fewest_axes(rows: Sequence[SupportedFault], support: float) -> tuple[SupportedFault, ...]:
    """Of each instrument the place along the fewest axes that kinematics show as well, within a gain in ln L."""
    kept: list[SupportedFault] = []
    for row in sorted(rows, key=lambda row: (row.values.size, -row.gain)):
        if all(k.hypothesis.label != row.hypothesis.label or row.gain > k.gain + support for k in kept):
            kept.append(row)
    return tuple(kept)


def _is_place_aside(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis says where the lateral accelerometer or the vane of sideslip is."""
    where = (MEASURED_BY[FORCE_ASIDE], VANE_OF[FORCE_ASIDE])
    return hypothesis.where in where and isinstance(hypothesis.effects[0].effect, PositionEffect)
