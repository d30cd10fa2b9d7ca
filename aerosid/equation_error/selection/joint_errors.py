"""Instrument errors estimated from kinematic and coefficient equations together.

Kinematics establish that an instrument is late; in moving air they determine the delay only roughly, since the gusts at
a vane are no motion of the aircraft. The coefficients relate the same delay to forces and moments, which respond to the
same gusts. As much holds of the place of a lateral accelerometer, which forces show more accurately than its integral.
Both are combined as independent measurements: Gauss-Newton on the coefficients' likelihood with the kinematic estimate
as prior (Bayes; Klein & Morelli, Aircraft System Identification, eq. 5.31).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, PositionEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import MEASURED_BY
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.parameter_limits import free_parameters
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.coefficient_information import information_on_effects
from aerosid.flight_model.axes import Axes

Array = NDArray[np.float64]

SIDE_FORCE = "C_Y"
"""The coefficient affected by the position of its accelerometer and of the sideslip vane."""

LAG, DELAY = "sensor_lag", "sensor_delay"
"""Standard: the kinds of effect of a first-order element and of a dead time between an output and its record."""

DELAY_KINDS = frozenset({DELAY, LAG})
"""Kinds whose parameter is the time by which a channel is late."""

STEPS = 6
"""Numerical: Gauss-Newton steps at most."""

HALVINGS = 4
"""Numerical: times that a step is halved before the search ends at the current point."""

SETTLED = 0.1
"""Numerical: standard deviations, 1, of a step that counts as converged."""


@dataclass(frozen=True)
class JointErrors:
    """Instrument errors, some of them estimated jointly from both kinds of equations.

    Attributes
    ----------
    effects : tuple of ActiveEffect
        All identified errors: those that are `jointly_estimated`, and the others as they follow from these.
    covariance : ndarray, shape (n, n)
        Of all their parameters, in order.
    penalty : float
        Reduction of ln L by their distance from the kinematic estimate.
    """

    effects: tuple[ActiveEffect, ...]
    covariance: Array
    penalty: float

    def indices_of(self, hypothesis: Hypothesis) -> tuple[int, int]:
        """Index of an estimated error among the effects, and of its first parameter among all parameters."""
        name = hypothesis.effects[0].name
        index = next(n for n, active in enumerate(self.effects) if active.values and active.name == name)
        return index, len(free_values(self.effects[:index]))

    def estimate_of(self, hypothesis: Hypothesis) -> tuple[ActiveEffect, float]:
        """An estimated error, and the standard error of its first parameter."""
        index, number = self.indices_of(hypothesis)
        return self.effects[index], float(np.sqrt(self.covariance[number, number]))


def is_timing_of(hypothesis: Hypothesis, channel: str) -> bool:
    """Whether a hypothesis is a channel's lag or delay."""
    return hypothesis.kind in DELAY_KINDS and hypothesis.where == channel


def kinematic_errors(identified: Estimate) -> JointErrors:
    """The instrument errors as estimated by kinematics alone."""
    indices = [identified.design.unknowns.index(("effect", i, k)) for i, k in free_parameters(identified.point.effects)]
    covariance = corrected_covariance(identified.design, identified.solution)[np.ix_(indices, indices)]
    return JointErrors(identified.point.effects, covariance, 0.0)


def joint_errors(identified: Estimate, initial: JointErrors, found: Estimate) -> JointErrors:
    """The errors that both kinds of equations show at the maximum of the joint likelihood.

    Other errors follow by their correlation with these.

    Parameters
    ----------
    identified : Estimate
        Of the kinematic equations.
    initial : JointErrors
        Starting values.
    found : Estimate
        Of the coefficient equations, its first effects the identified errors, fixed at `initial`.
    """
    parameters = free_parameters(identified.point.effects)
    jointly = jointly_estimated(identified.point)
    if not jointly.size:
        return initial
    kinematic = kinematic_errors(identified).covariance
    known = jointly @ kinematic @ jointly.T
    if not np.all(np.isfinite(known)) or np.linalg.matrix_rank(known) < jointly.shape[0]:
        return initial  # the kinematic covariance is singular: no prior
    prior = np.linalg.inv(known)
    follow = kinematic @ jointly.T @ prior
    mean = free_values(identified.point.effects)
    deviation = jointly @ (free_values(initial.effects) - mean)
    effects = initial.effects
    covariance = known

    def objective(found: Estimate, deviation: Array) -> float:
        return found.log_likelihood - 0.5 * float(deviation @ prior @ deviation)

    for _ in range(STEPS):
        free_point = replace(found.point, effects=(*effects, *found.point.effects[len(effects) :]))
        information, score = information_on_effects(found, free_point, parameters, follow)
        covariance = np.linalg.inv(information + prior)
        step = covariance @ (score - prior @ deviation)
        if np.all(np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))):
            break
        best = objective(found, deviation)
        for halving in range(HALVINGS):
            aim = deviation + 0.5**halving * step
            trial = _moved_to(identified.point.effects, mean + follow @ aim)
            aim = jointly @ (free_values(trial) - mean)
            moved = estimate(found.problem, with_errors_held(found.point, trial), found.solution.weights, steps=2)
            if objective(moved, aim) > best:
                effects, deviation, found = trial, aim, moved
                break
        else:
            break
    joint = kinematic - follow @ (known - covariance) @ follow.T
    return JointErrors(effects, joint, 0.5 * float(deviation @ prior @ deviation))


def jointly_estimated(point: Point) -> Array:
    """The combinations of a point's n free errors that are estimated from both kinds of equations, (m, n).

    Each is one of them, or the sum of a channel's lag and dead time. How that is divided is left to kinematics: the
    coefficients are formed from the channel with its lag undone, whose noise grows with the lag, and they prefer less
    of it, by up to six standard errors in light turbulence.
    """
    errors, axes = point.effects, point.model.axes
    free = free_parameters(errors)
    rows: dict[object, Array] = {}
    for n, (i, _) in enumerate(free):
        if not _is_estimated_jointly(errors[i], axes):
            continue
        effect = errors[i].effect
        name = (effect.where,) if effect.kind in DELAY_KINDS else (effect.where, n)
        rows.setdefault(name, np.zeros(len(free)))[n] = 1.0
    return np.array([*rows.values()]).reshape(len(rows), len(free))


def _is_estimated_jointly(active: ActiveEffect, axes: Axes) -> bool:
    """Whether an instrument error is estimated from both kinds of equations: a time delay, or a place that a_y shows.

    Kinematics show the distance of an accelerometer from a vane in the integral of what it reads, and forces in that
    itself: of a unit 0.3 m below its declared place the latter are twenty times as accurate. In pitch alone they are
    not heard: a_z reads the pitching acceleration, which C_m makes of the variables that C_Z is made of.
    """
    effect = active.effect
    has_side_force = SIDE_FORCE in axes.coefficients
    is_place = isinstance(effect, PositionEffect) and effect.moves(MEASURED_BY[SIDE_FORCE])
    return effect.kind in DELAY_KINDS or (has_side_force and is_place)


def is_within(kinematic: JointErrors, other: JointErrors, deviations: float) -> bool:
    """Whether every error lies within a number of kinematic standard deviations of its kinematic estimate."""
    distance = np.abs(free_values(other.effects) - free_values(kinematic.effects))
    return bool(np.all(distance <= deviations * np.sqrt(np.diag(kinematic.covariance))))


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
