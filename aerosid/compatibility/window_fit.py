"""Weighted least squares of flight-path reconstruction over short windows, with instrument errors estimated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import DRIVING, GIVEN, OBSERVED, STATES, integrate_path, observe
from aerosid.compatibility.recording import Recording, first_states
from aerosid.effects import ActiveEffect, OutputEffect
from aerosid.equation_error.equations.angular_rates import Rates, lever_accelerations
from aerosid.equation_error.equations.sensors import with_ends_held

Array = NDArray[np.float64]
_FREE = len(STATES)


@dataclass(frozen=True)
class WindowFitSettings:
    """Settings of the fit of short windows, whose misfits are compared with fractions of a channel's variation.

    Attributes
    ----------
    steps : int
        Levenberg-Marquardt steps at given noise variances.
    rounds : int
        Updates of the noise variances: a channel that does not belong to the motion must lose its weight.
    cost_tolerance : float
        Negligible decrease of -2 ln L, 1.
    variance_tolerance : float
        Negligible relative change of a noise variance, 1.
    least_variance : float
        Least noise variance of a channel over the log's own, 1: a drifting path could fit one channel completely.
    """

    steps: int = 6
    rounds: int = 3
    cost_tolerance: float = 1.0
    variance_tolerance: float = 0.2
    least_variance: float = 0.25


QUICK = WindowFitSettings()
"""The settings of a fit."""

FIRST_ROUND = WindowFitSettings(rounds=1)
"""Those of a fit that is to tell whether more is worth while."""

GRID = WindowFitSettings(steps=2, rounds=1)
"""Those of the fits of a grid, whose least misfit is looked for: a path is nearly linear in its unknowns."""


@dataclass(frozen=True)
class WindowFit:
    """The fitted path of each window: `residuals` (n, 4) measured less predicted, zero where nothing is compared."""

    residuals: tuple[Array, ...]


@dataclass(frozen=True)
class _Point:
    """Instrument errors and initial states (4,), with each window's residuals and their derivatives."""

    effects: tuple[ActiveEffect, ...]
    states: tuple[Array, ...]
    residuals: tuple[Array, ...]
    columns: tuple[Array, ...]


def fit_windows(
    recording: Recording, effects: Sequence[ActiveEffect], settings: WindowFitSettings = QUICK
) -> WindowFit:
    """Maximum-likelihood paths through the stretches of a recording, each with its own initial state.

    Parameters
    ----------
    recording : Recording
        Its stretches are the windows.
    effects : sequence of ActiveEffect
        Instrument errors that are estimated, in the order in which they act.

    Notes
    -----
    Output error of the flight path (Klein & Morelli, Aircraft System Identification, chapter 10) with diagonal weights:
    over some seconds the noise of the integrated channels changes the path little compared with a contradiction.
    """
    floor = settings.least_variance * _starting_variance(recording)
    variance = floor / settings.least_variance
    point = _evaluate(recording, tuple(effects), first_states(recording))
    cost = _cost(recording, point, variance)
    for _ in range(settings.rounds):
        before = cost
        point = _improved(recording, point, variance, settings)
        updated = np.maximum(_mean_squares(recording, point), floor)
        if np.allclose(updated, variance, rtol=settings.variance_tolerance, atol=0.0):
            break
        variance = updated
        cost = _cost(recording, point, variance)
        if abs(before - cost) < settings.cost_tolerance:
            break
    return WindowFit(point.residuals)


def true_inputs(recording: Recording, effects: Sequence[ActiveEffect]) -> Array:
    """The path's inputs, (N, 7): the recorded channels corrected for instrument errors, at the centre of gravity."""
    given = recording.inputs.copy()
    for active in reversed(effects):
        effect = active.effect
        if isinstance(effect, OutputEffect) and effect.where in DRIVING:
            j = GIVEN.index(effect.where)
            given[:, j] = with_ends_held(effect.corrected(recording.time, given[:, j], active.numbers), given[:, j])
    arms = {name: recording.positions.get(name, (0.0, 0.0, 0.0)) for name in ("a_x", "a_z")}
    if any(any(arm) for arm in arms.values()):
        p, q, r = (given[:, GIVEN.index(name)] for name in ("p", "q", "r"))
        still = np.zeros_like(q)
        rates = Rates(p, q, r, still, np.gradient(q, recording.time), still)
        for name, arm in arms.items():
            given[:, GIVEN.index(name)] -= lever_accelerations(name, arm, rates)
    return given


