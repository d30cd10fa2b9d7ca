"""Parallel maximum-likelihood fits of competing structures or starts, with early termination of the worse ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import mapped
from aerosid.effects import ActiveEffect, with_numbers
from aerosid.estimation import damped_step
from aerosid.estimation.damped_search import UNDAMPED, levenberg_marquardt_step
from aerosid.estimation.fit_settings import COMPETING_FITS, RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, Start, first_point, refine_on, refinement_at
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry


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
        In the order of `starts`; a terminated fit as it was at that time, `converged` false.

    Notes
    -----
    All fits make one step in turn, distributed over the cores. After two, or after one from a known likelihood, a fit
    is terminated where even several times the decrease predicted by its linearisation would leave it above the level.
    With a given level the fits are independent, and each is completed at once.
    """
    if level is not None and len(starts) > 1:
        pairs = list(zip(starts, penalties, strict=True))

        def fit_one(one: tuple[Start, float]) -> TransferredFit:
            return TransferredFit.of(
                fit_competing_structures([one[0]], manoeuvres, settings, [one[1]], level, margin, near=near)[0]
            )

        fits = mapped(fit_one, pairs, COMPETING_FITS.dealt_out)
        return [fit.refinement(start.model, start.free, start.effects) for fit, start in zip(fits, starts, strict=True)]
    likelihoods = [Likelihood(start.model, tuple(manoeuvres), start.free) for start in starts]

    def first(n: int) -> tuple[_TransferredPoint, float]:
        point = first_point(likelihoods[n], starts[n], settings)
        return _TransferredPoint.of(point), likelihoods[n].held_to_data

    def stepped(n: int) -> tuple[_TransferredPoint, bool, float] | None:
        better = levenberg_marquardt_step(likelihoods[n], points[n], settings, hold_variance=False, damping=dampings[n])
        return None if better is None else (_TransferredPoint.of(better[0]), *better[1:])

    initial = mapped(first, range(len(starts)), COMPETING_FITS.dealt_out)
    for likelihood, (_, held) in zip(likelihoods, initial, strict=True):
        likelihood.held_to_data = held
    points = [sent.point(start.effects) for (sent, _), start in zip(initial, starts, strict=True)]
    converged, dampings = [False] * len(starts), [UNDAMPED] * len(starts)
    active = list(range(len(starts)))
    for turn in range(settings.steps):
        for n, better in zip(active, mapped(stepped, active, COMPETING_FITS.dealt_out), strict=True):
            converged[n] = better is None or better[1]
            if better is not None:
                points[n], dampings[n] = better[0].point(starts[n].effects), better[2]
        active = [n for n in active if not converged[n]]
        # A fit that started at the maximum predicted by another's linearisation is near its own after a single step.
        compared = [n for n in active if turn > 0 or (near and starts[n].point is not None)]
        if not compared:
            continue
        reached = level
        if reached is None:
            reached = min(point.cost + penalty for point, penalty in zip(points, penalties, strict=True))
        for n in compared:
            predicted = COMPETING_FITS.most_of_promise * predicted_decrease(likelihoods[n], points[n])
            if points[n].cost + penalties[n] - predicted > reached + margin:
                active.remove(n)
    return [
        refinement_at(likelihood, start.model, start.free, point, rest)
        for likelihood, start, point, rest in zip(likelihoods, starts, points, converged, strict=True)
    ]


class EvaluatedStart(NamedTuple):
    """A start with its likelihood, and the -2 ln L predicted at the end of a full Gauss-Newton step."""

    start: Start
    predicted_cost: float


def evaluated_starts(
    starts: Sequence[Start], manoeuvres: Sequence[Manoeuvre], settings: RefinementSettings
) -> list[EvaluatedStart]:
    """Several starts with their likelihoods, distributed over the cores.

    A start that diverges in open loop has none: its continuation from the data is repeated by the fit.
    """

    def first(start: Start) -> tuple[_TransferredPoint | None, float]:
        likelihood = Likelihood(start.model, tuple(manoeuvres), start.free)
        point = first_point(likelihood, start, settings)
        predicted_cost = point.cost - predicted_decrease(likelihood, point)
        return (_TransferredPoint.of(point) if likelihood.held_to_data == 0.0 else None), predicted_cost

    found = []
    for start, (sent, predicted_cost) in zip(starts, mapped(first, starts, COMPETING_FITS.dealt_out), strict=True):
        point = None if sent is None else sent.point(start.effects)
        found.append(EvaluatedStart(replace(start, point=point), predicted_cost))
    return found


class _TransferredPoint(NamedTuple):
    """A point in a form to transfer between processes: of its effects, only their values."""

    point_without_effects: Point
    numbers: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, point: Point) -> _TransferredPoint:
        return cls(replace(point, effects=()), tuple(active.values for active in point.effects))

    def point(self, effects: Sequence[ActiveEffect]) -> Point:
        """The point with the `effects` of its structure."""
        return replace(self.point_without_effects, effects=with_numbers(effects, self.numbers))


class TransferredFit(NamedTuple):
    """An estimate in a form to transfer between processes: of its effects, which hold functions, only their values."""

    values: NDArray[np.float64]
    numbers: tuple[tuple[float, ...], ...]
    rest: dict[str, Any]

    @classmethod
    def of(cls, fit: Refinement) -> TransferredFit:
        """The transferred form of an estimate."""
        known = ("states", "variance", "cost", "information", "converged", "held_to_data")
        rest = {name: getattr(fit, name) for name in known}
        return cls(fit.model.values, tuple(active.values for active in fit.effects), rest)

    def refinement(
        self, model: AerodynamicModel, free: tuple[Entry, ...], effects: Sequence[ActiveEffect]
    ) -> Refinement:
        """The estimate of the structure that its fit started with."""
        own = with_numbers(effects, self.numbers)
        return Refinement(model=model.with_values(self.values), free=free, effects=own, **self.rest)


def refine_from_effect_values(
    at: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    settings: RefinementSettings,
    initial: Sequence[tuple[ActiveEffect, ...]],
) -> list[Refinement]:
    """As `refine_on` from each of several sets of effects, distributed over the cores."""

    def refined(effects: tuple[ActiveEffect, ...]) -> TransferredFit:
        return TransferredFit.of(refine_on(at, manoeuvres, settings, effects))

    fits = mapped(refined, initial, COMPETING_FITS.dealt_out)
    return [fit.refinement(at.model, at.free, effects) for fit, effects in zip(fits, initial, strict=True)]


def predicted_decrease(likelihood: Likelihood, point: Point) -> float:
    """Decrease of -2 ln L, noise variances at their maximum, predicted for a full Gauss-Newton step."""
    return damped_step.predicted_decrease(point.quadratic, likelihood.active(point.effects), likelihood.variance_floor)
