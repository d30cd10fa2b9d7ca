"""Weighted least squares of flight-path reconstruction over short windows, with instrument errors estimated."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import DRIVING, GIVEN, OBSERVED, STATES, integrate_path, observe
from aerosid.compatibility.recording import Recording, first_states
from aerosid.effects import ActiveEffect, OutputEffect
from aerosid.equation_error.equations.angular_rates import Rates, lever_accelerations
from aerosid.equation_error.equations.sensors import with_ends_along

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
class _Windows:
    """The samples of W windows, one window after the other.

    `places` (R,) in the recording; `parts` (W) the samples of each window; `time` (R,); `measured`, `compared` (R, 4).
    """

    recording: Recording
    places: NDArray[np.int64]
    parts: tuple[slice, ...]
    time: Array
    measured: Array
    compared: NDArray[np.bool_]

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Samples (4,) that are compared."""
        return np.asarray(np.count_nonzero(self.compared, axis=0))


def _windows_of(recording: Recording) -> _Windows:
    edges = np.cumsum([0, *(stretch.stop - stretch.start for stretch in recording.stretches)]).tolist()
    places = np.concatenate([np.arange(stretch.start, stretch.stop) for stretch in recording.stretches])
    return _Windows(
        recording,
        places,
        tuple(itertools.starmap(slice, itertools.pairwise(edges))),
        recording.time[places],
        recording.measured[places],
        recording.compared[places],
    )


@dataclass(frozen=True)
class _Point:
    """Instrument errors and initial states (W, 4), with the residuals (R, 4) of all windows and their derivatives."""

    effects: tuple[ActiveEffect, ...]
    states: Array
    residuals: Array
    columns: Array


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
    windows = _windows_of(recording)
    point = _evaluate(windows, tuple(effects), np.array(first_states(recording)))
    cost = _cost(windows, point, variance)
    for _ in range(settings.rounds):
        before = cost
        point = _improved(windows, point, variance, settings)
        updated = np.maximum(_mean_squares(windows, point), floor)
        if np.allclose(updated, variance, rtol=settings.variance_tolerance, atol=0.0):
            break
        variance = updated
        cost = _cost(windows, point, variance)
        if abs(before - cost) < settings.cost_tolerance:
            break
    return WindowFit(tuple(point.residuals[part] for part in windows.parts))


def true_inputs(recording: Recording, effects: Sequence[ActiveEffect]) -> Array:
    """The path's inputs, (N, 7): the recorded channels corrected for instrument errors, at the centre of gravity."""
    given = recording.inputs.copy()
    for active in reversed(effects):
        effect = active.effect
        if isinstance(effect, OutputEffect) and effect.where in DRIVING:
            j = GIVEN.index(effect.where)
            found = effect.corrected(recording.time, given[:, j], active.numbers)
            given[:, j] = with_ends_along(np.zeros_like(found), found, given[:, j])
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


def _evaluate(windows: _Windows, effects: tuple[ActiveEffect, ...], states: Array) -> _Point:
    recording = windows.recording
    given = true_inputs(recording, effects)
    directions, places = _directions(recording, effects, given)
    x_arm, _, z_arm = recording.positions.get("alpha", (0.0, 0.0, 0.0))
    here, along = given[windows.places], directions[windows.places]
    paths = [
        integrate_path(windows.time[part], here[part], state, along[part])
        for part, state in zip(windows.parts, states, strict=True)
    ]
    outputs, by_state, by_driving = observe(np.concatenate([path.states for path in paths]), here, x_arm, z_arm)
    moved = by_state @ np.concatenate([path.columns for path in paths])
    moved[:, :, _FREE:] += by_driving @ along
    slopes = np.zeros((*outputs.shape, _FREE + len(effects)))
    slopes[:, :, :_FREE] = moved[:, :, :_FREE]
    slopes[:, :, [_FREE + place for place in places]] = moved[:, :, _FREE:]
    _enter_sensors(windows, outputs, slopes, effects)
    residuals = np.where(windows.compared, windows.measured - outputs, 0.0)
    return _Point(effects, states, residuals, slopes * windows.compared[:, :, None])


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


