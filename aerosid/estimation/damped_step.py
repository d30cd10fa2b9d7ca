"""Damped Newton step of the linearised likelihood, noise variances concentrated out.

A search needs dozens of these for each simulated flight; the matrices are small, so that the overhead of array calls
would be most of the time. So the rounds are compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.signals.array_elements import copy_row, solve_by_elimination


class Quadratic(NamedTuple):
    """-2 ln L to second order: of each output i at its noise variance, and of the a-priori information.

    `normals` (m, M, M) and `gradients` (m, M) of the Gauss-Newton step, `squares` (m,) sum of the whitened residuals'
    squares, `counts` (m,) how many, `variance` (m,) SI squared; `prior_normal` (M, M), `prior_gradient` (M,).
    """

    normals: NDArray[np.float64]
    gradients: NDArray[np.float64]
    squares: NDArray[np.float64]
    counts: NDArray[np.float64]
    variance: NDArray[np.float64]
    prior_normal: NDArray[np.float64]
    prior_gradient: NDArray[np.float64]


@njit
def damped_newton_step(
    quadratic: Quadratic,
    active: NDArray[np.bool_],
    damping: float,
    floor: NDArray[np.float64],
    held: bool,
    rounds: int,
    fraction: float,
    enough: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, float, float]:
    """The damped step, the noise variances at its end, its size, and -2 ln L at three points.

    Parameters
    ----------
    active : (M,)
        Parameters that the data determine.
    floor : (m,)
        Least noise variances.
    held : bool
        Whether the variances keep their values.
    rounds : int
        Largest number of alternate updates of the step and the variances.
    fraction : float
        Of the first update of the variances to their maximum-likelihood values, in the logarithm.
    enough : float
        Change of a variance's logarithm that ends the rounds.

    Returns
    -------
    step : (M,)
    variance : (m,)
    size : float
        Largest component of the step, scaled by the information.
    before_step, at_final_variance, after_step : float
        -2 ln L less that of `quadratic`: before the step at the variances of the first round, before it at those of
        the last, and after it. NaN, with the step, where the information is NaN.
    """
    count = active.shape[0]
    variance = quadratic.variance.copy()
    if not held:
        likeliest = maximum_likelihood_variance(quadratic, quadratic.squares, floor)
        for i in range(variance.shape[0]):
            variance[i] *= (likeliest[i] / variance[i]) ** fraction
    places = np.flatnonzero(active)
    size = places.shape[0]
    normal, gradient = at_variance(quadratic, variance)
    before_step = change_of_cost(quadratic, variance)
    scale = _scale(normal, places)
    step, scaled, moved = np.zeros(count), np.zeros(size), 0.0
    for n in range(rounds):
        # The scale stays that of the first round, so that all rounds damp the same directions.
        scaled = _solved(normal, gradient, places, scale, damping)
        for a in range(size):
            step[places[a]] = scaled[a] / scale[a]
        if held or n + 1 == rounds:
            break
        after = maximum_likelihood_variance(quadratic, squares_after(quadratic, step), floor)
        moved = 0.0
        for i in range(variance.shape[0]):
            if quadratic.counts[i] > 0.0:
                moved = max(moved, abs(np.log(after[i] / variance[i])))
                variance[i] = after[i]
        normal, gradient = at_variance(quadratic, variance)
        if moved < enough:
            break
    at_final_variance = change_of_cost(quadratic, variance)
    after_step = at_final_variance
    for a in range(count):
        row = 0.0
        for b in range(count):
            row += normal[a, b] * step[b]
        after_step += step[a] * (row - 2.0 * gradient[a])
    largest = 0.0
    for a in range(size):
        if not abs(scaled[a]) <= largest:  # a NaN too, which then stays
            largest = abs(scaled[a])
    return step, variance, largest, before_step, at_final_variance, after_step


@njit
def predicted_decrease(quadratic: Quadratic, active: NDArray[np.bool_], floor: NDArray[np.float64]) -> float:
    """Decrease of -2 ln L, noise variances concentrated out, predicted for a full Gauss-Newton step."""
    places = np.flatnonzero(active)
    variance = maximum_likelihood_variance(quadratic, quadratic.squares, floor)
    normal, gradient = at_variance(quadratic, variance)
    scale = _scale(normal, places)
    scaled = _solved(normal, gradient, places, scale, 1e-9)
    step = np.zeros(active.shape[0])
    for a in range(places.shape[0]):
        step[places[a]] = scaled[a] / scale[a]
    after = squares_after(quadratic, step)
    fall = -change_of_cost(quadratic, variance)
    for i in range(variance.shape[0]):
        if quadratic.counts[i] > 0.0:
            least = quadratic.counts[i] * floor[i] / quadratic.variance[i]
            fall -= quadratic.counts[i] * np.log(max(after[i], least) / quadratic.squares[i])
    return fall


@njit
def maximum_likelihood_variance(
    quadratic: Quadratic, squares: NDArray[np.float64], floor: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Maximum-likelihood noise variances (m,) for these sums of squared whitened residuals, at least `floor`.

    Outputs that were not measured keep theirs.
    """
    variance = np.empty(quadratic.variance.shape[0])
    for i in range(variance.shape[0]):
        fraction = squares[i] / max(quadratic.counts[i], 1.0) if quadratic.counts[i] > 0.0 else 1.0
        variance[i] = max(quadratic.variance[i] * fraction, floor[i])
    return variance


