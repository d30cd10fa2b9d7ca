"""Gauss-Newton on the stacked equations: terms, instrument errors, controls and all other effects."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Point, Unknown
from aerosid.equation_error.regression.design import Design, Weights, uses_no_instruments
from aerosid.equation_error.regression.gain import gain_over
from aerosid.equation_error.regression.least_squares import Solution, regress, solve
from aerosid.equation_error.regression.parameter_limits import free_parameters, solved_within_limits
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.terms import LIFT

Array = NDArray[np.float64]

STEPS = 8
"""Numerical: Gauss-Newton steps at most."""

HALVINGS = 4
"""Numerical: times that a step is shortened, to 0.4 of itself, before the search ends at the current point."""

REPETITIONS = 6
"""Numerical: times at most that a regression is repeated with the lift estimated by the one before."""

SETTLED = 0.02
"""Numerical: change of every term's value, over its standard error, below which that ends."""

CLOSE = 0.05
"""Numerical: change of ln L in a step that counts as converged."""

FAITHFUL = 0.75
"""Numerical: fraction of the gain in ln L predicted by the columns of another estimate from which they are kept."""

REACHED = 0.01
"""Numerical: gain in ln L that a step predicts, a seventh of one parameter's deviation, below which it is not taken."""


@dataclass(frozen=True)
class Estimate:
    """Maximum-likelihood estimate: the regression at its point, with columns of the effects' parameters."""

    problem: RegressionProblem
    point: Point
    design: Design
    solution: Solution

    @property
    def log_likelihood(self) -> float:
        """Of all equations."""
        return self.solution.log_likelihood

    def gain_over(self, base: Estimate | Optimum) -> float:
        """Gain in ln L over the estimate of a reduced structure."""
        if uses_no_instruments(base.design):
            return self.log_likelihood - base.log_likelihood
        design = base.estimate.design if isinstance(base, Optimum) else base.design
        return gain_over(design, base.log_likelihood, self.solution, self.problem.settings)

    def gain_by(self, wider: Solution) -> float:
        """Gain in ln L over this estimate by a solution with further columns."""
        return gain_over(self.design, self.log_likelihood, wider, self.problem.settings)

    def value(self, unknown: Unknown) -> float:
        """The estimate of a linear unknown."""
        return float(self.solution.values[self.design.unknowns.index(unknown)])


@dataclass(frozen=True)
class Optimum:
    """A maximum-likelihood point, the columns of its effects' parameters computed when needed.

    They cost as much as a step, and a structure that is rejected needs none. `columns`, (R, K): those of the parameters
    in order, where they were computed for a step that was not taken.
    """

    problem: RegressionProblem
    point: Point
    design: Design
    solution: Solution
    columns: Array | None = None

    @property
    def log_likelihood(self) -> float:
        """Of all equations."""
        return self.solution.log_likelihood

    @property
    def without_columns(self) -> Estimate:
        """The estimate of its terms at the point itself; the values with columns are a linear step beyond it."""
        return Estimate(self.problem, self.point, self.design, self.solution)

    @cached_property
    def estimate(self) -> Estimate:
        """With the columns of the effects' parameters."""
        free = free_parameters(self.point.effects)
        if not free:
            return self.without_columns
        columns = self.columns
        if columns is None:
            columns = effect_sensitivities(self.problem, linear_values(self.design, self.solution), self.point, free)
        wide = self.design.extended(columns, [("effect", i, k) for i, k in free])
        again = functools.partial(solve, weights=self.solution.weights)
        wide, full = solved_within_limits(wide, self.point.effects, again)
        # The likelihood of the point itself, not of the linear step beyond it.
        full = replace(full, log_likelihood=self.log_likelihood, residuals=self.solution.residuals)
        return Estimate(self.problem, self.point, wide, full)

    @property
    def has_columns(self) -> bool:
        """Whether the columns of the effects' parameters have been computed."""
        return "estimate" in vars(self)

    def with_columns(self) -> Optimum:
        """The same, the columns of the effects' parameters computed."""
        _ = self.estimate
        return self

    def gain_over(self, base: Estimate) -> float:
        """Gain in ln L over the estimate of a reduced structure."""
        if uses_no_instruments(base.design):
            return self.log_likelihood - base.log_likelihood
        return self.estimate.gain_over(base)


