"""Joint estimation of instrument time delays and lags from kinematic and coefficient equations.

Kinematics establish that an instrument is late; in moving air they determine the delay only roughly, since the gusts at
a vane are no motion of the aircraft. The coefficients relate the same delay to forces and moments, which respond to the
same gusts. Both are combined as independent measurements: Gauss-Newton on the coefficients' likelihood with the
kinematic estimate as prior (Bayes; Klein & Morelli, Aircraft System Identification, eq. 5.31).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, PositionEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import MEASURED_BY
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import compared_columns
from aerosid.equation_error.regression.estimate import (
    Estimate,
    effect_sensitivities,
    estimate,
    linear_values,
)
from aerosid.equation_error.regression.parameter_limits import free_parameters
from aerosid.equation_error.regression.standard_errors import corrected_covariance, covariance_of_scores
from aerosid.equation_error.selection.alternatives import Alternative, replacements_of
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    estimate_without,
    structure_without,
)
from aerosid.equation_error.selection.wald_tests import least_significant

Array = NDArray[np.float64]

DELAY_KINDS = frozenset({"sensor_delay", "sensor_lag"})
"""Kinds whose parameter is the time by which a channel is late."""

STEPS = 6
"""Numerical: Gauss-Newton steps at most."""

HALVINGS = 4
"""Numerical: times that a step is halved before the search ends at the current point."""

SETTLED = 0.1
"""Numerical: standard deviations, 1, of a step that counts as converged."""


@dataclass(frozen=True)
class JointDelays:
    """Instrument errors with the time delays estimated jointly from both kinds of equations.

    Attributes
    ----------
    effects : tuple of ActiveEffect
        All identified errors, the time delays at their joint estimate.
    covariance : ndarray, shape (n, n)
        Of all their parameters, in order.
    penalty : float
        Reduction of ln L by their distance from the kinematic estimate.
    """

    effects: tuple[ActiveEffect, ...]
    covariance: Array
    penalty: float


def kinematic_delays(identified: Estimate) -> JointDelays:
    """The instrument errors as estimated by kinematics alone."""
    indices = [identified.design.unknowns.index(("effect", i, k)) for i, k in free_parameters(identified.point.effects)]
    covariance = corrected_covariance(identified.design, identified.solution)[np.ix_(indices, indices)]
    return JointDelays(identified.point.effects, covariance, 0.0)


def joint_delays(identified: Estimate, initial: JointDelays, found: Estimate) -> JointDelays:
    """The delays at the maximum of the joint likelihood; other errors follow by their correlation.

    Parameters
    ----------
    identified : Estimate
        Of the kinematic equations.
    initial : JointDelays
        Starting values.
    found : Estimate
        Of the coefficient equations, its first effects the identified errors, fixed at `initial`.
    """
    parameters = free_parameters(identified.point.effects)
    delayed = [n for n, (i, _) in enumerate(parameters) if is_estimated_jointly(identified.point.effects[i])]
    if not delayed:
        return initial
    kinematic = kinematic_delays(identified).covariance
    known = kinematic[np.ix_(delayed, delayed)]
    if not np.all(np.isfinite(known)) or np.linalg.matrix_rank(known) < len(delayed):
        return initial  # the kinematic covariance is singular: no prior
    prior = np.linalg.inv(known)
    follow = kinematic[:, delayed] @ prior
    mean = free_values(identified.point.effects)
    deviation = (free_values(initial.effects) - mean)[delayed]
    effects = initial.effects
    covariance = known

    def objective(found: Estimate, deviation: Array) -> float:
        return found.log_likelihood - 0.5 * float(deviation @ prior @ deviation)

    for _ in range(STEPS):
        information, score = _information(found, effects, parameters, follow)
        covariance = np.linalg.inv(information + prior)
        step = covariance @ (score - prior @ deviation)
        if np.all(np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))):
            break
        best = objective(found, deviation)
        for halving in range(HALVINGS):
            aim = deviation + 0.5**halving * step
            trial = _moved_to(identified.point.effects, mean + follow @ aim)
            aim = (free_values(trial) - mean)[delayed]
            moved = estimate(found.problem, with_errors_held(found.point, trial), found.solution.weights, steps=2)
            if objective(moved, aim) > best:
                effects, deviation, found = trial, aim, moved
                break
        else:
            break
    joint = kinematic - follow @ (known - covariance) @ follow.T
    return JointDelays(effects, joint, 0.5 * float(deviation @ prior @ deviation))


def is_estimated_jointly(active: ActiveEffect) -> bool:
    """Whether an instrument error is estimated from both kinds of equations: a time delay, or a place that a_y shows.

    Kinematics show the distance of an accelerometer from a vane in the integral of what it reads, and forces in that
    itself: of a unit 0.3 m below its declared place the latter are twenty times as accurate. In pitch alone they are
    not heard: a_z reads the pitching acceleration, which C_m makes of the variables that C_Z is made of.
    """
    effect = active.effect
    return effect.kind in DELAY_KINDS or (isinstance(effect, PositionEffect) and effect.moves(MEASURED_BY["C_Y"]))


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
    identified: SelectedStructure, each: SelectedEffect, delays: JointDelays, coefficients: Estimate
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
    delays : JointDelays
        Their parameters from both.
    coefficients : Estimate
        Of the coefficient equations, its first effects the errors, fixed at `delays`.
    """
    if each.hypothesis.kind not in DELAY_KINDS:
        return None
    name = each.hypothesis.effects[0].name
    index = next(n for n, active in enumerate(delays.effects) if active.values and active.name == name)
    number = sum(len(active.values) for active in delays.effects[:index])
    kinematic = kinematic_delays(identified.estimate)
    difference = delays.effects[index].values[0] - kinematic.effects[index].values[0]
    deviation = 0.5 * difference**2 / float(kinematic.covariance[number, number])
    effects = tuple(active for n, active in enumerate(coefficients.point.effects) if n != index)
    reduced = estimate(
        coefficients.problem, replace(coefficients.point, effects=effects), coefficients.solution.weights
    )
    kinematic_gain = identified.estimate.gain_over(estimate_without(identified, each)) - deviation
    return JointGain(kinematic_gain, coefficients.log_likelihood - reduced.log_likelihood, reduced)


