"""Time delays of instruments by kinematic and coefficient equations: which kind, what each gains, where they differ.

Kinematics hardly distinguish a delay from a lag, and in gusts show neither well; forces and moments do, where their
structure is correct.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.selection.alternatives import Alternative, replacements_of
from aerosid.equation_error.selection.joint_errors import (
    DELAY_KINDS,
    JointErrors,
    is_timing_of,
    joint_errors,
    kinematic_errors,
    with_errors_held,
)
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    estimate_without,
    structure_without,
)
from aerosid.equation_error.selection.wald_tests import least_significant


class JointGain(NamedTuple):
    """Gains in ln L of both kinds of equations by a time delay, and the coefficients' estimate without it.

    `kinematic` at the joint estimate.
    """

    kinematic: float
    coefficient: float
    coefficients_without: Estimate

    @property
    def total(self) -> float:
        """Of both kinds of equations."""
        return self.kinematic + self.coefficient


def joint_gain(
    identified: SelectedStructure, each: SelectedEffect, errors: JointErrors, coefficients: Estimate
) -> JointGain | None:
    """Gain in ln L of both kinds of equations by an identified time delay at its joint estimate; None of another error.

    Kinematics identify it at their own estimate. Where forces and moments shift it far from there, the kinematic gain
    is lost, and the joint fit may retain a delay that neither kind of equations supports.

    Parameters
    ----------
    identified : SelectedStructure
        The errors, from kinematics.
    each : SelectedEffect
        One of them.
    errors : JointErrors
        Their parameters from both.
    coefficients : Estimate
        Of the coefficient equations, its first effects the errors, fixed at `errors`.
    """
    if each.hypothesis.kind not in DELAY_KINDS:
        return None
    index, number = errors.indices_of(each.hypothesis)
    kinematic = kinematic_errors(identified.estimate)
    difference = errors.effects[index].values[0] - kinematic.effects[index].values[0]
    deviation = 0.5 * difference**2 / float(kinematic.covariance[number, number])
    effects = tuple(active for n, active in enumerate(coefficients.point.effects) if n != index)
    reduced = estimate(
        coefficients.problem, replace(coefficients.point, effects=effects), coefficients.solution.weights
    )
    kinematic_gain = identified.estimate.gain_over(estimate_without(identified, each)) - deviation
    return JointGain(kinematic_gain, coefficients.log_likelihood - reduced.log_likelihood, reduced)


@dataclass(frozen=True)
class _DelayModel:
    """One model of an instrument's time delay, with the joint estimate of all errors.

    `hypothesis` as selected by kinematics with its `gain` there; `deficit` in ln L to the one that they selected;
    `likelihood`: ln L of both kinds of equations.
    """

    hypothesis: Hypothesis
    gain: float
    deficit: float
    selected: SelectedStructure
    errors: JointErrors
    likelihood: float

    def as_alternative_to(self, best: _DelayModel, margin: float) -> Alternative:
        """As alternative of a likelier model, with its deficit in the kinematic equations that identified both."""
        active, error = self.errors.estimate_of(self.hypothesis)
        deficit = max(self.deficit - best.deficit, 0.0)
        return Alternative(
            self.hypothesis,
            active,
            active.values[0],
            error,
            self.gain,
            deficit,
            margin,
            best.hypothesis,
            self.selected.estimate,
        )


def likeliest_delay_kinds(
    identified: SelectedStructure,
    declared: Estimate,
    sensors: Sequence[Hypothesis],
) -> tuple[SelectedStructure, tuple[Alternative, ...]]:
    """The errors, each delay of the kind of highest joint likelihood, and the other kinds as alternatives.

    Kinematics hardly distinguish a delay from a lag; forces and moments do, where their structure is correct.

    Parameters
    ----------
    declared : Estimate
        Of the coefficient equations of the declared structure, its first effects the errors, fixed.
    sensors : sequence of Hypothesis
        Instrument errors that may replace one another.
    """
    cached: dict[tuple[tuple[object, ...], ...], tuple[JointErrors, float]] = {}

    def estimated(
        selected: SelectedStructure, hypothesis: Hypothesis, gain: float, deficit: float = 0.0
    ) -> _DelayModel:
        initial = kinematic_errors(selected.estimate)
        # The same errors are evaluated for each delayed channel.
        name = tuple(active.identity for active in initial.effects)
        if name not in cached:
            errors = joint_errors(selected.estimate, initial, _with_errors(declared, initial))
            cached[name] = errors, _with_errors(declared, errors).log_likelihood - errors.penalty
        errors, likelihood = cached[name]
        return _DelayModel(hypothesis, gain, deficit, selected, errors, likelihood - deficit)

    others: list[Alternative] = []
    margin = declared.problem.settings.alike_instruments
    for each in identified.chosen:
        if each.hypothesis.kind not in DELAY_KINDS:
            continue
        rest = tuple(other for other in identified.chosen if other is not each)
        current = estimated(identified, each.hypothesis, each.gain)
        models = [current]
        for row in replacements_of(identified, each, sensors):
            if is_timing_of(row.hypothesis, each.hypothesis.where):
                alternative = SelectedStructure(
                    row.estimate, (*rest, SelectedEffect(row.hypothesis, each.kinematic, row.gain))
                )
                models.append(estimated(alternative, row.hypothesis, row.gain, row.deficit))
        best = max(
            models,
            key=lambda model: model.likelihood - (0.0 if model is current else declared.problem.settings.clearly),
        )
        others.extend(model.as_alternative_to(best, margin) for model in models if model is not best)
        identified = best.selected
    # An error selected with a delay of the other kind may have compensated that kind.
    while (weak := least_significant(identified.estimate, identified.chosen)) is not None:
        identified = structure_without(identified, weak)
    names = set(identified.labels)
    return identified, tuple(row for row in others if row.replaces.label in names)


def _with_errors(declared: Estimate, errors: JointErrors) -> Estimate:
    """The declared structure's coefficients with the errors fixed at given values."""
    return estimate(declared.problem, with_errors_held(declared.point, errors.effects), declared.solution.weights)


