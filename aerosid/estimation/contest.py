"""Several structures or starts estimated side by side over the cores, those that cannot win given up early."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from aerosid.compiled.threads import mapped_in_threads
from aerosid.effects import ActiveEffect
from aerosid.estimation import damped_step
from aerosid.estimation.damped_search import UNDAMPED, improved
from aerosid.estimation.fit_settings import CONTEST, RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, Start, first_point, refine_on, refinement_at


def contest(
    starts: Sequence[Start],
    manoeuvres: Sequence[Manoeuvre],
    settings: RefinementSettings,
    allowance: Sequence[float],
    level: float | None = None,
    margin: float = 0.0,
    *,
    near: bool = True,
) -> list[Refinement]:
    """Estimates from several starting points; those that cannot become the best are abandoned early.

    Parameters
    ----------
    starts : sequence of Start
        The contestants: different structures on the same manoeuvres.
    allowance : sequence of float
        What each one's -2 ln L carries as a handicap in the comparison: the price of its numbers.
    level : float, optional
        -2 ln L with handicap that contestants are held against; without one, the least of theirs at the time.
    margin : float
        By how much more than that a contestant may have at the end and still be of interest.
    near : bool
        Whether a start whose likelihood is known is near its end: it may be given up one step earlier.

    Returns
    -------
    list of Refinement
        In the order of `starts`; of those that were given up the state at that time, `converged` false.

    Notes
    -----
    All move one step in turn, dealt out to the cores. After two, or after one from a known likelihood, one is given up
    where even several times the fall that its linearisation promises would leave it above. Against a given level none
    hangs on the others, and each is followed to its end at once.
    """
    if level is not None and len(starts) > 1:

        def followed(one: tuple[Start, float]) -> Refinement:
            return contest([one[0]], manoeuvres, settings, [one[1]], level, margin, near=near)[0]

        return mapped_in_threads(followed, list(zip(starts, allowance, strict=True)))
    likelihoods = [Likelihood(start.model, tuple(manoeuvres), start.free) for start in starts]
    points = mapped_in_threads(lambda n: first_point(likelihoods[n], starts[n], settings), range(len(starts)))
    converged, dampings = [False] * len(starts), [UNDAMPED] * len(starts)
    paths = list(range(len(starts)))

    def stepped(n: int) -> tuple[Point, bool, float] | None:
        return improved(likelihoods[n], points[n], settings, hold_variance=False, damping=dampings[n])

    for turn in range(settings.steps):
        for n, better in zip(paths, mapped_in_threads(stepped, paths), strict=True):
            converged[n] = better is None or better[1]
            if better is not None:
                points[n], _, dampings[n] = better
        paths = [n for n in paths if not converged[n]]
        # One that began where another estimate's linearisation led is near its end after a single step.
        judged = [n for n in paths if turn > 0 or (near and starts[n].point is not None)]
        if not judged:
            continue
        reached = level
        if reached is None:
            reached = min(point.cost + more for point, more in zip(points, allowance, strict=True))
        for n in judged:
            promise = CONTEST.most_of_promise * promised_fall(likelihoods[n], points[n])
            if points[n].cost + allowance[n] - promise > reached + margin:
                paths.remove(n)
    return [
        refinement_at(likelihood, start.model, start.free, point, rest)
        for likelihood, start, point, rest in zip(likelihoods, starts, points, converged, strict=True)
    ]


class Begun(NamedTuple):
    """A start with its likelihood, and the -2 ln L `promised` at the end of a full Gauss-Newton step from there."""

    start: Start
    promised: float


def begun(starts: Sequence[Start], manoeuvres: Sequence[Manoeuvre], settings: RefinementSettings) -> list[Begun]:
    """Several starts with their likelihoods, dealt out to the cores.

    One that runs away in open loop keeps none: its way into the data is found anew.
    """

    def first(start: Start) -> Begun:
        likelihood = Likelihood(start.model, tuple(manoeuvres), start.free)
        point = first_point(likelihood, start, settings)
        known = point if likelihood.held_to_data == 0.0 else None
        return Begun(replace(start, point=known), point.cost - promised_fall(likelihood, point))

    return mapped_in_threads(first, starts)


def refined_on(
    at: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    settings: RefinementSettings,
    begins: Sequence[tuple[ActiveEffect, ...]],
) -> list[Refinement]:
    """As `refine_on` from each of several sets of effects, dealt out to the cores."""
    return mapped_in_threads(lambda effects: refine_on(at, manoeuvres, settings, effects), begins)


def promised_fall(likelihood: Likelihood, point: Point) -> float:
    """Fall of -2 ln L, noise variances at their maximum, that a full Gauss-Newton step promises."""
    return damped_step.promised_fall(point.quadratic, likelihood.active(point.effects), likelihood.variance_floor)
