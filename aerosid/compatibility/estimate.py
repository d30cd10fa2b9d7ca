"""Maximum-likelihood estimates of instrument faults and gusts from kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.faults import Fault
from aerosid.compatibility.likelihood import STATE_PLACES, STATES, Gust, Structure, simulate, whiten
from aerosid.compatibility.recording import Recording, first_states, spread
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.signals.factor_search import search_in_factors
from aerosid.signals.residual_covariance import coloured_covariance_groups, published_covariance_groups

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FitSettings:
    """Settings of one fit.

    Attributes
    ----------
    steps : int
        Levenberg-Marquardt steps at given noise levels.
    rounds : int
        Rounds of noise levels.
    cost_tolerance : float
        Fall of -2 ln L that decides nothing.
    variance_tolerance : float
        Relative change of a noise variance that counts as none.
    few_stretches : int
        Stretches up to which initial states stand beside the faults in the corrected covariance; of more they are taken
        out.
    quick_shortfall : float
        Times by which the published correction falls short on records of some hundred samples, 1; as of the flight's
        own fit.
    least_independence : float
        Share of a fault's squares, 1, below which it is another name for what is in: 3 % of its effect is its own.
        Chosen.
    """

    steps: int = 12
    rounds: int = 8
    cost_tolerance: float = 0.05
    variance_tolerance: float = 5e-3
    few_stretches: int = 4
    quick_shortfall: float = 1.15
    least_independence: float = 1e-3


USUAL = FitSettings()
"""What is kept."""

TRIAL = FitSettings(steps=6, rounds=2, cost_tolerance=0.5, variance_tolerance=0.05)
"""A trial decides between structures that differ by many units of -2 ln L."""

STEP = FitSettings(steps=8, rounds=3, cost_tolerance=0.3, variance_tolerance=0.03)
"""What entered is fitted this well before the next one is looked for."""


@dataclass(frozen=True)
class Fit:
    """The most likely numbers of one structure.

    Attributes
    ----------
    structure : Structure
        Faults with their numbers, and the air.
    states : tuple of ndarray, shape (5,)
        Initial state of every stretch.
    variance : ndarray, shape (8,)
        Noise variance of each output, SI squared; 1 where there is none.
    cost : float
        -2 ln L but for a constant.
    information : ndarray, shape (P, P)
        Of the faults' numbers, the initial states taken out.
    """

    structure: Structure
    states: tuple[Array, ...]
    variance: Array
    cost: float
    information: Array


@dataclass(frozen=True)
class _Point:
    structure: Structure
    states: tuple[Array, ...]
    variance: Array
    cost: float
    blocks: tuple[tuple[Array, Array], ...]
    mean_square: Array


def fit(
    recordings: Sequence[Recording],
    structure: Structure,
    start: Fit | None = None,
    settings: FitSettings = FitSettings(),
    *,
    gusts: bool = True,
) -> Fit:
    """The most likely faults' numbers, initial states, noise levels and gusts.

    Parameters
    ----------
    structure : Structure
        Which faults and gusts, and where to begin; still air stays still.
    start : Fit, optional
        Initial states and noise levels to begin with.
    gusts : bool
        Whether the numbers of the gusts are estimated too, or kept.
    """
    states = first_states_of(recordings) if start is None else start.states
    variance = starting_variance(recordings) if start is None else start.variance
    floor = 0.25 * starting_variance(recordings)
    new = start is None or start.structure.gust != structure.gust
    point = _evaluate(recordings, structure, states, variance)
    for n in range(settings.rounds):
        before = point.cost
        point = _levenberg_marquardt(recordings, point, settings)
        if gusts:
            point = _likeliest_gust(recordings, point, (2.0, 1.2) if n == 0 and new else (1.2,))
        # A path that its driving noise lets wander can explain all of an output: half the log's own noise stays.
        updated = np.maximum(point.variance * point.mean_square, floor)
        if np.allclose(updated, point.variance, rtol=settings.variance_tolerance, atol=0.0):
            break
        point = _evaluate(recordings, point.structure, point.states, updated)
        if abs(before - point.cost) < settings.cost_tolerance:
            break
    information, _ = _without_states(point.blocks, 0.0)
    return Fit(point.structure, point.states, point.variance, point.cost, information)


def first_states_of(recordings: Sequence[Recording]) -> tuple[Array, ...]:
    """A first guess of the initial state of every stretch of every recording."""
    return tuple(state for recording in recordings for state in first_states(recording))


def starting_variance(recordings: Sequence[Recording]) -> Array:
    """Noise variances of the logs; 1 for outputs that are not there."""
    variance = np.ones(len(LONGITUDINAL.outputs))
    for recording in recordings:
        for name in recording.outputs:
            place = LONGITUDINAL.outputs.index(name)
            samples = np.concatenate([other.measured[:, place] for other in recordings])
            least = 1e-6 * float(np.std(samples[np.isfinite(samples)])) + 1e-12
            variance[place] = max(spread(recordings, name), least) ** 2
    return variance


def _evaluate(
    recordings: Sequence[Recording], structure: Structure, states: Sequence[Array], variance: Array
) -> _Point:
    squares, counts, cost = np.zeros(len(LONGITUDINAL.outputs)), np.zeros(len(LONGITUDINAL.outputs)), 0.0
    blocks = []
    stretches = simulate(recordings, structure, states)
    for part in whiten(recordings, stretches, structure.gust, variance):
        residual = np.nan_to_num(part.residual)
        flat = part.columns.reshape(-1, part.columns.shape[2])
        blocks.append((flat.T @ flat, flat.T @ residual.ravel()))
        squares += np.sum(residual**2, axis=0)
        counts += np.isfinite(part.residual).sum(axis=0)
        cost += part.log_sum
    cost += float(squares.sum())
    mean_square = np.where(counts > 0, squares / np.maximum(counts, 1), 1.0)
    cost = cost if np.isfinite(cost) else np.inf
    return _Point(structure, tuple(states), variance, cost, tuple(blocks), mean_square)


def _without_states(blocks: Sequence[tuple[Array, Array]], damping: float) -> tuple[Array, Array]:
    """Information and gradient of the faults' numbers with every stretch's initial state taken out."""
    count = blocks[0][1].size - STATES
    normal, gradient = np.zeros((count, count)), np.zeros(count)
    for matrix, slope in blocks:
        taken = _solve(matrix[:STATES, :STATES], np.column_stack([matrix[:STATES, STATES:], slope[:STATES]]), damping)
        normal += matrix[STATES:, STATES:] - matrix[STATES:, :STATES] @ taken[:, :-1]
        gradient += slope[STATES:] - matrix[STATES:, :STATES] @ taken[:, -1]
    return normal, gradient


def _solve(matrix: Array, right: Array, damping: float) -> Array:
    """A x = b after scaling to unit diagonal, damped; rows without information give 0."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    held = scale > 0.0
    result = np.zeros_like(right)
    if held.any():
        unit = scale[held]
        scaled = matrix[np.ix_(held, held)] / np.outer(unit, unit)
        # A grain of damping keeps directions that hold nothing to rounding at rest.
        scaled += (damping + 1e-12) * np.eye(unit.size)
        by_row = unit if right.ndim == 1 else unit[:, None]
        result[held] = np.linalg.solve(scaled, right[held] / by_row) / by_row
    return result


