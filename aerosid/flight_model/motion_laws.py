"""Laws of flow separation and ground effect, sample by sample, with their partial derivatives.

The equations stand in `aerosid.effects.flow_separation` and `aerosid.effects.ground_effect`. A law sees the motion up
to its own sample alone, so that it can be integrated with the motion: the rate of alpha is that of the parabola through
the last three samples, and zero at the first, where the flow is in its steady state.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.layout import Layout, state_places
from aerosid.signals.delay_and_lag import lag_slopes, lag_weights


class Law(IntEnum):
    """How an effect follows from the motion: what `aerosid.flight_model.motion_laws` computes."""

    SEPARATION = 0
    GROUND = 1


SEPARATION, GROUND = int(Law.SEPARATION), int(Law.GROUND)
REMEMBERED = 4
"""Layout: numbers that a law hands on to the next sample: separation keeps alpha, alpha before it, static and actual
point."""


class Feedback(NamedTuple):
    """The effects of a flight that depend on its motion, as arrays: K effects with P numbers and S offsets in all.

    `law` (K); `first_number` and `first_column` (K + 1); `numbers` (P); `columns` (S) of the extra inputs, to which
    the offsets are added; `slope` (K) the alpha derivative that a law takes; `coefficient` (K) the row of the
    coefficient to which it is proportional, -1 for none; `ground` [m] the altitude of the ground; `layout` of the case.
    """

    law: NDArray[np.int64]
    first_number: NDArray[np.int64]
    first_column: NDArray[np.int64]
    numbers: NDArray[np.float64]
    columns: NDArray[np.int64]
    slope: NDArray[np.float64]
    coefficient: NDArray[np.int64]
    ground: float
    layout: Layout


_Height = TypeVar("_Height", float, NDArray[np.float64])


def influence(height: _Height, reach: float) -> _Height:
    """Sigma, 1 on the ground and 0 far from it, for a height, one or (N,), and a span in m."""
    sigma: _Height = np.exp(-2.48 * (2.0 * np.maximum(height, 0.0) / reach) ** 0.768)
    return sigma


_influence = njit(influence)


class Places(NamedTuple):
    """The columns of sensitivities of the laws' `numbers` (P) and of their alpha derivatives, `slope` (K); -1: none."""

    numbers: NDArray[np.int64]
    slope: NDArray[np.int64]


class LawSlopes(NamedTuple):
    """How the offsets of one sample move, for M parameters.

    `by_state` (S, n) with the state of that sample; `moved` (S, M) with all that was before it, and with the parameters
    directly. Of what is remembered: `known` (K, 2, M) and `by_alpha` (K, 2) the same of static and actual separation
    point; `columns` (K, 4, M) of the sample before.
    """

    by_state: NDArray[np.float64]
    moved: NDArray[np.float64]
    known: NDArray[np.float64]
    by_alpha: NDArray[np.float64]
    columns: NDArray[np.float64]


@njit_inline
def offsets_at(
    k: int,
    time: NDArray[np.float64],
    x: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    feedback: Feedback,
    memory: NDArray[np.float64],
    kept: NDArray[np.float64],
    offsets: NDArray[np.float64],
) -> None:
    """Write the `offsets` (S) at sample `k`, and what the laws remember of it, `kept` (K, 4).

    Parameters
    ----------
    x : (n,) the state at the sample; `memory` (K, 4) what was kept of the sample before.
    coefficients : (K,) at the sample, without these effects.
    """
    for n in range(feedback.law.shape[0]):
        if feedback.law[n] == SEPARATION:
            _separated(k, time, x, feedback, n, memory[n], kept[n], offsets)
        else:
            first = feedback.first_number[n]
            change = feedback.numbers[first] * _influence(
                x[state_places(feedback.layout).h] - feedback.ground, feedback.numbers[first + 1]
            )
            if feedback.coefficient[n] >= 0:
                change *= coefficients[feedback.coefficient[n]]
            offsets[feedback.first_column[n]] = change


