"""Parallel maximum-likelihood fits of competing structures or starts, with early termination of the worse ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.threads import mapped_in_threads
from aerosid.effects import ActiveEffect
from aerosid.errors import EstimationError
from aerosid.estimation import damped_step
from aerosid.estimation.damped_search import UNDAMPED, full_step, levenberg_marquardt_step
from aerosid.estimation.fit_settings import COMPETING_FITS, RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import (
    Refinement,
    Start,
    first_point,
    refine_on,
    refinement_at,
    simulated_point,
)


def fit_competing_structures(
    starts: Sequence[Start],
    manoeuvres: Sequence[Manoeuvre],
    settings: RefinementSettings,
    penalties: Sequence[float],
    level: float | None = None,
    margin: float = 0.0,
    *,
    near: bool = True,
) -> list[Refinement]:
    """Estimates from several starting points; those that cannot become the best are terminated early.

    Parameters
    ----------
    starts : sequence of Start
        The competing structures or start values, on the same manoeuvres.
    penalties : sequence of float
        Penalty of each structure, added to its -2 ln L in the comparison.
    level : float, optional
        Penalised -2 ln L that the fits are compared with; without one, the least of all fits at the time.
    margin : float
        Difference to that level within which a fit is still of interest.
    near : bool
        Whether a start whose likelihood is known is near its maximum: it may be terminated one step earlier.

    Returns
    -------
    list of Refinement
        In the order of `starts`; a terminated fit as it was at that time, `converged` false; a start that cannot be
        simulated as it is, at an infinite -2 ln L.

    Notes
    -----
    All fits make one step in turn, distributed over the cores. After two, or after one from a known likelihood or one
    that decreased -2 ln L as far as it was predicted to, a fit is terminated where even several times the decrease
    predicted by its linearisation would leave it above the level. With a given level the fits are independent, and each
    is completed at once. A fit that returns to an estimate that is `known` is terminated on the way.
    """
    if level is not None and len(starts) > 1:

        def fit_one(one: tuple[Start, float]) -> Refinement:
            return fit_competing_structures([one[0]], manoeuvres, settings, [one[1]], level, margin, near=near)[0]

        return mapped_in_threads(fit_one, list(zip(starts, penalties, strict=True)))
    likelihoods = [Likelihood(start.model, tuple(manoeuvres), start.free) for start in starts]

    def first(n: int) -> Point | None:
        try:
            return first_point(likelihoods[n], starts[n], settings)
        except EstimationError:
            return None

    initial = mapped_in_threads(first, range(len(starts)))
    points = {n: point for n, point in enumerate(initial) if point is not None}
    converged, dampings = [False] * len(starts), [UNDAMPED] * len(starts)
    active = list(points)

    def stepped(n: int) -> tuple[Point, bool, float] | None:
        return levenberg_marquardt_step(likelihoods[n], points[n], settings, hold_variance=False, damping=dampings[n])

    for turn in range(settings.steps):
        as_predicted, returning = set(), set()
        for n, better in zip(active, mapped_in_threads(stepped, active), strict=True):
            converged[n] = better is None or better[1]
            if better is not None:
                # With a given level, since among themselves fits are compared when most of them are near their maximum.
                if turn == 0 and level is not None and _is_as_predicted(likelihoods[n], points[n], better[0]):
                    as_predicted.add(n)
                if _returns(likelihoods[n], points[n], better[0], starts[n].known):
                    returning.add(n)
                points[n], _, dampings[n] = better
        active = [n for n in active if not (converged[n] or n in returning)]
        # A fit that started at the maximum predicted by another's linearisation is near its own after a single step.
        compared = [n for n in active if turn > 0 or n in as_predicted or (near and starts[n].point is not None)]
        if not compared:
            continue
        reached = min(point.cost + penalties[n] for n, point in points.items()) if level is None else level
        for n in compared:
            predicted = COMPETING_FITS.most_of_promise * predicted_decrease(likelihoods[n], points[n])
            if points[n].cost + penalties[n] - predicted > reached + margin:
                active.remove(n)
    return [
        refinement_at(likelihoods[n], start.model, start.free, points[n], converged[n])
        if n in points
        else _not_simulated(likelihoods[n], start)
        for n, start in enumerate(starts)
    ]


def _not_simulated(likelihood: Likelihood, start: Start) -> Refinement:
    """A start that cannot be simulated, at an infinite -2 ln L."""
    states = tuple(manoeuvre.first_state for manoeuvre in likelihood.manoeuvres)
    count = len(start.free) + sum(map(len, states)) + sum(active.slopes for active in start.effects)
    return Refinement(
        model=start.model,
        free=start.free,
        states=states if start.states is None else start.states,
        effects=start.effects,
        variance=likelihood.starting_variance() if start.variance is None else start.variance,
        cost=np.inf,
        information=np.zeros((count, count)),
        converged=False,
    )


def _returns(likelihood: Likelihood, before: Point, point: Point, known: Refinement | None) -> bool:
    """Whether a step led nearly all the way to a known estimate, and the next is predicted to do so again."""
    if known is None:
        return False
    there = np.concatenate([known.model.values[likelihood.free], *known.states])

    def distance(parameters: NDArray[np.float64]) -> float:
        away = parameters - there
        return float(away @ known.information @ away)

    was, now = (np.concatenate([each.values[likelihood.free], *each.states]) for each in (before, point))
    ahead = distance(now + full_step(likelihood, point))
    return distance(now) < COMPETING_FITS.returning * distance(was) and ahead < COMPETING_FITS.returning * distance(now)


def _is_as_predicted(likelihood: Likelihood, before: Point, after: Point) -> bool:
    """Whether a step decreased -2 ln L nearly as far as its linearisation predicted, which then holds around it too."""
    return before.cost - after.cost >= COMPETING_FITS.as_predicted * predicted_decrease(likelihood, before)


class EvaluatedStart(NamedTuple):
    """A start with its likelihood, and the -2 ln L predicted at the end of a full Gauss-Newton step.

    Infinite where the start cannot be simulated.
    """

    start: Start
    predicted_cost: float


def evaluated_starts(starts: Sequence[Start], manoeuvres: Sequence[Manoeuvre]) -> list[EvaluatedStart]:
    """Several starts with their likelihoods, distributed over the cores.

    A start that diverges in open loop has none. Its continuation from the data, a hundred times as long, would
    re-estimate the derivatives on the way, and compare with no other start.
    """

    def first(start: Start) -> EvaluatedStart:
        likelihood = Likelihood(start.model, tuple(manoeuvres), start.free)
        point = simulated_point(likelihood, start)
        if point is None:
            return EvaluatedStart(replace(start, point=None), np.inf)
        return EvaluatedStart(replace(start, point=point), point.cost - predicted_decrease(likelihood, point))

    return mapped_in_threads(first, starts)


def refine_from_effect_values(
    at: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    settings: RefinementSettings,
    initial: Sequence[tuple[ActiveEffect, ...]],
) -> list[Refinement]:
    """As `refine_on` from each of several sets of effects, distributed over the cores."""
    return mapped_in_threads(lambda effects: refine_on(at, manoeuvres, settings, effects), initial)


def predicted_decrease(likelihood: Likelihood, point: Point) -> float:
    """Decrease of -2 ln L, noise variances at their maximum, predicted for a full Gauss-Newton step."""
    return damped_step.predicted_decrease(point.quadratic, likelihood.active(point.effects), likelihood.variance_floor)