def _starting_variance(recording: Recording) -> Array:
    """Noise variances (4,) of the log, no smaller than rounding; 1 where a channel is absent."""
    variance = np.ones(len(OBSERVED))
    for name in recording.outputs:
        samples = recording.measured[:, OBSERVED.index(name)]
        least = 1e-6 * float(np.nanstd(samples)) + 1e-12
        variance[OBSERVED.index(name)] = max(recording.noise[name], least) ** 2
    return variance


def _evaluate(recording: Recording, effects: tuple[ActiveEffect, ...], states: Sequence[Array]) -> _Point:
    given = true_inputs(recording, effects)
    directions, places = _directions(recording, effects, given)
    x_arm, _, z_arm = recording.positions.get("alpha", (0.0, 0.0, 0.0))
    residuals, columns = [], []
    for stretch, state in zip(recording.stretches, states, strict=True):
        here, along = np.ascontiguousarray(given[stretch]), np.ascontiguousarray(directions[stretch])
        path = integrate_path(recording.time[stretch], here, state, along)
        outputs, by_state, by_driving = observe(path.states, here, x_arm, z_arm)
        moved = by_state @ path.columns
        moved[:, :, _FREE:] += by_driving @ along
        slopes = np.zeros((*outputs.shape, _FREE + len(effects)))
        slopes[:, :, :_FREE] = moved[:, :, :_FREE]
        slopes[:, :, [_FREE + place for place in places]] = moved[:, :, _FREE:]
        _enter_sensors(recording.time[stretch], outputs, slopes, effects)
        compared = recording.compared[stretch]
        residuals.append(np.where(compared, recording.measured[stretch] - outputs, 0.0))
        columns.append(slopes * compared[:, :, None])
    return _Point(effects, tuple(states), tuple(residuals), tuple(columns))


def _directions(recording: Recording, effects: Sequence[ActiveEffect], given: Array) -> tuple[Array, list[int]]:
    """Sensitivities of a_x, a_z and q to their instrument errors, (N, 3, D), and the index of each effect."""
    moves, places = [], []
    for n, active in enumerate(effects):
        if active.effect.where in DRIVING:
            perturbed = _perturbed(active)
            changed = true_inputs(recording, (*effects[:n], perturbed, *effects[n + 1 :]))
            moves.append((changed - given)[:, : len(DRIVING)] / (perturbed.values[0] - active.values[0]))
            places.append(n)
    empty = np.zeros((recording.time.size, len(DRIVING), 0))
    return (np.stack(moves, axis=2) if moves else empty), places


def _enter_sensors(time: Array, outputs: Array, slopes: Array, effects: Sequence[ActiveEffect]) -> None:
    """Apply the observed channels' errors to outputs and sensitivities, and enter their own columns, in place."""
    for n, active in enumerate(effects):
        effect = active.effect
        if isinstance(effect, OutputEffect) and effect.where in OBSERVED:
            i, perturbed = OBSERVED.index(effect.where), _perturbed(active)
            true = outputs[:, i : i + 1].copy()
            read = effect.output(time, true, active.numbers)
            moved = effect.output(time, true, perturbed.numbers)
            slopes[:, i] = effect.transform(time, np.ascontiguousarray(slopes[:, i]), active.numbers)
            slopes[:, i, _FREE + n] = (moved - read)[:, 0] / (perturbed.values[0] - active.values[0])
            outputs[:, i] = read[:, 0]


