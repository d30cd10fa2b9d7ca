"""Delays and lags that kinematics support without proving them, so that the coefficients may.

In moving air a vane's lateness is a small part of what its kinematic equation leaves, and a large part of what the
coefficients leave. Coefficients alone accuse no instrument: a lift that follows late looks the same to them. Where the
kinematics show the lateness too, by two of their deviations and with the same number, both together do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.candidates import effect_candidates, joined, scores, to_first_order, within_limits
from aerosid.equation_error.deviations import corrected_covariance
from aerosid.equation_error.estimate import Estimate, estimate
from aerosid.equation_error.joint_timing import LATE
from aerosid.equation_error.selection import Selected, is_told


@dataclass(frozen=True)
class SupportedTiming:
    """A lateness as kinematics see it, s."""

    hypothesis: Hypothesis
    value: float
    std_error: float

    def agrees(self, found: Estimate) -> bool:
        """Whether the last effect of an estimate of the coefficients is as late as that."""
        return abs(found.point.effects[-1].values[0] - self.value) <= found.frame.settings.agreement * self.std_error


def supported_timings(proved: Selected, sensors: Sequence[Hypothesis]) -> tuple[SupportedTiming, ...]:
    """What kinematics see of instruments' lateness beside the proven faults."""
    base, support = proved.estimate, proved.estimate.frame.settings.support
    taken = {each.hypothesis.label for each in proved.chosen}
    open_ = [h for h in sensors if h.kind in LATE and h.label not in taken and not is_told(h, proved.chosen)]
    candidates = effect_candidates(base.frame, base, open_)
    best: dict[tuple[str, str, str], int] = {}
    gains = scores(base, candidates).gains
    for n in np.argsort(-gains):
        if gains[n] >= 0.5 * support:
            best.setdefault(candidates[n].hypothesis.label, int(n))
    rows = []
    for n in best.values():
        trial, hypothesis = to_first_order(base, candidates[n])
        found = estimate(base.frame, joined(base.point, hypothesis), trial.weights, steps=5)
        value, null = found.point.effects[-1].values[0], found.point.effects[-1].effect.parameters[0].null
        error = float(np.sqrt(corrected_covariance(found.design, found.solution)[-1, -1]))
        if within_limits(found, hypothesis) and value - null > support * error and found.gain_over(base) > support:
            rows.append(SupportedTiming(candidates[n].hypothesis, value, error))
    return tuple(rows)