@njit_inline
def _rate_weights(k: int, time: NDArray[np.float64]) -> tuple[float, float, float]:
    """Weights of this sample, the one before and that before it in the rate at this one."""
    if k == 0:
        return 0.0, 0.0, 0.0
    last = time[k] - time[k - 1]
    if k == 1:
        return 1.0 / last, -1.0 / last, 0.0
    previous = time[k - 1] - time[k - 2]
    both = last + previous
    return 1.0 / last + 1.0 / both, -1.0 / last - 1.0 / previous, last / (previous * both)


@njit_inline
def _static_point(alpha: float, rate: float, star: float, sharpness: float, delay: float) -> float:
    """The separation point in steady flow."""
    return float(0.5 * (1.0 - np.tanh(sharpness * (alpha - delay * rate - star))))


@njit_inline
def _lagged_point(point: float, before: float, static: float, interval: float, relaxation: float) -> float:
    """The separation point an interval later, as that in steady flow moves from `before` to `static`."""
    decay, old, new = lag_weights(interval, relaxation)
    return float(decay * point + old * before + new * static)


@njit_inline
def _lost_lift(point: float) -> float:
    """Change of the lift by the alpha derivative over that lift."""
    share = 0.5 * (1.0 + np.sqrt(point))
    return float(share * share - 1.0)


def factor_places(law: Law, columns: int) -> tuple[int | None, ...]:
    """Which of a law's numbers is a factor of each of its `columns`; None: the alpha derivative is."""
    return (0,) if law is Law.GROUND else (None, *range(4, 3 + columns))


def offsets_of_unit_size(
    law: Law,
    numbers: tuple[float, ...],
    columns: int,
    time: NDArray[np.float64],
    course: tuple[NDArray[np.float64], ...],
) -> tuple[NDArray[np.float64], ...]:
    """What a law adds to each of its columns along a given motion with every factor one, (N,) each.

    Parameters
    ----------
    numbers : (P,) of the law; those of `factor_places` are not used.
    columns : how many it adds to.
    time : (N,) s.
    course : angle of attack, rad, its rate as of `rate_up_to_now`, rad/s, and height over the ground, m, (N,) each.
    """
    alpha, rate, height = course
    if law is Law.GROUND:
        return (np.asarray(influence(height, numbers[1])),)
    lost, separated = _separated_along(time, alpha, rate, *numbers[:4])
    return (lost, *(columns - 1) * (separated,))


