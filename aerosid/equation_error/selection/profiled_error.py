"""A vane's position or dead time beside its time delay, all other instrument errors re-estimated at each value of it.

A vane x ahead of the centre of gravity reads alpha - x q/V, which in usual motion is alpha late by x/V: kinematics show
the sum of the delay and x/V, and hardly either. So they do of a lag and a dead time. Along that line the error is held
at a value after another, with the delays, and all other errors, re-estimated at each (profile likelihood: Seber & Wild,
Nonlinear Regression, section 5.2.2). To second order the joint likelihood needs one column of each equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import compared_columns
from aerosid.equation_error.regression.estimate import Estimate, effect_sensitivities, estimate, linear_values
from aerosid.equation_error.regression.parameter_limits import free_parameters
from aerosid.equation_error.selection.alternatives import Alternative
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.coefficient_information import information_of, information_on_effects
from aerosid.equation_error.selection.joint_errors import (
    JointErrors,
    free_values,
    joint_errors,
    jointly_estimated,
    kinematic_errors,
    with_errors_held,
)
from aerosid.equation_error.selection.stepwise import recordings_agree
from aerosid.equation_error.selection.structure import SelectedStructure

Array = NDArray[np.float64]

STEPS = 4
"""Numerical: Newton steps at most along the line."""

HALVINGS = 3
"""Numerical: times that a step is halved before the search ends at the current position."""

SETTLED = 0.1
"""Numerical: standard errors, 1, of a step of the position that counts as converged."""


@dataclass(frozen=True)
class ProfiledError:
    """Instrument errors and coefficients with one error of a vane held at a value, everything else re-estimated.

    Attributes
    ----------
    hypothesis : Hypothesis
        The error that is held, of one parameter: a position, or a dead time.
    timing : Hypothesis
        The time delay beside which it was looked for.
    value : float
        m ahead of the declared centre of gravity, or s.
    identified : SelectedStructure
        The errors by kinematics with that one held.
    errors : JointErrors
        The same estimated jointly.
    coefficients : Estimate
        Of a structure of the coefficient equations, its first effects these errors.
    alternatives : tuple of Alternative
        What explains nearly as much without it: the delay alone, or a term in the rate that moves the vane.
    """

    hypothesis: Hypothesis
    timing: Hypothesis
    value: float
    identified: SelectedStructure
    errors: JointErrors
    coefficients: Estimate
    alternatives: tuple[Alternative, ...] = ()

    @property
    def log_likelihood(self) -> float:
        """Of both kinds of equations."""
        return self.identified.estimate.log_likelihood + self.coefficients.log_likelihood - self.errors.penalty

    def moved_to(self, value: float) -> ProfiledError:
        """The same structure with the error at another value."""
        kinematic = self.identified.estimate
        at_zero = replace(kinematic.point, effects=_without_error(kinematic.point.effects, self.hypothesis))
        there = with_hypothesis(at_zero, _held_at(self.hypothesis, value))
        identified = SelectedStructure(
            estimate(kinematic.problem, there, kinematic.solution.weights), self.identified.chosen
        )
        initial = kinematic_errors(identified.estimate)
        rest = self.coefficients.point.effects[len(kinematic.point.effects) :]
        begun = _with_errors(self.coefficients, initial, rest)
        errors = joint_errors(identified.estimate, initial, begun)
        return replace(
            self,
            value=value,
            identified=identified,
            errors=errors,
            coefficients=_with_errors(begun, errors, rest),
        )

    def with_value_free(self) -> JointErrors:
        """The errors with that one among their parameters, and the covariance of all."""
        effects, line = self.errors.effects, self.line
        place = next(n for n, each in enumerate(effects) if _is_held(each, self.hypothesis))
        free = replace(self.hypothesis.effects[0], values=(self.value,))
        own = line.shares @ line.covariance
        of_others = own @ line.shares.T + self.errors.covariance - line.given
        n = len(free_values(effects[:place]))
        covariance = np.insert(np.insert(of_others, n, 0.0, axis=0), n, 0.0, axis=1)
        covariance[n, :] = covariance[:, n] = np.insert(own[:, -1], n, line.covariance[-1, -1])
        return JointErrors((*effects[:place], free, *effects[place + 1 :]), covariance, self.errors.penalty)

    @cached_property
    def line(self) -> _Line:
        """The joint likelihood about it, to second order."""
        return _line_through(self)

    @property
    def std_error(self) -> float:
        """Of the value, with the errors estimated beside it."""
        return float(np.sqrt(self.line.covariance[-1, -1]))

    @property
    def is_confirmed(self) -> bool:
        """Whether the error is significant and within its limits, and the records by themselves agree on it."""
        highest = self.hypothesis.effects[0].effect.parameters[0].highest
        significant = self.value > self.coefficients.problem.settings.deviations * self.std_error
        if not significant or self.value >= highest:
            return False
        free = replace(self.hypothesis.effects[0], values=(self.value,))
        effects = (free if _is_held(each, self.hypothesis) else each for each in self.coefficients.point.effects)
        point = replace(self.coefficients.point, effects=tuple(effects))
        alone = estimate(self.coefficients.problem, point, self.coefficients.solution.weights, steps=0)
        return recordings_agree(alone, self.hypothesis)


def likeliest_value(begun: ProfiledError) -> ProfiledError:
    """The error at the value of highest joint likelihood, none or positive, by Newton steps from another value."""
    here = begun
    highest = here.hypothesis.effects[0].effect.parameters[0].highest
    for _ in range(STEPS):
        line = here.line
        step = float(np.clip(line.step, -here.value, highest - here.value))
        if abs(step) < SETTLED * here.std_error:
            break
        trials = (here.moved_to(here.value + 0.5**n * step) for n in range(HALVINGS + 1))
        better = next((trial for trial in trials if trial.log_likelihood > here.log_likelihood), None)
        if better is None:
            break
        here = better
    return here


def _held_at(hypothesis: Hypothesis, value: float) -> Hypothesis:
    (active,) = hypothesis.effects
    return replace(hypothesis, effects=(frozen(replace(active, values=(value,))),))


def _is_held(active: ActiveEffect, hypothesis: Hypothesis) -> bool:
    return active.name == hypothesis.effects[0].name and bool(active.held)


def _without_error(effects: Sequence[ActiveEffect], hypothesis: Hypothesis) -> tuple[ActiveEffect, ...]:
    return tuple(active for active in effects if not _is_held(active, hypothesis))


def _with_errors(found: Estimate, errors: JointErrors, rest: Sequence[ActiveEffect]) -> Estimate:
    """The coefficients with the errors fixed at given values, before the `rest` of the point's effects."""
    point = with_errors_held(replace(found.point, effects=(*errors.effects, *rest)), errors.effects)
    return estimate(found.problem, point, found.solution.weights)