def _levenberg_marquardt(recordings: Sequence[Recording], point: _Point, settings: FitSettings) -> _Point:
    """The best point at given noise levels and gusts."""
    damping = 1e-4
    for _ in range(settings.steps):
        while True:
            trial = _evaluate(recordings, *_moved(point, damping), point.variance)
            if trial.cost <= point.cost + 1e-9 * abs(point.cost):
                break
            damping *= 10.0
            if damping > 1e8:
                return point
        damping = max(0.1 * damping, 1e-9)
        fall = point.cost - trial.cost
        point = trial
        if fall < settings.cost_tolerance:
            break
    return point


def _moved(point: _Point, damping: float) -> tuple[Structure, tuple[Array, ...]]:
    """Structure and states after a damped Gauss-Newton step, faults kept within their limits."""
    count = len(point.structure.values)
    normal, gradient = _without_states(point.blocks, damping)
    step = _solve(normal, gradient, damping) if count else np.zeros(0)
    values = tuple(
        float(np.clip(value + change, fault.lowest, fault.highest))
        for fault, value, change in zip(point.structure.faults, point.structure.values, step, strict=True)
    )
    taken = np.array(values) - np.array(point.structure.values)
    states = []
    for state, (matrix, slope) in zip(point.states, point.blocks, strict=True):
        moved = state.copy()
        moved[STATE_PLACES] += _solve(
            matrix[:STATES, :STATES], slope[:STATES] - matrix[:STATES, STATES:] @ taken, damping
        )
        states.append(moved)
    return replace(point.structure, values=values), tuple(states)


LIMITS = {
    "sigma_w": (1e-3, 20.0),
    "length_w": (5.0, 533.0),
    "sigma_u": (1e-3, 20.0),
    "length_u": (5.0, 533.0),
}
"""Of the gusts' numbers; 533 m is Dryden's scale length at altitude (MIL-F-8785C), beyond which wind is steady."""


