"""Levenberg-Marquardt maximisation of the likelihood, noise variances concentrated out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation import damped_step
from aerosid.estimation.fit_settings import DAMPED_STEPS, RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.likelihood_point import Point

UNDAMPED = 1e-3
"""Numerical: damping to begin with, in units of the information's diagonal."""


@dataclass(frozen=True)
class _PredictedStep:
    """A step (M,) with its predicted decrease of the cost.

    `size` its largest component, scaled by the information; `variance` (m,) of the noise at its end; `cost` -2 ln L at
    its start and `predicted_decrease` of it, noise variances at their maximum at both ends; `variance_decrease` the
    part of that decrease due to the variances alone; `level` the largest change of a variance's logarithm over the
    step.
    """

    step: NDArray[np.float64]
    size: float
    variance: NDArray[np.float64]
    cost: float
    predicted_decrease: float
    variance_decrease: float
    level: float


def best_point(
    likelihood: Likelihood, point: Point, settings: RefinementSettings, hold_variance: bool
) -> tuple[Point, bool]:
    """The best point, and whether the search converged."""
    *_, end = ((point, False), *levenberg_marquardt(likelihood, point, settings, hold_variance))
    return end


def levenberg_marquardt(
    likelihood: Likelihood, point: Point, settings: RefinementSettings, hold_variance: bool
) -> Iterator[tuple[Point, bool]]:
    """Levenberg-Marquardt iterates: the point, and whether it is converged (then the last one)."""
    damping = UNDAMPED
    for _ in range(settings.steps):
        better = levenberg_marquardt_step(likelihood, point, settings, hold_variance, damping)
        if better is None:
            return
        point, rest, damping = better
        yield point, rest
        if rest:
            return


def levenberg_marquardt_step(
    likelihood: Likelihood, point: Point, settings: RefinementSettings, hold_variance: bool, damping: float
) -> tuple[Point, bool, float] | None:
    """One Levenberg-Marquardt step: the point, whether it is converged, the damping of the next step.

    None where the likelihood cannot be evaluated at the new noise variances.
    """
    active = likelihood.active(point.effects)
    if settings.hold_states:
        active[likelihood.free.size : likelihood.free.size + sum(state.size for state in point.states)] = False
    floor = None if hold_variance else likelihood.variance_floor
    # With disturbances the cost is not known from the outputs' noise variances alone: no step relies on them then.
    disturbed = point.is_disturbed
    known, fraction = False, 1.0
    rounds = 1 if disturbed else DAMPED_STEPS.weightings
    while True:
        predicted = _predicted_step(point, active, damping, floor, rounds, fraction)
        ahead = likelihood.moved(point, predicted.step)
        small = predicted.size < settings.step_tolerance or predicted.predicted_decrease < settings.cost_tolerance
        calm = hold_variance or predicted.level < settings.variance_tolerance
        if small and calm and damping <= DAMPED_STEPS.trusted and not disturbed:
            return (
                point.shifted(*ahead, predicted.variance, predicted.predicted_decrease - predicted.variance_decrease),
                True,
                damping,
            )
        trial = likelihood.evaluate(*ahead, predicted.variance)
        settling = None if disturbed or fraction < 1.0 else floor
        reached = np.inf if trial is None else _concentrated_cost(trial, settling)
        if trial is not None and reached <= predicted.cost + 1e-9 * abs(predicted.cost):
            break
        trifle = predicted.predicted_decrease < DAMPED_STEPS.decides_nothing and not disturbed
        if trial is not None and trifle and reached <= predicted.cost + DAMPED_STEPS.decides_nothing:
            break  # a rise within the accuracy of the comparison
        if rounds > 1:
            rounds = 1
            continue
        if predicted.level > 0.0 and not known:
            # The comparison is exact only at the point's own noise variances.
            re_evaluated = likelihood.evaluate(point.values, point.states, point.effects, predicted.variance)
            if re_evaluated is None:
                return None
            if re_evaluated.cost > point.cost + 1e-9 * abs(point.cost):
                # A disturbance explains part of the output noise: a part of the change of the variances, or none.
                part = DAMPED_STEPS.part_of_change
                fraction = part * fraction if part * predicted.level > DAMPED_STEPS.least_change else 0.0
                continue
            point, known, fraction = re_evaluated, True, 0.0
            if trial is not None and reached <= point.cost + 1e-9 * abs(point.cost):
                break
        damping *= 10.0
        if damping > 1e10:
            return point, True, damping
    fall = predicted.cost - reached
    rest = _is_converged(trial, predicted, fall, settings, None if disturbed else floor)
    return trial, rest, max(damping * 0.1, 1e-12)


def full_step(likelihood: Likelihood, point: Point) -> NDArray[np.float64]:
    """The first step (M,) of a search from a point, noise variances at their maximum."""
    active = likelihood.active(point.effects)
    return _predicted_step(point, active, UNDAMPED, likelihood.variance_floor, DAMPED_STEPS.weightings, 1.0).step


def _is_converged(
    point: Point,
    predicted: _PredictedStep,
    fall: float,
    settings: RefinementSettings,
    floor: NDArray[np.float64] | None,
) -> bool:
    """Convergence test of a step that decreased the cost by `fall`; `floor`: of variances that are estimated.

    The step's size is scaled by the information alone: at most a standard deviation per unit, less where parameters
    correlate.
    """
    level, enough = predicted.level, settings.variance_tolerance
    if floor is not None:
        log_ratio = float(np.max(np.abs(np.log(point.maximum_likelihood_variance(floor) / point.variance))))
        level, enough = min(level, log_ratio), 10.0 * enough
    small = predicted.size < settings.step_tolerance or abs(fall) < settings.cost_tolerance
    return bool(small) and level < enough


def _predicted_step(
    point: Point,
    active: NDArray[np.bool_],
    damping: float,
    floor: NDArray[np.float64] | None,
    rounds: int,
    fraction: float,
) -> _PredictedStep:
    """The damped step to the maximum of the linearised likelihood in noise variances and parameters together.

    A step at fixed variances converges slowly where the structure is wrong, as it weights the outputs by the previous
    residuals. In the linearised problem the variances cost nothing. `floor` (m,) of the variances; None: they are held.
    `fraction`: of their first update from the point's to the maximum-likelihood values, in the logarithm.
    """
    least = np.zeros_like(point.variance) if floor is None else floor
    step, variance, size, before_step, at_final_variance, after_step = damped_step.damped_newton_step(
        point.quadratic, active, damping, least, floor is None, rounds, fraction, DAMPED_STEPS.settled
    )
    level = float(np.max(np.abs(np.log(variance / point.variance))))
    return _PredictedStep(
        step, size, variance, point.cost + before_step, before_step - after_step, before_step - at_final_variance, level
    )


def _concentrated_cost(point: Point, floor: NDArray[np.float64] | None) -> float:
    """-2 ln L of a point with the noise variances at their maximum, where they are not held."""
    return point.cost if floor is None else point.cost_at(point.maximum_likelihood_variance(floor))