@dataclass(frozen=True)
class DelayDiscrepancy:
    """Time delay of a channel by kinematics alone and by both kinds of equations, where these differ, s."""

    channel: str
    kinematic: ActiveEffect
    kinematic_std_error: float
    joint: ActiveEffect
    joint_std_error: float


def delay_discrepancies(identified: Estimate, errors: JointErrors, deviations: float) -> tuple[DelayDiscrepancy, ...]:
    """Channels whose joint time delay is of another kind or differs by more than some kinematic standard deviations.

    Parameters
    ----------
    identified : Estimate
        Of the kinematic equations, with the kinds that they selected.
    errors : JointErrors
        Of both kinds of equations.
    """
    kinematic = kinematic_errors(identified)
    rows = []
    before, after = (_timings(each) for each in (kinematic, errors))
    for channel in before.keys() & after.keys():
        if len(before[channel]) + len(after[channel]) > 2:
            continue  # a lag and a dead time have no kind in which they differ
        ((first, first_error),), ((second, second_error),) = before[channel], after[channel]
        further = abs(first.values[0] - second.values[0]) > deviations * first_error
        if further or first.effect.kind != second.effect.kind:
            rows.append(DelayDiscrepancy(channel, first, first_error, second, second_error))
    return tuple(sorted(rows, key=lambda row: row.channel))


def _timings(errors: JointErrors) -> dict[str, list[tuple[ActiveEffect, float]]]:
    """The estimated lag and delay of each channel, with the standard deviation."""
    deviations, index = np.sqrt(np.diag(errors.covariance)), 0
    rows: dict[str, list[tuple[ActiveEffect, float]]] = {}
    for active in errors.effects:
        if active.values and active.effect.kind in DELAY_KINDS:
            rows.setdefault(active.effect.where, []).append((active, float(deviations[index])))
        index += len(active.values)
    return rows