def _likeliest_gust(recordings: Sequence[Recording], point: _Point, factors: tuple[float, ...]) -> _Point:
    """The point with the numbers of its gusts moved to where the likelihood is greater, one by one."""
    gust = point.structure.gust
    names = [name for axis in "wu" if getattr(gust, f"sigma_{axis}") > 0.0
             for name in (f"sigma_{axis}", f"length_{axis}")]  # fmt: skip
    if not names:
        return point
    # The path does not depend on them: it is simulated once, and only residuals are whitened again.
    stretches = [
        replace(stretch, block=np.ascontiguousarray(stretch.block[:, :, :1]))
        for stretch in simulate(recordings, point.structure, point.states)
    ]

    def blowing(numbers: tuple[float, ...]) -> Gust:
        return replace(gust, **dict(zip(names, numbers, strict=True)))

    def cost(numbers: tuple[float, ...]) -> float:
        total = 0.0
        for part in whiten(recordings, stretches, blowing(numbers), point.variance):
            total += part.log_sum + float(np.nansum(part.residual**2))
        return total if np.isfinite(total) else np.inf

    start = tuple(getattr(gust, name) for name in names)
    found = search_in_factors(cost, start, [LIMITS[name] for name in names], factors, least_fall=1e-2)
    if found == start:
        return point
    return _evaluate(recordings, replace(point.structure, gust=blowing(found)), point.states, point.variance)


@dataclass(frozen=True)
class Score:
    """What a fault that is not in would bring: fall of -2 ln L, and the number that a linear step gives it."""

    fault: Fault
    gain: float
    value: float


def score(recordings: Sequence[Recording], at: Fit, faults: Sequence[Fault]) -> tuple[Score, ...]:
    """The faults that are not in, with what each alone would bring, greatest first.

    Notes
    -----
    Rao's score test, what is in and the initial states projected out. A delay's column is taken over several
    distances, the best of which counts.
    """
    tested = [(fault, distance) for fault in faults for distance in fault.trials]
    if not tested:
        return ()
    normal, gradient = normal_equations(recordings, at, tested)
    own = len(at.structure.faults)
    best: dict[Fault, Score] = {}
    for n, (fault, _) in enumerate(tested, start=own):
        cross = normal[:own, n]
        left = normal[n, n] - float(cross @ _solve(normal[:own, :own], cross, 0.0)) if own else normal[n, n]
        slope = gradient[n] - float(cross @ _solve(normal[:own, :own], gradient[:own], 0.0)) if own else gradient[n]
        if not left > USUAL.least_independence * normal[n, n]:
            continue
        value = float(np.clip(fault.null + slope / left, fault.lowest, fault.highest))
        found = Score(fault, float(slope**2 / left), value)
        if fault not in best or found.gain > best[fault].gain:
            best[fault] = found
    return tuple(sorted(best.values(), key=lambda each: -each.gain))


def normal_equations(
    recordings: Sequence[Recording], at: Fit, tested: Sequence[tuple[Fault, float]]
) -> tuple[Array, Array]:
    """Information and gradient of the acting and the tested faults, the initial states taken out."""
    blocks = []
    stretches = simulate(recordings, at.structure, at.states, tested)
    for part in whiten(recordings, stretches, at.structure.gust, at.variance):
        flat = part.columns.reshape(-1, part.columns.shape[2])
        blocks.append((flat.T @ flat, flat.T @ np.nan_to_num(part.residual).ravel()))
    return _without_states(blocks, 0.0)


def deviations(recordings: Sequence[Recording], at: Fit, *, quick: bool = False) -> tuple[Array, Array]:
    """Standard deviations of the faults' numbers: corrected for the residuals' colour, and as if they were white."""
    count = len(at.structure.faults)
    if count == 0:
        return np.zeros(0), np.zeros(0)
    white = np.sqrt(np.diag(_solve(at.information, np.eye(count), 0.0)))
    stretches = simulate(recordings, at.structure, at.states)
    parts = list(whiten(recordings, stretches, at.structure.gust, at.variance))
    joint = len(parts) <= USUAL.few_stretches
    groups, offset = [], 0
    for part in parts:
        columns = part.columns
        if joint:
            wide = np.zeros((*columns.shape[:2], count + STATES * len(parts)))
            wide[:, :, :count] = columns[:, :, STATES:]
            wide[:, :, count + offset : count + offset + STATES] = columns[:, :, :STATES]
            offset += STATES
        else:
            flat = columns.reshape(-1, columns.shape[2])
            by_state = flat[:, :STATES]
            taken = _solve(by_state.T @ by_state, by_state.T @ flat[:, STATES:], 0.0)
            wide = columns[:, :, STATES:] - columns[:, :, :STATES] @ taken
        for i in range(len(LONGITUDINAL.outputs)):
            held = np.isfinite(part.residual[:, i])
            if held.sum() > 2:
                groups.append((wide[held, i, :], part.residual[held, i], 1.0))
    moving = np.flatnonzero(sum(np.sum(x**2, axis=0) for x, _, _ in groups) > 0.0)
    chosen = [(x[:, moving], r, w) for x, r, w in groups]
    try:
        if quick:
            covariance = USUAL.quick_shortfall**2 * published_covariance_groups(chosen)
        else:
            covariance = coloured_covariance_groups(chosen).corrected
    except ValueError:
        return np.full(count, np.inf), white
    corrected = np.full(count, np.inf)
    inside = moving < count
    variance = np.diag(covariance)[inside]
    corrected[moving[inside]] = np.sqrt(np.maximum(variance, 0.0))
    return np.maximum(corrected, white), white