@dataclass(frozen=True)
class _Line:
    """The joint likelihood about a held error and the J errors estimated jointly, to second order.

    `step` of its value, and `gain` in ln L by it and the steps of these errors; `covariance` (J + 1, J + 1) of them and
    the value; `shares` (n, J + 1): change of every error parameter with each of them; `given` (n, n): the part of the
    errors' covariance at a held value that they cause.
    """

    step: float
    gain: float
    covariance: Array
    shares: Array
    given: Array


def _line_through(at: ProfiledError) -> _Line:
    """The joint likelihood to second order: kinematics by one column, the coefficients by their information."""
    kinematic, hypothesis = at.identified.estimate, at.hypothesis
    parameters = free_parameters(kinematic.point.effects)
    jointly = jointly_estimated(kinematic.point)
    own = kinematic_errors(kinematic)
    known = jointly @ own.covariance @ jointly.T
    prior = np.linalg.pinv(known, hermitian=True)
    follow = own.covariance @ jointly.T @ prior
    change, curvature, slope = _kinematic_change(kinematic, hypothesis)
    along = jointly @ change
    shares = np.column_stack([follow, change - follow @ along])
    tied = np.column_stack([np.eye(jointly.shape[0]), -along])
    away = jointly @ (free_values(at.errors.effects) - free_values(own.effects))
    last = np.zeros(jointly.shape[0] + 1)
    last[-1] = 1.0
    of_coefficients, score = _coefficient_information(at, parameters, shares)
    information = of_coefficients + tied.T @ prior @ tied + curvature * np.outer(last, last)
    score = score - tied.T @ (prior @ away) + slope * last
    covariance = np.linalg.pinv(information, hermitian=True)
    step = covariance @ score
    conditional = np.linalg.pinv(information[:-1, :-1], hermitian=True)
    return _Line(float(step[-1]), 0.5 * float(score @ step), covariance, shares, follow @ conditional @ follow.T)


def _kinematic_change(kinematic: Estimate, hypothesis: Hypothesis) -> tuple[Array, float, float]:
    """Change of the errors' parameters with the held value by kinematics, and the information left on it and its slope.

    The rest of the information is what lies along the change.
    """
    known = linear_values(kinematic.design, kinematic.solution)
    further = with_hypothesis(kinematic.point, hypothesis)  # what is held and a little more add up
    columns = effect_sensitivities(kinematic.problem, known, further, [(len(kinematic.point.effects), 0)])
    white = compared_columns(kinematic.design, columns, kinematic.solution.weights)
    change = -kinematic.solution.covariance @ (kinematic.solution.slopes.T @ white[:, 0])
    information, score = information_of(kinematic, white)
    names = [("effect", i, k) for i, k in free_parameters(kinematic.point.effects)]
    places = [kinematic.design.unknowns.index(name) for name in names]
    return change[places], float(information[0, 0]), float(score[0])


def _coefficient_information(
    at: ProfiledError, parameters: Sequence[tuple[int, int]], shares: Array
) -> tuple[Array, Array]:
    """Fisher information (J + 1, J + 1) of the coefficients on the errors and the held one, and its score."""
    found, errors = at.coefficients, at.errors.effects
    (moving,) = at.hypothesis.effects
    point = replace(found.point, effects=(*errors, moving, *found.point.effects[len(errors) :]))
    with_held = np.vstack([shares, [0.0] * (shares.shape[1] - 1) + [1.0]])
    return information_on_effects(found, point, [*parameters, (len(errors), 0)], with_held)
