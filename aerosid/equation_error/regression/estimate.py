"""Gauss-Newton on the stacked equations: terms, sensor faults, controls and whatever else acts beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Equations, Point, Segment, Unknown
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.design import (
    Design,
    Solution,
    Weights,
    compares_all,
    design_of,
    gain_over,
    regress,
    solve,
)
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.terms import LIFT

Array = NDArray[np.float64]

STEPS = 8
"""Numerical: Gauss-Newton steps at most."""

HALVINGS = 4
"""Numerical: times that a step is shortened, to 0.4 of itself, before the search ends where it is."""

REPETITIONS = 6
"""Numerical: times at most that a regression is repeated with the lift that it gave itself."""

SETTLED = 1e-4
"""Numerical: change of every term's value, as a share of it, below which that ends."""

CLOSE = 0.05
"""Numerical: change of ln L in a step that decides nothing any more."""


@dataclass(frozen=True)
class Frame:
    """What is compared: some equations of some recordings, with the settings.

    `all_fitted`: whether coefficients are regressed on the validation recordings too.
    """

    recordings: tuple[Recording, ...]
    kinds: tuple[str, ...]
    settings: EquationErrorSettings
    all_fitted: bool = False

    @cached_property
    def _equations(self) -> Equations:
        return Equations(self.recordings, self.settings, self.kinds, all_fitted=self.all_fitted)

    def acting(self, point: Point) -> Point:
        """The point without what belongs to a recording whose coefficients are not compared: nothing shows it here."""
        if self.all_fitted or self.kinds != COEFFICIENT:
            return point
        names = {recording.name for recording in self.recordings if recording.fitted}
        effects = tuple(active for active in point.effects if not (active.values and active.log) or active.log in names)
        return point if len(effects) == len(point.effects) else replace(point, effects=effects)

    def segments(self, point: Point) -> list[Segment]:
        """The equations at a point."""
        return self._equations.at(point)

    def design(self, point: Point) -> Design:
        """The regression at a point. Kinematic equations have the same columns at all points, and are stacked once."""
        segments = self.segments(point)
        if any(each.equation in COEFFICIENT for each in segments):
            return design_of(segments, self.settings)
        names = tuple((each.recording, each.equation) for each in segments)
        if names not in self._kinematic:
            self._kinematic[names] = design_of(segments, self.settings)
        return replace(self._kinematic[names], target=np.concatenate([each.target for each in segments]))

    @cached_property
    def _kinematic(self) -> dict[tuple[tuple[int, str], ...], Design]:
        return {}

    def left(self, point: Point, values: Mapping[Unknown, float]) -> Array:
        """Residuals (R,) of coefficient equations at a point, the linear unknowns given."""
        return self._equations.left(point, values)


@dataclass(frozen=True)
class Estimate:
    """A point of highest likelihood: the regression there, effects' columns among the others."""

    frame: Frame
    point: Point
    design: Design
    solution: Solution

    @property
    def log_likelihood(self) -> float:
        """Of all equations."""
        return self.solution.log_likelihood

    def gain_over(self, base: Estimate | Peak) -> float:
        """Gain in ln L over the estimate of a structure that lacks something."""
        if compares_all(base.design):
            return self.log_likelihood - base.log_likelihood
        design = base.estimate.design if isinstance(base, Peak) else base.design
        return gain_over(design, base.log_likelihood, self.solution, self.frame.settings)

    def gain_by(self, wider: Solution) -> float:
        """Gain in ln L over this estimate of a solution with further columns."""
        return gain_over(self.design, self.log_likelihood, wider, self.frame.settings)

    def value(self, unknown: Unknown) -> float:
        """The estimate of a linear unknown."""
        return float(self.solution.values[self.design.unknowns.index(unknown)])


