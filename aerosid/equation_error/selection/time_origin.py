"""Choice of the time origin: several channels early by the same time, or all others late.

Time delays of a record are identifiable only relative to one another. Where a search has found some channels early, the
likelihood is the same with those channels on time and every other one late; and among these the slow ones show no
delay, so that fewer errors may suffice. Recorders delay channels and do not advance them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import with_replacements
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.joint_errors import DELAY_KINDS
from aerosid.equation_error.selection.penalties import SelectionCriterion, effects_of
from aerosid.equation_error.selection.stepwise import Admitted, eliminate_by_penalty, forward_selection
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    penalised_likelihood,
    point_without,
)

DELAY = "sensor_delay"
"""The kind whose parameter may have either sign."""

STEPS = 8
"""Numerical: Gauss-Newton steps at most from the other time origin."""


def with_other_time_origin(
    selected: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
    admitted: Admitted,
) -> SelectedStructure:
    """The structure with late channels in place of several early ones, where its penalised likelihood is higher.

    Parameters
    ----------
    selected : SelectedStructure
        Instrument errors, estimated from kinematic equations.
    hypotheses : sequence of Hypothesis
        Candidate instrument errors.
    """
    early = [each for each in selected.chosen if each.hypothesis.kind == DELAY and _delay(selected, each) < 0.0]
    if len(early) < selected.estimate.problem.settings.fewest_early:
        return selected
    shift = -float(np.median([_delay(selected, each) for each in early]))
    initial = _from_other_origin(selected, early, shift, hypotheses)
    found = eliminate_by_penalty(initial, criterion)
    most = selected.estimate.problem.settings.most
    path = forward_selection(found, criterion, hypotheses, kinematic=True, most=most, admitted=admitted)
    found = max(path, key=lambda each: penalised_likelihood(each, criterion))
    found = with_replacements(found, hypotheses, criterion, admitted)
    if penalised_likelihood(found, criterion) <= penalised_likelihood(selected, criterion):
        return selected
    return found


def _delay(selected: SelectedStructure, each: SelectedEffect) -> float:
    (active,) = effects_of(selected.estimate.point, each.hypothesis)
    return active.values[0]


def _from_other_origin(
    selected: SelectedStructure, early: Sequence[SelectedEffect], shift: float, hypotheses: Sequence[Hypothesis]
) -> SelectedStructure:
    """The structure with its early channels on time and every other one later by the shift, s."""
    point = selected.estimate.point
    for each in early:
        point = point_without(point, each.hypothesis)
    point = replace(point, effects=tuple(_later(active, shift) for active in point.effects))
    chosen = [each for each in selected.chosen if each not in early]
    timed = {each.hypothesis.where for each in selected.chosen if each.hypothesis.kind in DELAY_KINDS}
    for hypothesis in hypotheses:
        if hypothesis.kind == DELAY and hypothesis.where not in timed:
            (active,) = hypothesis.effects
            point = with_hypothesis(point, replace(hypothesis, effects=(replace(active, values=(shift,)),)))
            chosen.append(SelectedEffect(hypothesis, kinematic=True, gain=0.0))
    found = estimate(selected.estimate.problem, point, selected.estimate.solution.weights, STEPS)
    return SelectedStructure(found, tuple(chosen))


def _later(active: ActiveEffect, shift: float) -> ActiveEffect:
    """A free delay increased by the shift; any other effect unchanged."""
    if active.effect.kind not in DELAY_KINDS or not active.values:
        return active
    return active.perturbed(0, shift)