def _enter_sensors(windows: _Windows, outputs: Array, slopes: Array, effects: Sequence[ActiveEffect]) -> None:
    """Apply the observed channels' errors to outputs and sensitivities, and enter their own columns, in place."""
    for n, active in enumerate(effects):
        effect = active.effect
        if not (isinstance(effect, OutputEffect) and effect.where in OBSERVED):
            continue
        i, perturbed = OBSERVED.index(effect.where), _perturbed(active)
        change = perturbed.values[0] - active.values[0]
        for part in windows.parts:
            time, true = windows.time[part], outputs[part, i : i + 1].copy()
            read = effect.output(time, true, active.numbers)
            moved = effect.output(time, true, perturbed.numbers)
            slopes[part, i] = effect.transform(time, np.ascontiguousarray(slopes[part, i]), active.numbers)
            slopes[part, i, _FREE + n] = (moved - read)[:, 0] / change
            outputs[part, i] = read[:, 0]


def _perturbed(active: ActiveEffect) -> ActiveEffect:
    """The effect with its parameter changed by its step, inside its limits."""
    step = active.effect.parameters[0].step
    perturbed = active.perturbed(0, step)
    return perturbed if perturbed.values != active.values else active.perturbed(0, -step)


def _mean_squares(windows: _Windows, point: _Point) -> Array:
    squares = point.residuals**2
    total = sum(np.sum(squares[part], axis=0) for part in windows.parts)
    return np.asarray(np.where(windows.counts > 0, total / np.maximum(windows.counts, 1), 1.0))


def _cost(windows: _Windows, point: _Point, variance: Array) -> float:
    """-2 ln L but for a constant."""
    cost = float(np.sum(windows.counts * (_mean_squares(windows, point) / variance + np.log(variance))))
    return cost if np.isfinite(cost) else np.inf


def _improved(windows: _Windows, point: _Point, variance: Array, settings: WindowFitSettings) -> _Point:
    """The best point at given noise variances, by Levenberg-Marquardt steps."""
    damping, cost = 1e-4, _cost(windows, point, variance)
    for _ in range(settings.steps):
        while True:
            trial = _evaluate(windows, *_moved(windows, point, variance, damping))
            reached = _cost(windows, trial, variance)
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


def _moved(windows: _Windows, point: _Point, variance: Array, damping: float) -> tuple[tuple[ActiveEffect, ...], Array]:
    """Instrument errors, kept within their limits, and initial states after a damped Gauss-Newton step."""
    columns, residuals = point.columns / np.sqrt(variance)[:, None], point.residuals / np.sqrt(variance)
    flat = [(columns[part].reshape(-1, columns.shape[2]), residuals[part].ravel()) for part in windows.parts]
    matrix = np.stack([slopes.T @ slopes for slopes, _ in flat])
    slope = np.stack([slopes.T @ residual for slopes, residual in flat])[:, :, None]
    by_states, mixed, count = matrix[:, :_FREE, :_FREE], matrix[:, :_FREE, _FREE:], len(point.effects)
    # Each window's own initial state is eliminated.
    taken = _solved(by_states, np.concatenate([mixed, slope[:, :_FREE]], axis=2), damping)
    left = matrix[:, _FREE:, :_FREE] @ taken
    normal = np.sum(matrix[:, _FREE:, _FREE:] - left[:, :, :-1], axis=0)
    gradient = np.sum(slope[:, _FREE:] - left[:, :, -1:], axis=0)
    step = _solved(normal, gradient, damping)[:, 0] if count else gradient[:, 0]
    effects = tuple(active.moved(step[n : n + 1]) for n, active in enumerate(point.effects))
    change = np.array([new.values[0] - old.values[0] for new, old in zip(effects, point.effects, strict=True)])
    right = slope[:, :_FREE] - mixed @ change.reshape(-1, 1)
    return effects, point.states + _solved(by_states, right, damping)[:, :, 0]


def _solved(matrix: Array, right: Array, damping: float) -> Array:
    """A X = B of stacked matrices after scaling to unit diagonal, damped; rows without information give 0."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), 0.0))
    shown = scale > 0.0
    unit = np.where(shown, scale, 1.0)[..., None]
    both = shown[..., :, None] & shown[..., None, :]
    scaled = np.where(both, matrix / (unit * np.swapaxes(unit, -2, -1)), 0.0)
    # A small damping suppresses steps in directions without information.
    scaled += (damping + 1e-12) * np.eye(matrix.shape[-1])
    return np.asarray(np.linalg.solve(scaled, np.where(shown[..., None], right / unit, 0.0)) / unit)