def residual_of(
    problem: RegressionProblem,
    known: Mapping[Unknown, float],
    point: Point,
    changed: ActiveEffect | None = None,
    before: Array | None = None,
) -> Array:
    """Residuals (R,) at a point with values of the linear unknowns.

    `changed`: the effect in which the point differs from that of the residuals `before`, (R,); by default any.
    """
    if problem.kinds == COEFFICIENT:
        return problem.residuals(point, known, changed.log if changed is not None else "", before)
    fresh = problem.design(point)
    chosen = np.array([known.get(unknown, 0.0) for unknown in fresh.unknowns])
    return np.asarray(fresh.target - fresh.columns @ chosen)


def effect_sensitivities(
    problem: RegressionProblem, known: Mapping[Unknown, float], point: Point, parameters: Sequence[tuple[int, int]]
) -> Array:
    """Sensitivities of every equation to some effects' parameters, (R, K), by finite differences.

    `known`: values of the linear unknowns; `parameters`: index of the effect and of its parameter.
    """
    here = residual_of(problem, known, point)
    columns = np.zeros((here.size, len(parameters)))
    for column, (index, number) in enumerate(parameters):
        active = point.effects[index]
        parameter = active.effect.parameters[number]
        side = active.perturbed(number, parameter.step)
        if side.values[number] == active.values[number]:  # at its upper limit
            side = active.perturbed(number, -parameter.step)
        effects = (*point.effects[:index], side, *point.effects[index + 1 :])
        moved = residual_of(problem, known, replace(point, effects=effects), active, here)
        columns[:, column] = (here - moved) / (side.values[number] - active.values[number])
    return columns


def _columns_near(near: Estimate, problem: RegressionProblem, known: Mapping[Unknown, float], point: Point) -> Array:
    """Sensitivities as of `effect_sensitivities`, those of effects with the same parameters in another estimate its."""
    own = {active.identity_at_any_values: n for n, active in enumerate(near.point.effects) if active.values}
    places = {unknown: p for p, unknown in enumerate(near.design.unknowns)}
    free = free_parameters(point.effects)
    found = [places.get(("effect", own.get(point.effects[i].identity_at_any_values, -1), k)) for i, k in free]
    new = [parameter for parameter, place in zip(free, found, strict=True) if place is None]
    computed = iter(effect_sensitivities(problem, known, point, new).T if new else ())
    return np.column_stack([next(computed) if place is None else near.design.columns[:, place] for place in found])


def linear_values(design: Design, solution: Solution) -> dict[Unknown, float]:
    """The values of a solution's linear unknowns, without the effects' parameters."""
    pairs = zip(design.unknowns, solution.values.tolist(), strict=False)
    return {unknown: value for unknown, value in pairs if unknown[0] != "effect"}


def estimate(problem: RegressionProblem, point: Point, weights: Weights | None = None, steps: int = STEPS) -> Estimate:
    """Maximum-likelihood estimate of a structure, as `maximise_likelihood`, with the columns of its effects."""
    return maximise_likelihood(problem, point, weights, steps).estimate


def maximise_likelihood(
    problem: RegressionProblem,
    point: Point,
    weights: Weights | None = None,
    steps: int = STEPS,
    is_promising: Callable[[Solution], bool] = lambda _predicted: True,
    near: Estimate | None = None,
    keep_near: bool = False,
) -> Optimum:
    """Maximum-likelihood parameters of a structure by Gauss-Newton.

    Parameters
    ----------
    point : Point
        Starting values.
    weights : Weights, optional
        Initial noise model.
    is_promising : callable
        Whether the first-order solution of a step, all parameters among its unknowns, is of interest; else it ends.
    near, keep_near : Estimate, bool, optional
        Of a structure that differs in an effect or a term: the other effects have its columns in the first step of a
        fit of coefficients, with `keep_near` until a step gains less than predicted: enough for what a deletion or a
        replacement is worth. In kinematic equations columns cost little, and delays move them far.
    """
    near = near if problem.kinds == COEFFICIENT else None
    point, design, solution = _regressed(problem, problem.acting(point), weights)
    free = free_parameters(point.effects)
    columns: Array | None = None
    names: list[Unknown] = [("effect", i, k) for i, k in free]
    for _ in range(steps if free else 0):
        known = linear_values(design, solution)
        inexact = near is not None
        if near is None:
            columns = step_columns = effect_sensitivities(problem, known, point, free)
        else:
            step_columns = _columns_near(near, problem, known, point)
        wide = design.extended(step_columns, names)
        again = functools.partial(regress, settings=problem.settings, start=solution.weights)
        _, full = solved_within_limits(wide, point.effects, again)
        if not is_promising(full):
            break
        if not inexact and abs(full.log_likelihood - solution.log_likelihood) < REACHED:
            break
        step = full.values[len(design.unknowns) :]
        moved, design_new, solved = _stepped(problem, point, design, solution, full, free, step)
        gained = solved.log_likelihood - solution.log_likelihood if moved is not None else 0.0
        if not keep_near or gained < FAITHFUL * (full.log_likelihood - solution.log_likelihood) - CLOSE:
            near = None
        if moved is None:
            if inexact and near is None:
                continue
            break
        point, design, solution, columns = moved, design_new, solved, None
        if abs(gained) < CLOSE and _small(full, step):
            columns = None if inexact else step_columns  # they hardly change over a step of a tenth of a deviation
            break
    return Optimum(problem, point, design, solution, columns)


