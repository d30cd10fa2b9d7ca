"""Newton step of the linearised likelihood, noise variances concentrated out.

A search asks this dozens of times for each simulated flight; the matrices are small, and what array calls cost beside
them is most of the time. So the rounds are compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit


class Quadratic(NamedTuple):
    """-2 ln L to second order: of each output i at its noise variance, and of the a-priori knowledge.

    `normals` (8, M, M) and `gradients` (8, M) of the Gauss-Newton step, `squares` (8,) sum of the whitened residuals'
    squares, `counts` (8,) how many, `variance` (8,) SI squared; `prior_normal` (M, M), `prior_gradient` (M,).
    """

    normals: NDArray[np.float64]
    gradients: NDArray[np.float64]
    squares: NDArray[np.float64]
    counts: NDArray[np.float64]
    variance: NDArray[np.float64]
    prior_normal: NDArray[np.float64]
    prior_gradient: NDArray[np.float64]


@njit
def likeliest_step(
    about: Quadratic,
    active: NDArray[np.bool_],
    damping: float,
    floor: NDArray[np.float64],
    held: bool,
    rounds: int,
    share: float,
    enough: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float, float, float]:
    """The damped step, the noise variances at its end, its size, and what -2 ln L is at three places on the way.

    Parameters
    ----------
    active : (M,)
        Parameters that the data can move.
    floor : (8,)
        Least noise variances.
    held : bool
        Whether the variances keep their values.
    rounds : int
        At most so many of a step and the variances that it promises, in turn.
    share : float
        How far the variances go at first from their values to the likeliest ones, in their logarithm.
    enough : float
        Change of a variance's logarithm that ends the rounds.

    Returns
    -------
    step : (M,)
    variance : (8,)
    size : float
        Largest part of the step, scaled by the information.
    begun, between, ended : float
        -2 ln L beyond that of `about`: before the step at the variances of the first round, before it at those of the
        last, and after it. NaN, with the step, where the information is no number.
    """
    count = active.shape[0]
    variance = about.variance.copy()
    if not held:
        likeliest = likeliest_variance(about, about.squares, floor)
        for i in range(variance.shape[0]):
            variance[i] *= (likeliest[i] / variance[i]) ** share
    places = np.flatnonzero(active)
    size = places.shape[0]
    normal, gradient = at_variance(about, variance)
    begun = change_of_cost(about, variance)
    scale = _scale(normal, places)
    step, scaled, moved = np.zeros(count), np.zeros(size), 0.0
    for n in range(rounds):
        # The scale stays that of the first round: damping then holds back the same directions in all of them.
        scaled = _solved(normal, gradient, places, scale, damping)
        for a in range(size):
            step[places[a]] = scaled[a] / scale[a]
        if held or n + 1 == rounds:
            break
        after = likeliest_variance(about, squares_after(about, step), floor)
        moved = 0.0
        for i in range(variance.shape[0]):
            if about.counts[i] > 0.0:
                moved = max(moved, abs(np.log(after[i] / variance[i])))
                variance[i] = after[i]
        normal, gradient = at_variance(about, variance)
        if moved < enough:
            break
    between = change_of_cost(about, variance)
    ended = between
    for a in range(count):
        row = 0.0
        for b in range(count):
            row += normal[a, b] * step[b]
        ended += step[a] * (row - 2.0 * gradient[a])
    largest = 0.0
    for a in range(size):
        if not abs(scaled[a]) <= largest:  # a NaN too, which then stays
            largest = abs(scaled[a])
    return step, variance, largest, begun, between, ended


@njit
def predicted_decrease(about: Quadratic, active: NDArray[np.bool_], floor: NDArray[np.float64]) -> float:
    """Fall of -2 ln L, noise variances at their maximum before and after, that a full Gauss-Newton step promises."""
    places = np.flatnonzero(active)
    variance = likeliest_variance(about, about.squares, floor)
    normal, gradient = at_variance(about, variance)
    scale = _scale(normal, places)
    scaled = _solved(normal, gradient, places, scale, 1e-9)
    step = np.zeros(active.shape[0])
    for a in range(places.shape[0]):
        step[places[a]] = scaled[a] / scale[a]
    after = squares_after(about, step)
    fall = -change_of_cost(about, variance)
    for i in range(variance.shape[0]):
        if about.counts[i] > 0.0:
            least = about.counts[i] * floor[i] / about.variance[i]
            fall -= about.counts[i] * np.log(max(after[i], least) / about.squares[i])
    return fall


@njit
def likeliest_variance(
    about: Quadratic, squares: NDArray[np.float64], floor: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The noise variances (8,) that make whitened residuals with these sums of squares most likely, at least `floor`.

    Of outputs that were not measured their own.
    """
    variance = np.empty(about.variance.shape[0])
    for i in range(variance.shape[0]):
        share = squares[i] / max(about.counts[i], 1.0) if about.counts[i] > 0.0 else 1.0
        variance[i] = max(about.variance[i] * share, floor[i])
    return variance


@njit
def change_of_cost(about: Quadratic, variance: NDArray[np.float64]) -> float:
    """How much greater -2 ln L is at other noise variances (8,)."""
    change = 0.0
    for i in range(variance.shape[0]):
        ratio = about.variance[i] / variance[i]
        change += about.squares[i] * (ratio - 1.0) - about.counts[i] * np.log(ratio)
    return change


@njit
def at_variance(about: Quadratic, variance: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Information (M, M) and gradient (M,) at other noise variances (8,), with the a-priori knowledge."""
    normal, gradient = about.prior_normal.copy(), about.prior_gradient.copy()
    for i in range(variance.shape[0]):
        if about.counts[i] > 0.0:
            ratio = about.variance[i] / variance[i]
            for a in range(gradient.shape[0]):
                gradient[a] += ratio * about.gradients[i, a]
                for b in range(gradient.shape[0]):
                    normal[a, b] += ratio * about.normals[i, a, b]
    return normal, gradient


@njit
def squares_after(about: Quadratic, step: NDArray[np.float64]) -> NDArray[np.float64]:
    """What `squares` (8,) become after a step in the parameters (M,), to second order."""
    after = about.squares.copy()
    for i in range(after.shape[0]):
        if about.counts[i] > 0.0:
            for a in range(step.shape[0]):
                row = 0.0
                for b in range(step.shape[0]):
                    row += about.normals[i, a, b] * step[b]
                after[i] += step[a] * (row - 2.0 * about.gradients[i, a])
            after[i] = max(after[i], 1e-12 * about.squares[i])
    return after


@njit
def _scale(normal: NDArray[np.float64], places: NDArray[np.int64]) -> NDArray[np.float64]:
    """Roots of the information's diagonal, 1 where there is none."""
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
    matrix, slope, step = np.empty((size, size)), np.empty(size), np.full(size, np.nan)
    finite = True
    for a in range(size):
        slope[a] = gradient[places[a]] / scale[a]
        finite = finite and np.isfinite(slope[a])
        for b in range(size):
            matrix[a, b] = normal[places[a], places[b]] / (scale[a] * scale[b])
            finite = finite and np.isfinite(matrix[a, b])
        matrix[a, a] += damping
    if finite:
        step[:] = np.linalg.solve(matrix, slope)
    return step
