"""Choice of the time origin: several channels that are early by one time, or the others late.

Timings of a recording are known against one another only. Where a search has named some channels early, the same
likelihood belongs to those channels on time and every other one late; and of these the slow ones show no lateness, so
that fewer faults may say the same. Recorders make channels late and not early.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import replaced
from aerosid.equation_error.selection.candidates import joined
from aerosid.equation_error.selection.deletion import Chosen, Selected, paid, without
from aerosid.equation_error.selection.joint_timing import LATE
from aerosid.equation_error.selection.prices import Rules, own_effects
from aerosid.equation_error.selection.stepwise import Admitted, backward, forward_steps

DELAY = "sensor_delay"
"""The kind whose number may have either sign."""

STEPS = 8
"""Numerical: Gauss-Newton steps at most from the other origin."""


def with_late_channels(
    selected: Selected,
    asked: Sequence[Hypothesis],
    rules: Rules,
    admitted: Admitted,
    told: Callable[[str], None] = lambda _text: None,
) -> Selected:
    """The structure with channels late in place of several early ones, where that is worth more, prices counted.

    Parameters
    ----------
    selected : Selected
        Faults of sensors, estimated from kinematic equations.
    asked : sequence of Hypothesis
        Faults of sensors that may be named.
    """
    early = [each for each in selected.chosen if each.hypothesis.kind == DELAY and _delay(selected, each) < 0.0]
    if len(early) < selected.estimate.frame.settings.fewest_early:
        return selected
    shift = -float(np.median([_delay(selected, each) for each in early]))
    begun = _from_other_origin(selected, early, shift, asked)
    found = backward(begun, rules)
    most = selected.estimate.frame.settings.most
    *_, found = forward_steps(found, rules, asked, kinematic=True, most=most, admitted=admitted)
    found = replaced(found, asked, rules, admitted)
    if paid(found, rules) <= paid(selected, rules):
        return selected
    told(f"  late in place of early: {[each.hypothesis.label for each in found.chosen]}")
    return found


def _delay(selected: Selected, each: Chosen) -> float:
    (active,) = own_effects(selected.estimate.point, each.hypothesis)
    return active.values[0]


def _from_other_origin(
    selected: Selected, early: Sequence[Chosen], shift: float, asked: Sequence[Hypothesis]
) -> Selected:
    """The structure whose early channels are on time, every other one later by the shift, s."""
    point = selected.estimate.point
    for each in early:
        point = without(point, each)
    point = replace(point, effects=tuple(_later(active, shift) for active in point.effects))
    chosen = [each for each in selected.chosen if each not in early]
    timed = {each.hypothesis.where for each in selected.chosen if each.hypothesis.kind in LATE}
    for hypothesis in asked:
        if hypothesis.kind == DELAY and hypothesis.where not in timed:
            (active,) = hypothesis.effects
            point = joined(point, replace(hypothesis, effects=(replace(active, values=(shift,)),)))
            chosen.append(Chosen(hypothesis, kinematic=True, gain=0.0))
    found = estimate(selected.estimate.frame, point, selected.estimate.solution.weights, STEPS)
    return Selected(found, tuple(chosen))


def _later(active: ActiveEffect, shift: float) -> ActiveEffect:
    """A timing that is free, later by the shift; any other effect as it is."""
    if active.effect.kind not in LATE or not active.values:
        return active
    return active.perturbed(0, shift)