@njit
def _separated_along(
    time: NDArray[np.float64],
    alpha: NDArray[np.float64],
    rate: NDArray[np.float64],
    star: float,
    sharpness: float,
    delay: float,
    relaxation: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Change of lift for an alpha derivative of one, and the separated part of the chord, (N,) each."""
    lost, separated = np.empty(alpha.shape[0]), np.empty(alpha.shape[0])
    static = point = 0.0
    for k in range(alpha.shape[0]):
        before, static = static, _static_point(alpha[k], rate[k], star, sharpness, delay)
        point = static if k == 0 else _lagged_point(point, before, static, time[k] - time[k - 1], relaxation)
        lost[k] = alpha[k] * _lost_lift(point)
        separated[k] = 1.0 - point
    return lost, separated


@njit
def rate_up_to_now(time: NDArray[np.float64], alpha: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rate at each sample of the parabola through it and the two before, unit/s, (N,); zero at the first."""
    rate = np.empty(alpha.shape[0])
    for k in range(alpha.shape[0]):
        here, before, earlier = _rate_weights(k, time)
        rate[k] = here * alpha[k] + before * alpha[max(k - 1, 0)] + earlier * alpha[max(k - 2, 0)]
    return rate


@njit_inline
def _separated(
    k: int,
    time: NDArray[np.float64],
    x: NDArray[np.float64],
    feedback: Feedback,
    n: int,
    memory: NDArray[np.float64],
    kept: NDArray[np.float64],
    offsets: NDArray[np.float64],
) -> None:
    first, column = feedback.first_number[n], feedback.first_column[n]
    star, sharpness = feedback.numbers[first], feedback.numbers[first + 1]
    delay, relaxation = feedback.numbers[first + 2], feedback.numbers[first + 3]
    at = state_places(feedback.layout)
    alpha = np.arctan2(x[at.w], x[at.u])
    here, before, earlier = _rate_weights(k, time)
    rate = here * alpha + before * memory[0] + earlier * memory[1]
    static = _static_point(alpha, rate, star, sharpness, delay)
    point = static
    if k > 0:
        point = _lagged_point(memory[3], memory[2], static, time[k] - time[k - 1], relaxation)
    kept[0], kept[1], kept[2], kept[3] = alpha, memory[0], static, point
    offsets[column] = feedback.slope[n] * alpha * _lost_lift(point)
    for i in range(1, feedback.first_column[n + 1] - column):
        offsets[column + i] = feedback.numbers[first + 3 + i] * (1.0 - point)


@njit_inline
def slopes_at(
    k: int,
    time: NDArray[np.float64],
    x: NDArray[np.float64],
    coefficient: NDArray[np.float64],
    coefficient_x: NDArray[np.float64],
    coefficient_moved: NDArray[np.float64],
    feedback: Feedback,
    places: Places,
    memory: NDArray[np.float64],
    kept: NDArray[np.float64],
    slopes: LawSlopes,
) -> None:
    """Write `by_state`, `moved`, `known` and `by_alpha` of sample `k`.

    Parameters
    ----------
    coefficient : (K,) that each law is proportional to, 1 where there is none; how it moves with the state,
        `coefficient_x` (K, n), and directly with the parameters, `coefficient_moved` (K, M).
    memory, kept : (K, 4) as in `offsets_at`.
    """
    at = state_places(feedback.layout)
    square = x[at.u] * x[at.u] + x[at.w] * x[at.w]
    for n in range(feedback.law.shape[0]):
        if feedback.law[n] == SEPARATION:
            _separated_slopes(k, time, x, square, feedback, n, places, memory[n], kept[n], slopes)
        else:
            _near_ground_slopes(x, coefficient[n], coefficient_x[n], coefficient_moved[n], feedback, n, places, slopes)


@njit_inline
def _separated_slopes(
    k: int,
    time: NDArray[np.float64],
    x: NDArray[np.float64],
    square: float,
    feedback: Feedback,
    n: int,
    places: Places,
    memory: NDArray[np.float64],
    kept: NDArray[np.float64],
    slopes: LawSlopes,
) -> None:
    first, column = feedback.first_number[n], feedback.first_column[n]
    star, sharpness = feedback.numbers[first], feedback.numbers[first + 1]
    delay, relaxation = feedback.numbers[first + 2], feedback.numbers[first + 3]
    alpha, static, point = kept[0], kept[2], kept[3]
    here, before, earlier = _rate_weights(k, time)
    rate = here * alpha + before * memory[0] + earlier * memory[1]
    lean = alpha - delay * rate - star
    bend = np.tanh(sharpness * lean)
    steep = -0.5 * (1.0 - bend * bend)
    count = slopes.moved.shape[1]
    decay, old, new, decay_slope, old_slope, new_slope = 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    if k > 0:
        interval = time[k] - time[k - 1]
        decay, old, new = lag_weights(interval, relaxation)
        decay_slope, old_slope, new_slope = lag_slopes(interval, relaxation)
    columns, settled, actual = slopes.columns[n], slopes.known[n, 0], slopes.known[n, 1]
    for c in range(count):
        settled[c] = -steep * sharpness * delay * (before * columns[0, c] + earlier * columns[1, c])
    _add(settled, places.numbers[first], -steep * sharpness)
    _add(settled, places.numbers[first + 1], steep * lean)
    _add(settled, places.numbers[first + 2], -steep * sharpness * rate)
    for c in range(count):
        actual[c] = decay * columns[3, c] + old * columns[2, c] + new * settled[c]
    _add(actual, places.numbers[first + 3], decay_slope * memory[3] + old_slope * memory[2] + new_slope * static)
    slopes.by_alpha[n, 0] = steep * sharpness * (1.0 - delay * here)
    slopes.by_alpha[n, 1] = new * slopes.by_alpha[n, 0]

    root = np.sqrt(point)
    lost = 0.25 * (1.0 + root) * (1.0 + root) - 1.0
    # Where all is separated the point itself moves as fast as its root grows steep.
    by_point = feedback.slope[n] * alpha * (0.25 * (1.0 + root) / root if root > 1e-12 else 0.0)
    at = state_places(feedback.layout)
    alpha_u, alpha_w = -x[at.w] / square, x[at.u] / square
    for i in range(feedback.first_column[n + 1] - column):
        if i > 0:
            by_point = -feedback.numbers[first + 3 + i]
        by_alpha = by_point * slopes.by_alpha[n, 1] + (feedback.slope[n] * lost if i == 0 else 0.0)
        for a in range(at.total):
            slopes.by_state[column + i, a] = 0.0
        slopes.by_state[column + i, at.u] = by_alpha * alpha_u
        slopes.by_state[column + i, at.w] = by_alpha * alpha_w
        for c in range(count):
            slopes.moved[column + i, c] = by_point * actual[c]
        if i == 0:
            _add(slopes.moved[column], places.slope[n], alpha * lost)
        else:
            _add(slopes.moved[column + i], places.numbers[first + 3 + i], 1.0 - point)


@njit_inline
def _near_ground_slopes(
    x: NDArray[np.float64],
    coefficient: float,
    coefficient_x: NDArray[np.float64],
    coefficient_moved: NDArray[np.float64],
    feedback: Feedback,
    n: int,
    places: Places,
    slopes: LawSlopes,
) -> None:
    first, column = feedback.first_number[n], feedback.first_column[n]
    gain, reach, height = (
        feedback.numbers[first],
        feedback.numbers[first + 1],
        x[state_places(feedback.layout).h] - feedback.ground,
    )
    near = _influence(height, reach)
    by_height, by_reach = 0.0, 0.0
    if height > 0.0:  # sigma = exp(-2.48 (2 h/b)^0.768) is a function of h/b alone
        by_height = 0.768 * near * np.log(near) / height if near > 0.0 else 0.0
        by_reach = -by_height * height / reach
    at = state_places(feedback.layout)
    for a in range(at.total):
        slopes.by_state[column, a] = gain * near * coefficient_x[a]
    slopes.by_state[column, at.h] += gain * by_height * coefficient
    for c in range(slopes.moved.shape[1]):
        slopes.moved[column, c] = gain * near * coefficient_moved[c]
    _add(slopes.moved[column], places.numbers[first], near * coefficient)
    _add(slopes.moved[column], places.numbers[first + 1], gain * by_reach * coefficient)


@njit_inline
def remember(x: NDArray[np.float64], state: NDArray[np.float64], feedback: Feedback, slopes: LawSlopes) -> None:
    """Keep of a sample for the next how its memory moves, from the sensitivities (n, M) of its `state` at `x`."""
    at = state_places(feedback.layout)
    square = x[at.u] * x[at.u] + x[at.w] * x[at.w]
    alpha_u, alpha_w = -x[at.w] / square, x[at.u] / square
    for n in range(feedback.law.shape[0]):
        if feedback.law[n] == SEPARATION:
            columns, known, by_alpha = slopes.columns[n], slopes.known[n], slopes.by_alpha[n]
            for c in range(columns.shape[1]):
                alpha = alpha_u * state[at.u, c] + alpha_w * state[at.w, c]
                columns[1, c] = columns[0, c]
                columns[0, c] = alpha
                columns[2, c] = known[0, c] + by_alpha[0] * alpha
                columns[3, c] = known[1, c] + by_alpha[1] * alpha


@njit_inline
def _add(row: NDArray[np.float64], place: int, value: float) -> None:
    if place >= 0:
        row[place] += value