@dataclass(frozen=True)
class Peak:
    """A point of highest likelihood, the columns of its effects' numbers made when they are asked for.

    They cost as much as a step towards it, and a structure that loses its contest needs none.

    `columns`, (R, K): those of the numbers in order, where they were made for a step that was not taken.
    """

    frame: Frame
    point: Point
    design: Design
    solution: Solution
    columns: Array | None = None

    @property
    def log_likelihood(self) -> float:
        """Of all equations."""
        return self.solution.log_likelihood

    @cached_property
    def estimate(self) -> Estimate:
        """With the effects' columns among the others."""
        free = numbers_of(self.point.effects)
        if not free:
            return Estimate(self.frame, self.point, self.design, self.solution)
        columns = self.columns
        if columns is None:
            columns = effect_columns(self.frame, linear_values(self.design, self.solution), self.point, free)
        wide = self.design.beside(columns, [("effect", i, k) for i, k in free])
        full = solve(wide, self.solution.weights)
        # The likelihood of the point itself, not of the linear step beyond it.
        full = replace(full, log_likelihood=self.log_likelihood, residuals=self.solution.residuals)
        return Estimate(self.frame, self.point, wide, full)

    @property
    def has_columns(self) -> bool:
        """Whether the effects' columns are made already."""
        return "estimate" in vars(self)

    def with_columns(self) -> Peak:
        """The same, the effects' columns made."""
        _ = self.estimate
        return self

    def gain_over(self, base: Estimate) -> float:
        """Gain in ln L over the estimate of a structure that lacks something."""
        if compares_all(base.design):
            return self.log_likelihood - base.log_likelihood
        return self.estimate.gain_over(base)


def residual_of(frame: Frame, known: Mapping[Unknown, float], point: Point) -> Array:
    """Residuals (R,) at a point with values of the linear unknowns."""
    if frame.kinds == COEFFICIENT:
        return frame.left(point, known)
    fresh = frame.design(point)
    chosen = np.array([known.get(unknown, 0.0) for unknown in fresh.unknowns])
    return np.asarray(fresh.target - fresh.columns @ chosen)


def effect_columns(
    frame: Frame, known: Mapping[Unknown, float], point: Point, numbers: Sequence[tuple[int, int]]
) -> Array:
    """What one unit of each of some effects' numbers adds to every equation, (R, K), by differences.

    `known`: values of the linear unknowns; `numbers`: place of the effect and of its number.
    """
    here = residual_of(frame, known, point)
    columns = np.zeros((here.size, len(numbers)))
    for column, (place, number) in enumerate(numbers):
        active = point.effects[place]
        parameter = active.effect.parameters[number]
        side = active.perturbed(number, parameter.step)
        if side.values[number] == active.values[number]:  # at its upper limit
            side = active.perturbed(number, -parameter.step)
        moved = residual_of(frame, known, replace(point, effects=_put(point.effects, place, side)))
        columns[:, column] = (here - moved) / (side.values[number] - active.values[number])
    return columns


def linear_values(design: Design, solution: Solution) -> dict[Unknown, float]:
    """The values of a solution's unknowns that are no effect's numbers."""
    pairs = zip(design.unknowns, solution.values.tolist(), strict=False)
    return {unknown: value for unknown, value in pairs if unknown[0] != "effect"}


def _put(effects: Sequence[ActiveEffect], place: int, active: ActiveEffect) -> tuple[ActiveEffect, ...]:
    changed = list(effects)
    changed[place] = active
    return tuple(changed)


def estimate(frame: Frame, point: Point, weights: Weights | None = None, steps: int = STEPS) -> Estimate:
    """The likeliest numbers of a structure, as `likeliest_numbers`, with the columns of its effects."""
    return likeliest_numbers(frame, point, weights, steps).estimate


