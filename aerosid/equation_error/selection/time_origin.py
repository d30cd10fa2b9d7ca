"""Choice of the time origin: several channels early by the same time, or all others late.

Time delays of a record are identifiable only relative to one another. Where a search has found some channels early, the
likelihood is the same with those channels on time and every other one late; and among these the slow ones show no
delay, so that fewer errors may suffice. Recorders delay channels and do not advance them.

One early channel, as the rate of a recorder whose attitude and flow angle pass a slower bus, is fewer errors than two
late ones, by kinematics. Forces and moments tell them apart, because the controls have kept their time.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import with_replacements
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.instrument_error_choice import CoefficientCheck
from aerosid.equation_error.selection.joint_errors import DELAY, DELAY_KINDS
from aerosid.equation_error.selection.penalties import SelectionCriterion, effects_of
from aerosid.equation_error.selection.stepwise import Admitted, eliminate_by_penalty, forward_selection
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    first_order_loss,
    penalised_likelihood,
    point_without,
    structure_without,
)

PREFERENCE = 50.0
"""Design: gain in ln L, 1, by which all equations together must prefer late channels where kinematics prefer an early
one. Four penalties: the declared structure that judges may lack much else. Looked at: eleven pairs with attitude and
flow angle late by .08 to .15 s, 170 to 750; a stall whose declared moment explains nothing, 21."""

STEPS = 8
"""Numerical: Gauss-Newton steps at most from the other time origin."""


def with_other_time_origin(
    selected: SelectedStructure,
    by_kinematics: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
    admitted: Admitted,
    coefficients: CoefficientCheck | None,
) -> SelectedStructure:
    """The structure with late channels in place of early ones, where its penalised likelihood is higher.

    Parameters
    ----------
    selected : SelectedStructure
        Instrument errors, estimated from kinematic equations.
    by_kinematics : SelectedStructure
        The same with those to which the coefficients object.
    hypotheses : sequence of Hypothesis
        Candidate instrument errors.
    coefficients : CoefficientCheck, optional
        Whose likelihood counts as well where a single channel is early, where they object, and where the kinematic
        equations alone prefer several early channels; without them, as of an aircraft without derivatives, these stay
        early.
    """
    early = [each for each in by_kinematics.chosen if each.hypothesis.kind == DELAY and _delay(by_kinematics, each) < 0]
    if not early:
        return selected
    shift = -float(np.median([_delay(by_kinematics, each) for each in early]))
    alone = len(early) < selected.estimate.problem.settings.fewest_early
    if coefficients is None and alone:
        return selected
    initial = _from_other_origin(by_kinematics, early, shift, hypotheses)
    if coefficients is not None and (alone or by_kinematics is not selected):
        return _likelier_by_all_equations(selected, initial, criterion, coefficients)
    found = eliminate_by_penalty(initial, criterion)
    most = selected.estimate.problem.settings.most
    path = forward_selection(found, criterion, hypotheses, kinematic=True, most=most, admitted=admitted)
    found = max(path, key=lambda each: penalised_likelihood(each, criterion))
    found = with_replacements(found, hypotheses, criterion, admitted)
    if penalised_likelihood(found, criterion) > penalised_likelihood(selected, criterion):
        return found
    return selected if coefficients is None else _likelier_by_all_equations(selected, initial, criterion, coefficients)


def _likelier_by_all_equations(
    selected: SelectedStructure,
    initial: SelectedStructure,
    criterion: SelectionCriterion,
    coefficients: CoefficientCheck,
) -> SelectedStructure:
    """The structure, or the likeliest by both kinds of equations of those with fewer and fewer late channels."""

    def total(each: SelectedStructure) -> float:
        return penalised_likelihood(each, criterion) + coefficients.log_likelihood(each.estimate)

    path = [initial]
    late = [each for each in initial.chosen if each not in selected.chosen]
    while late:
        least = min(late, key=functools.partial(first_order_loss, path[-1]))
        path.append(structure_without(path[-1], least))
        late.remove(least)
    totals = [total(each) for each in path]
    best = max(totals)
    return path[totals.index(best)] if best - total(selected) > PREFERENCE else selected


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
    point = _later(point, shift)
    chosen = [each for each in selected.chosen if each not in early]
    timed = {each.hypothesis.where for each in selected.chosen if each.hypothesis.kind in DELAY_KINDS}
    for hypothesis in hypotheses:
        if hypothesis.kind == DELAY and hypothesis.where not in timed:
            (active,) = hypothesis.effects
            point = with_hypothesis(point, replace(hypothesis, effects=(replace(active, values=(shift,)),)))
            chosen.append(SelectedEffect(hypothesis, kinematic=True, gain=0.0))
    found = estimate(selected.estimate.problem, point, selected.estimate.solution.weights, STEPS)
    return SelectedStructure(found, tuple(chosen))


def _later(point: Point, shift: float) -> Point:
    """The point with every free delay increased by the shift, s; of a lag and a delay of one channel the delay."""
    delayed = {each.effect.where for each in point.effects if each.effect.kind == DELAY and each.values}

    def moved(active: ActiveEffect) -> ActiveEffect:
        is_delay = active.effect.kind == DELAY or active.effect.where not in delayed
        if active.effect.kind not in DELAY_KINDS or not active.values or not is_delay:
            return active
        return active.perturbed(0, shift)

    return replace(point, effects=tuple(map(moved, point.effects)))
