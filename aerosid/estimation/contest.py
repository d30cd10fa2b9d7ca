"""Several structures or starts estimated side by side over the cores, those that cannot win given up early."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import mapped
from aerosid.effects import ActiveEffect, with_numbers
from aerosid.errors import EstimationError
from aerosid.estimation import damped_step
from aerosid.estimation.damped_search import UNDAMPED, improved
from aerosid.estimation.fit_settings import CONTEST, RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, Start, first_point, refine_on, refinement_at
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry


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
        In the order of `starts`; of those that were given up the state at that time, `converged` false; of those that
        no simulation follows the start itself at an infinite -2 ln L.

    Notes
    -----
    All move one step in turn, dealt out to the cores. After two, or after one from a known likelihood, one is given up
    where even several times the fall that its linearisation promises would leave it above. Against a given level none
    hangs on the others, and each is followed to its end at once.
    """
    if level is not None and len(starts) > 1:
        alone = list(zip(starts, allowance, strict=True))

        def followed(one: tuple[Start, float]) -> SentFit:
            return SentFit.of(contest([one[0]], manoeuvres, settings, [one[1]], level, margin, near=near)[0])

        fits = mapped(followed, alone, CONTEST.dealt_out)
        return [fit.refinement(start.model, start.free, start.effects) for fit, start in zip(fits, starts, strict=True)]
    likelihoods = [Likelihood(start.model, tuple(manoeuvres), start.free) for start in starts]

    def first(n: int) -> tuple[_Sent, float] | None:
        try:
            point = first_point(likelihoods[n], starts[n], settings)
        except EstimationError:
            return None
        return _Sent.of(point), likelihoods[n].held_to_data

    def stepped(n: int) -> tuple[_Sent, bool, float] | None:
        better = improved(likelihoods[n], points[n], settings, hold_variance=False, damping=dampings[n])
        return None if better is None else (_Sent.of(better[0]), *better[1:])

    points: dict[int, Point] = {}
    for n, known in enumerate(mapped(first, range(len(starts)), CONTEST.dealt_out)):
        if known is not None:
            likelihoods[n].held_to_data = known[1]
            points[n] = known[0].point(starts[n].effects)
    converged, dampings = [False] * len(starts), [UNDAMPED] * len(starts)
    paths = list(points)
    for turn in range(settings.steps):
        for n, better in zip(paths, mapped(stepped, paths, CONTEST.dealt_out), strict=True):
            converged[n] = better is None or better[1]
            if better is not None:
                points[n], dampings[n] = better[0].point(starts[n].effects), better[2]
        paths = [n for n in paths if not converged[n]]
        # One that began where another estimate's linearisation led is near its end after a single step.
        judged = [n for n in paths if turn > 0 or (near and starts[n].point is not None)]
        if not judged:
            continue
        reached = level
        if reached is None:
            reached = min(point.cost + allowance[n] for n, point in points.items())
        for n in judged:
            promise = CONTEST.most_of_promise * promised_fall(likelihoods[n], points[n])
            if points[n].cost + allowance[n] - promise > reached + margin:
                paths.remove(n)
    return [
        refinement_at(likelihoods[n], start.model, start.free, points[n], converged[n])
        if n in points
        else _lost(likelihoods[n], start)
        for n, start in enumerate(starts)
    ]


def _lost(likelihood: Likelihood, start: Start) -> Refinement:
    """A start that no simulation follows, at an infinite -2 ln L: it wins against nothing."""
    states = tuple(manoeuvre.first_state for manoeuvre in likelihood.manoeuvres)
    numbers = len(start.free) + sum(map(len, states)) + sum(active.slopes for active in start.effects)
    return Refinement(
        model=start.model,
        free=start.free,
        states=states if start.states is None else start.states,
        effects=start.effects,
        variance=likelihood.starting_variance() if start.variance is None else start.variance,
        cost=np.inf,
        information=np.zeros((numbers, numbers)),
        converged=False,
    )


class Begun(NamedTuple):
    """A start with its likelihood, and the -2 ln L `promised` at the end of a full Gauss-Newton step from there.

    Infinite where no simulation follows the start.
    """

    start: Start
    promised: float


def begun(starts: Sequence[Start], manoeuvres: Sequence[Manoeuvre], settings: RefinementSettings) -> list[Begun]:
    """Several starts with their likelihoods, dealt out to the cores.

    One that runs away in open loop keeps none: its way into the data is found anew.
    """

    def first(start: Start) -> tuple[_Sent | None, float]:
        likelihood = Likelihood(start.model, tuple(manoeuvres), start.free)
        try:
            point = first_point(likelihood, start, settings)
        except EstimationError:
            return None, np.inf
        promised = point.cost - promised_fall(likelihood, point)
        return (_Sent.of(point) if likelihood.held_to_data == 0.0 else None), promised

    found = []
    for start, (sent, promised) in zip(starts, mapped(first, starts, CONTEST.dealt_out), strict=True):
        point = None if sent is None else sent.point(start.effects)
        found.append(Begun(replace(start, point=point), promised))
    return found


class _Sent(NamedTuple):
    """A point as it goes from process to process: of its effects their numbers alone."""

    bare: Point
    numbers: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, point: Point) -> _Sent:
        return cls(replace(point, effects=()), tuple(active.values for active in point.effects))

    def point(self, effects: Sequence[ActiveEffect]) -> Point:
        """The point, its numbers those of the `effects` of its structure."""
        return replace(self.bare, effects=with_numbers(effects, self.numbers))


class SentFit(NamedTuple):
    """An estimate as it goes from process to process: of its effects, which hold functions, their numbers alone."""

    values: NDArray[np.float64]
    numbers: tuple[tuple[float, ...], ...]
    rest: dict[str, Any]

    @classmethod
    def of(cls, fit: Refinement) -> SentFit:
        """What is to be sent of an estimate."""
        known = ("states", "variance", "cost", "information", "converged", "held_to_data")
        rest = {name: getattr(fit, name) for name in known}
        return cls(fit.model.values, tuple(active.values for active in fit.effects), rest)

    def refinement(
        self, model: AerodynamicModel, free: tuple[Entry, ...], effects: Sequence[ActiveEffect]
    ) -> Refinement:
        """The estimate of the structure that it began with."""
        own = with_numbers(effects, self.numbers)
        return Refinement(model=model.with_values(self.values), free=free, effects=own, **self.rest)


def refined_on(
    at: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    settings: RefinementSettings,
    begins: Sequence[tuple[ActiveEffect, ...]],
) -> list[Refinement]:
    """As `refine_on` from each of several sets of effects, dealt out to the cores."""

    def refined(effects: tuple[ActiveEffect, ...]) -> SentFit:
        return SentFit.of(refine_on(at, manoeuvres, settings, effects))

    fits = mapped(refined, begins, CONTEST.dealt_out)
    return [fit.refinement(at.model, at.free, effects) for fit, effects in zip(fits, begins, strict=True)]


def promised_fall(likelihood: Likelihood, point: Point) -> float:
    """Fall of -2 ln L, noise variances at their maximum, that a full Gauss-Newton step promises."""
    return damped_step.promised_fall(point.quadratic, likelihood.active(point.effects), likelihood.variance_floor)