def _perturbed(active: ActiveEffect) -> ActiveEffect:
    """The effect with its parameter changed by its step, inside its limits."""
    step = active.effect.parameters[0].step
    perturbed = active.perturbed(0, step)
    return perturbed if perturbed.values != active.values else active.perturbed(0, -step)


def _mean_squares(recording: Recording, point: _Point) -> Array:
    counts = sum(recording.compared[stretch].sum(axis=0) for stretch in recording.stretches)
    squares = sum(np.sum(part**2, axis=0) for part in point.residuals)
    return np.asarray(np.where(counts > 0, squares / np.maximum(counts, 1), 1.0))


def _cost(recording: Recording, point: _Point, variance: Array) -> float:
    """-2 ln L but for a constant."""
    counts = sum(recording.compared[stretch].sum(axis=0) for stretch in recording.stretches)
    cost = float(np.sum(counts * (_mean_squares(recording, point) / variance + np.log(variance))))
    return cost if np.isfinite(cost) else np.inf


def _improved(recording: Recording, point: _Point, variance: Array, settings: WindowFitSettings) -> _Point:
    """The best point at given noise variances, by Levenberg-Marquardt steps."""
    damping, cost = 1e-4, _cost(recording, point, variance)
    for _ in range(settings.steps):
        while True:
            trial = _evaluate(recording, *_moved(point, variance, damping))
            reached = _cost(recording, trial, variance)
            if reached <= cost + 1e-9 * abs(cost):
                break
            damping *= 10.0
            if damping > 1e8:
                return point
        damping = max(0.1 * damping, 1e-9)
        fall, point, cost = cost - reached, trial, reached
        if fall < settings.cost_tolerance:
            break
    return point


def _moved(point: _Point, variance: Array, damping: float) -> tuple[tuple[ActiveEffect, ...], tuple[Array, ...]]:
    """Instrument errors, kept within their limits, and initial states after a damped Gauss-Newton step."""
    blocks = []
    for residual, columns in zip(point.residuals, point.columns, strict=True):
        flat = (columns / np.sqrt(variance)[:, None]).reshape(-1, columns.shape[2])
        blocks.append((flat.T @ flat, flat.T @ (residual / np.sqrt(variance)).ravel()))
    count = len(point.effects)
    normal, gradient = np.zeros((count, count)), np.zeros(count)
    for matrix, slope in blocks:
        # The window's own initial state is eliminated.
        right = np.column_stack([matrix[:_FREE, _FREE:], slope[:_FREE]])
        taken = _solved(matrix[:_FREE, :_FREE], right, damping)
        normal += matrix[_FREE:, _FREE:] - matrix[_FREE:, :_FREE] @ taken[:, :-1]
        gradient += slope[_FREE:] - matrix[_FREE:, :_FREE] @ taken[:, -1]
    step = _solved(normal, gradient, damping) if count else gradient
    effects = tuple(active.moved(step[n : n + 1]) for n, active in enumerate(point.effects))
    change = np.array([new.values[0] - old.values[0] for new, old in zip(effects, point.effects, strict=True)])
    states = tuple(
        state + _solved(matrix[:_FREE, :_FREE], slope[:_FREE] - matrix[:_FREE, _FREE:] @ change, damping)
        for state, (matrix, slope) in zip(point.states, blocks, strict=True)
    )
    return effects, states


def _solved(matrix: Array, right: Array, damping: float) -> Array:
    """A x = b after scaling to unit diagonal, damped; rows without information give 0."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    shown = scale > 0.0
    result = np.zeros_like(right)
    if shown.any():
        unit = scale[shown]
        scaled = matrix[np.ix_(shown, shown)] / np.outer(unit, unit)
        # A small damping suppresses steps in directions without information.
        scaled += (damping + 1e-12) * np.eye(unit.size)
        by_row = unit if right.ndim == 1 else unit[:, None]
        result[shown] = np.linalg.solve(scaled, right[shown] / by_row) / by_row
    return result