@dataclass(frozen=True)
class _DelayModel:
    """One model of an instrument's time delay, with its joint estimate.

    `hypothesis` as selected by kinematics with its `gain` there; `deficit` in ln L to the one that they selected;
    `likelihood`: ln L of both kinds of equations.
    """

    hypothesis: Hypothesis
    gain: float
    deficit: float
    selected: SelectedStructure
    delays: JointDelays
    likelihood: float

    @property
    def index(self) -> int:
        """Index of the delay among the errors."""
        name = self.hypothesis.effects[0].name
        return next(n for n, active in enumerate(self.delays.effects) if active.values and active.name == name)

    def as_alternative_to(self, best: _DelayModel, margin: float) -> Alternative:
        """As alternative of a likelier model, with its deficit in the kinematic equations that identified both."""
        active = self.delays.effects[self.index]
        number = sum(len(each.values) for each in self.delays.effects[: self.index])
        error = float(np.sqrt(self.delays.covariance[number, number]))
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
    cached: dict[tuple[tuple[object, ...], ...], tuple[JointDelays, float]] = {}

    def estimated(
        selected: SelectedStructure, hypothesis: Hypothesis, gain: float, deficit: float = 0.0
    ) -> _DelayModel:
        initial = kinematic_delays(selected.estimate)
        # The same errors are evaluated for each delayed channel.
        name = tuple(active.identity for active in initial.effects)
        if name not in cached:
            delays = joint_delays(selected.estimate, initial, _with_delays(declared, initial))
            cached[name] = delays, _with_delays(declared, delays).log_likelihood - delays.penalty
        delays, likelihood = cached[name]
        return _DelayModel(hypothesis, gain, deficit, selected, delays, likelihood - deficit)

    others: list[Alternative] = []
    margin = declared.problem.settings.alike_instruments
    for each in identified.chosen:
        if each.hypothesis.kind not in DELAY_KINDS:
            continue
        rest = tuple(other for other in identified.chosen if other is not each)
        current = estimated(identified, each.hypothesis, each.gain)
        models = [current]
        for row in replacements_of(identified, each, sensors):
            if row.hypothesis.kind in DELAY_KINDS and row.hypothesis.where == each.hypothesis.where:
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


def _with_delays(declared: Estimate, delays: JointDelays) -> Estimate:
    """The declared structure's coefficients with the errors fixed at given values."""
    return estimate(declared.problem, with_errors_held(declared.point, delays.effects), declared.solution.weights)