@njit
def change_of_cost(quadratic: Quadratic, variance: NDArray[np.float64]) -> float:
    """Change of -2 ln L at other noise variances (m,)."""
    change = 0.0
    for i in range(variance.shape[0]):
        ratio = quadratic.variance[i] / variance[i]
        change += quadratic.squares[i] * (ratio - 1.0) - quadratic.counts[i] * np.log(ratio)
    return change


@njit
def at_variance(quadratic: Quadratic, variance: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Information (M, M) and gradient (M,) at other noise variances (m,), with the a-priori information."""
    normal, gradient = quadratic.prior_normal.copy(), quadratic.prior_gradient.copy()
    for i in range(variance.shape[0]):
        if quadratic.counts[i] > 0.0:
            ratio = quadratic.variance[i] / variance[i]
            for a in range(gradient.shape[0]):
                gradient[a] += ratio * quadratic.gradients[i, a]
                for b in range(gradient.shape[0]):
                    normal[a, b] += ratio * quadratic.normals[i, a, b]
    return normal, gradient


@njit
def squares_after(quadratic: Quadratic, step: NDArray[np.float64]) -> NDArray[np.float64]:
    """`squares` (m,) after a step in the parameters (M,), to second order."""
    after = quadratic.squares.copy()
    for i in range(after.shape[0]):
        if quadratic.counts[i] > 0.0:
            for a in range(step.shape[0]):
                row = 0.0
                for b in range(step.shape[0]):
                    row += quadratic.normals[i, a, b] * step[b]
                after[i] += step[a] * (row - 2.0 * quadratic.gradients[i, a])
            after[i] = max(after[i], 1e-12 * quadratic.squares[i])
    return after


@njit
def _scale(normal: NDArray[np.float64], places: NDArray[np.int64]) -> NDArray[np.float64]:
    """Square roots of the information's diagonal, 1 where it is zero."""
    scale = np.ones(places.shape[0])
    for a in range(places.shape[0]):
        if normal[places[a], places[a]] != 0.0:
            scale[a] = np.sqrt(normal[places[a], places[a]])
    return scale


@njit
def _solved(
    normal: NDArray[np.float64],
    gradient: NDArray[np.float64],
    places: NDArray[np.int64],
    scale: NDArray[np.float64],
    damping: float,
) -> NDArray[np.float64]:
    """The step in units of 1 / `scale`, NaN where something is no number."""
    size = places.shape[0]
    matrix, slope, step = np.empty((size, size)), np.empty((size, 1)), np.full(size, np.nan)
    finite = True
    for a in range(size):
        slope[a, 0] = gradient[places[a]] / scale[a]
        finite = finite and np.isfinite(slope[a, 0])
        for b in range(size):
            matrix[a, b] = normal[places[a], places[b]] / (scale[a] * scale[b])
            finite = finite and np.isfinite(matrix[a, b])
        matrix[a, a] += damping
    if finite:
        solve_by_elimination(matrix, slope)
        copy_row(step, slope[:, 0])
    return step