def likeliest_numbers(
    frame: Frame,
    point: Point,
    weights: Weights | None = None,
    steps: int = STEPS,
    may_win: Callable[[Solution], bool] = lambda _promised: True,
) -> Peak:
    """The likeliest numbers of a structure.

    Parameters
    ----------
    point : Point
        Where to begin.
    weights : Weights, optional
        What the residuals are like to begin with.
    may_win : callable
        Whether what a step promises to first order, the solution with all numbers among its unknowns, is of any
        interest; where it is not, the search ends before the step.
    """
    point, design, solution = _regressed(frame, frame.acting(point), weights)
    free = numbers_of(point.effects)
    columns: Array | None = None
    for _ in range(steps if free else 0):
        columns = effect_columns(frame, linear_values(design, solution), point, free)
        names: list[Unknown] = [("effect", i, k) for i, k in free]
        wide = design.beside(columns, names)
        full = regress(wide, frame.settings, solution.weights)
        if not may_win(full):
            break
        linear = len(design.unknowns)
        step = full.values[linear:]
        moved, design_new, solved = _stepped(frame, point, design, full, free, step)
        if moved is None:
            break
        gained = solved.log_likelihood - solution.log_likelihood
        point, design, solution, columns = moved, design_new, solved, None
        if abs(gained) < CLOSE and _small(full, linear, step):
            break
    return Peak(frame, point, design, solution, columns)


def numbers_of(effects: Sequence[ActiveEffect]) -> list[tuple[int, int]]:
    """The place of each effect and of each of its numbers that are free."""
    return [(i, k) for i, active in enumerate(effects) for k in range(len(active.values))]


def _regressed(frame: Frame, point: Point, weights: Weights | None) -> tuple[Point, Design, Solution]:
    """The regression of the terms, repeated where columns are made of the terms' values: lift in a drag polar.

    Lift's own numbers come from lift and hardly from drag, so that a few rounds are enough.
    """
    design = frame.design(point)
    solution = regress(design, frame.settings, weights)
    moved = _with_terms(point, design, solution.values)
    if not any(term.variables & set(LIFT) for _, term in (*point.free, *point.model.entries)):
        return moved, design, solution
    for _ in range(REPETITIONS):
        before = moved.model.values
        design = frame.design(moved)
        solution = regress(design, frame.settings, solution.weights)
        moved = _with_terms(moved, design, solution.values)
        change = np.abs(moved.model.values - before)
        if np.all(change <= SETTLED * np.maximum(np.abs(before), 1e-12)):
            break
    return moved, design, solution


def likeliest_of(found: Estimate, frames: Iterable[Frame]) -> Estimate:
    """An estimate, or that of the same structure in another frame, whichever is likeliest; it is kept where none is."""
    best = found
    for frame in frames:
        tried = estimate(frame, found.point, found.solution.weights)
        if tried.log_likelihood > best.log_likelihood:
            best = tried
    return best


def weights_on(found: Estimate, frame: Frame, point: Point) -> Weights:
    """An estimate's colours and sizes for the equations of a frame that holds fewer of them."""
    place = {segment: s for s, segment in enumerate(found.design.segments)}
    own = [place[each.recording, each.equation] for each in frame.segments(point)]
    weights = found.solution.weights
    return replace(weights, colours=tuple(weights.colours[s] for s in own), sizes=weights.sizes[own])


def _small(full: Solution, linear: int, step: Array) -> bool:
    deviation = np.sqrt(np.maximum(np.diag(full.covariance)[linear:], 1e-300))
    return bool(np.all(np.abs(step) < 0.1 * deviation))


def _stepped(
    frame: Frame, point: Point, design: Design, full: Solution, free: Sequence[tuple[int, int]], step: Array
) -> tuple[Point | None, Design, Solution]:
    """The point after the step, shortened until the likelihood with the same colours does not fall."""
    start = solve(design, full.weights)
    share = 1.0
    for _ in range(HALVINGS):
        effects = list(point.effects)
        for (i, k), change in zip(free, step, strict=True):
            effects[i] = effects[i].perturbed(k, share * float(change))
        trial = _with_terms(replace(point, effects=tuple(effects)), design, full.values[: len(design.unknowns)])
        fresh = frame.design(trial)
        if solve(fresh, full.weights).log_likelihood > start.log_likelihood - CLOSE:
            solved = regress(fresh, frame.settings, full.weights)
            return _with_terms(trial, fresh, solved.values), fresh, solved
        share *= 0.4
    return None, design, start


def _with_terms(point: Point, design: Design, values: Array) -> Point:
    """The point with the regression's values of its terms; of a constant the mean over recordings."""
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