def is_within(kinematic: JointDelays, other: JointDelays, deviations: float) -> bool:
    """Whether every error lies within a number of kinematic standard deviations of its kinematic estimate."""
    distance = np.abs(free_values(other.effects) - free_values(kinematic.effects))
    return bool(np.all(distance <= deviations * np.sqrt(np.diag(kinematic.covariance))))


@dataclass(frozen=True)
class DelayDiscrepancy:
    """Time delay of a channel by kinematics alone and by both kinds of equations, where these differ, s."""

    channel: str
    kinematic: ActiveEffect
    kinematic_std_error: float
    joint: ActiveEffect
    joint_std_error: float


def delay_discrepancies(identified: Estimate, delays: JointDelays, deviations: float) -> tuple[DelayDiscrepancy, ...]:
    """Channels whose joint time delay is of another kind or differs by more than some kinematic standard deviations.

    Parameters
    ----------
    identified : Estimate
        Of the kinematic equations, with the kinds that they selected.
    delays : JointDelays
        Of both kinds of equations.
    """
    kinematic = kinematic_delays(identified)
    rows = []
    before, after = (
        {a.effect.where: (a, error) for a, error in _leading(each) if a.effect.kind in DELAY_KINDS}
        for each in (kinematic, delays)
    )
    for channel in before.keys() & after.keys():
        (first, first_error), (second, second_error) = before[channel], after[channel]
        further = abs(first.values[0] - second.values[0]) > deviations * first_error
        if further or first.effect.kind != second.effect.kind:
            rows.append(DelayDiscrepancy(channel, first, first_error, second, second_error))
    return tuple(sorted(rows, key=lambda row: row.channel))


def _leading(delays: JointDelays) -> list[tuple[ActiveEffect, float]]:
    """Each error with the standard deviation of its first parameter."""
    errors, index, rows = np.sqrt(np.diag(delays.covariance)), 0, []
    for active in delays.effects:
        if active.values:
            rows.append((active, float(errors[index])))
        index += len(active.values)
    return rows


def with_errors_held(point: Point, effects: Sequence[ActiveEffect]) -> Point:
    """A point whose first effects are given errors, fixed at their values."""
    fixed = tuple(frozen(active) for active in effects)
    return replace(point, effects=(*fixed, *point.effects[len(fixed) :]))


def free_values(effects: Sequence[ActiveEffect]) -> Array:
    """All free parameters of some effects, in order."""
    return np.array([value for active in effects for value in active.values])


def _moved_to(effects: Sequence[ActiveEffect], values: Array) -> tuple[ActiveEffect, ...]:
    """Effects with given parameter values, within their limits."""
    moved, rest = [], list(values)
    for active in effects:
        aim = np.array([rest.pop(0) for _ in active.values])
        moved.append(active.moved(aim - np.array(active.values)))
    return tuple(moved)


def _information(
    found: Estimate, effects: tuple[ActiveEffect, ...], parameters: Sequence[tuple[int, int]], follow: Array
) -> tuple[Array, Array]:
    """Fisher information (n, n) of the coefficients on the delays and its score (n,), linear unknowns eliminated.

    `follow`: change of each error parameter with each delay.
    """
    free_point = replace(found.point, effects=(*effects, *found.point.effects[len(effects) :]))
    columns = (
        effect_sensitivities(found.problem, linear_values(found.design, found.solution), free_point, parameters)
        @ follow
    )
    return information_on(found, columns)


def information_on(found: Estimate, columns: Array) -> tuple[Array, Array]:
    """Fisher information (n, n) on parameters with some columns (R, n), and its score (n,), linear unknowns eliminated.

    It is reduced where the whitened residuals remain correlated, as for every other parameter.
    """
    white = compared_columns(found.design, columns, found.solution.weights)
    own = white - found.solution.slopes @ (found.solution.covariance @ (found.solution.slopes.T @ white))
    information, score = own.T @ own, own.T @ found.solution.whitened
    meat = covariance_of_scores(found.design, own * found.solution.whitened[:, None])
    deflation = 1.0 / np.sqrt(np.maximum(np.diag(meat) / np.maximum(np.diag(information), 1e-300), 1.0))
    return information * np.outer(deflation, deflation), score * deflation**2