def _regressed(problem: RegressionProblem, point: Point, weights: Weights | None) -> tuple[Point, Design, Solution]:
    """The regression of the terms, repeated where columns depend on the terms' values.

    Lift in a drag polar does: its parameters are determined by lift and hardly by drag, so that a few rounds suffice.
    So do the errors of a sideslip without a vane, which act by the derivatives by sideslip.
    """
    design = problem.design(point)
    solution = regress(design, problem.settings, weights)
    moved = with_terms(point, design, solution.values)
    has_lift = any(term.variables & set(LIFT) for _, term in (*point.free, *point.model.entries))
    if not has_lift and not _errors_act_by_terms(problem, design):
        return moved, design, solution
    terms = [p for p, unknown in enumerate(design.unknowns) if unknown[0] in ("term", "one")]
    for _ in range(REPETITIONS):
        before, design = solution.values, problem.design(moved)
        solution = regress(design, problem.settings, solution.weights)
        moved = with_terms(moved, design, solution.values)
        deviations = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
        if np.all(np.abs(solution.values - before)[terms] <= SETTLED * deviations[terms]):
            break
    return moved, design, solution


def _errors_act_by_terms(problem: RegressionProblem, design: Design) -> bool:
    """Whether coefficient equations contain errors of a sideslip without a vane, as large as its derivatives."""
    return problem.kinds == COEFFICIENT and any(unknown[0] == "random_walk" for unknown in design.unknowns)


def _small(full: Solution, step: Array) -> bool:
    deviation = np.sqrt(np.maximum(np.diag(full.covariance)[-step.size :], 1e-300))
    return bool(np.all(np.abs(step) < 0.1 * deviation))


def _stepped(
    problem: RegressionProblem,
    point: Point,
    design: Design,
    before: Solution,
    full: Solution,
    free: Sequence[tuple[int, int]],
    step: Array,
) -> tuple[Point | None, Design, Solution]:
    """The point after the step, shortened until the likelihood with the same colours does not decrease.

    `before`: the design's solution from whose colours those of the step, `full`, were estimated.

    Where the terms determine how errors act, that is compared between points with the same terms: a step of the
    Citation's lateral accelerometer by its whole error was refused for what the sideslip's errors changed, 26 in ln L.
    """
    start = before if full.weights is before.weights else solve(design, full.weights)
    if _errors_act_by_terms(problem, design):
        start = solve(problem.design(with_terms(point, design, full.values[: len(design.unknowns)])), full.weights)
    share = 1.0
    for _ in range(HALVINGS):
        effects = list(point.effects)
        for (i, k), change in zip(free, step, strict=True):
            effects[i] = effects[i].perturbed(k, share * float(change))
        trial = with_terms(replace(point, effects=tuple(effects)), design, full.values[: len(design.unknowns)])
        fresh = problem.design(trial)
        if (reached := solve(fresh, full.weights)).log_likelihood > start.log_likelihood - CLOSE:
            solved = regress(fresh, problem.settings, reached)
            return with_terms(trial, fresh, solved.values), fresh, solved
        share *= 0.4
    return None, design, start


def with_terms(point: Point, design: Design, values: Array) -> Point:
    """The point with the regression's values of its terms; of a constant the mean over records."""
    changed = np.array(point.model.values)
    constants: dict[Entry, list[float]] = {}
    for unknown, value in zip(design.unknowns, values, strict=False):
        if unknown[0] == "term":
            changed[point.model.index(unknown[1])] = value  # type: ignore[arg-type]
        elif unknown[0] == "one":
            constants.setdefault(unknown[1], []).append(float(value))  # type: ignore[arg-type]
    for entry, found in constants.items():
        changed[point.model.index(entry)] = float(np.mean(found))
    return replace(point, model=point.model.with_values(changed))
