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
    effect_candidates,
    joined,
    scores,
    to_first_order,
    told_apart,
    within_limits,
)
from aerosid.equation_error.selection.joint_time_delays import LATE
from aerosid.equation_error.selection.penalties import Name, Support
from aerosid.equation_error.selection.redundancy import open_beside
from aerosid.equation_error.selection.structure import Selected
from aerosid.flight_model.axes import LONGITUDINAL, Axes

FORCE_ASIDE = "C_Y"
"""The coefficient that the place of its accelerometer bends, and that of the vane."""


def supported_faults(proved: Selected, sensors: Sequence[Hypothesis]) -> dict[Name, Support]:
    """What kinematics see of sensors' faults beside the proven ones, by what tells these apart."""
    base, support = proved.estimate, proved.estimate.frame.settings.support
    axes = base.point.model.axes
    open_ = open_beside([h for h in sensors if _is_asked(h, axes)], proved.chosen)
    candidates = effect_candidates(base.frame, base, open_)
    best: dict[Name, int] = {}
    gains = scores(base, candidates).gains
    for n in np.argsort(-gains):
        if gains[n] >= 0.5 * support or bends_all(candidates[n].hypothesis):
            best.setdefault(told_apart(candidates[n].hypothesis), int(n))

    def fitted(n: int) -> Support | None:
        trial, hypothesis = to_first_order(base, candidates[n])
        found = estimate(base.frame, joined(base.point, hypothesis), trial.weights, steps=5)
        active, gain = found.point.effects[-1], found.gain_over(base)
        covariance = corrected_covariance(found.design, found.solution)
        covariance = covariance[-len(active.values) :, -len(active.values) :]
        off = active.values[0] - active.effect.parameters[0].null
        # Nothing is early; a place may lie along any axis, and its gain counts them together.
        off = off if hypothesis.kind in LATE else abs(off)
        shown = _is_place_aside(hypothesis) or off > support * float(np.sqrt(covariance[0, 0]))
        shown = (shown and gain > support) or bends_all(hypothesis)
        if not (shown and within_limits(found, hypothesis)):
            return None
        # A lift that follows late looks like a late vane: a timing pays its price in the coefficients by itself.
        return Support(active.values, covariance, gain, 0.0 if hypothesis.kind in LATE else gain)

    fits = mapped(fitted, list(best.values()))
    seen = {name: fit for name, fit in zip(best, fits, strict=True) if fit is not None}
    return _fewest_axes(seen, support) | _unseen_places(proved, open_)


def _unseen_places(proved: Selected, open_: Sequence[Hypothesis]) -> dict[Name, Support]:
    """Places of the lateral accelerometer where no vane shows sideslip: kinematics can say nothing of them."""
    if VANE_OF[FORCE_ASIDE] in {channel for _, channel in proved.estimate.design.segments}:
        return {}
    found = {}
    for hypothesis in open_:
        if hypothesis.where == MEASURED_BY[FORCE_ASIDE]:
            values = hypothesis.effects[0].values
            nothing = np.diag(np.full(len(values), np.inf))
            found[told_apart(hypothesis)] = Support(values, nothing, 0.0, 0.0)
    return found


def bends_all(hypothesis: Hypothesis) -> bool:
    """Whether a fault bends every coefficient by one number, as no term does: all are forces over dynamic pressure."""
    return (hypothesis.kind, hypothesis.where) == ("sensor_bias", "V")


def _is_asked(hypothesis: Hypothesis, axes: Axes) -> bool:
    """Whether coefficients may be asked of a fault.

    Where sideslip is compared, lateness and the places of its instruments alone: the wind bends the rest.
    """
    aside = FORCE_ASIDE in axes.coefficients and _is_place_aside(hypothesis)
    return axes == LONGITUDINAL or hypothesis.kind in LATE or aside


def _fewest_axes(seen: Mapping[Name, Support], support: float) -> dict[Name, Support]:
    """Of each instrument the place along the fewest axes that kinematics show as well, within a gain in ln L."""
    kept: dict[Name, Support] = {}
    for name, row in sorted(seen.items(), key=lambda item: (len(item[1].values), -item[1].gain)):
        if all(k[:3] != name[:3] or row.gain > other.gain + support for k, other in kept.items()):
            kept[name] = row
    return kept


def _is_place_aside(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis says where the lateral accelerometer or the vane of sideslip is."""
    where = (MEASURED_BY[FORCE_ASIDE], VANE_OF[FORCE_ASIDE])
    return hypothesis.where in where and isinstance(hypothesis.effects[0].effect, PositionEffect)
