"""Score tests: the first-order gain of hypotheses at the present estimate, before any is fitted.

The score test predicts a candidate's gain in likelihood from its sensitivities through the estimator, without fitting
it. The corrected covariance allows for the coloured residuals of real flights, for which the plain Cramer-Rao bounds
are several times too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.estimation.fit_settings import RESIDUAL_TESTS
from aerosid.estimation.likelihood import Likelihood, Trial, Whitened
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.tested_point import TestedPoint, tested_point
from aerosid.flight_model.aerodynamics import Entry


@dataclass(frozen=True)
class Score:
    """The score of one hypothesis.

    Attributes
    ----------
    hypothesis : Hypothesis
        The candidate.
    gain : float
        Predicted decrease of -2 ln L at the present noise levels; under the null hypothesis and with white residuals
        chi-square with as many degrees of freedom as the hypothesis has parameters.
    start : tuple of float
        The parameters after a single linear step.
    independence : float
        Orthogonalised over total sum of squares of the candidate's sensitivity, 0 to 1.
    trial : int
        Index of the trial value of largest gain.
    """

    hypothesis: Hypothesis
    gain: float
    start: tuple[float, ...]
    independence: float
    trial: int = 0


def score_hypotheses(
    refinement: Refinement, manoeuvres: Sequence[Manoeuvre], hypotheses: Sequence[Hypothesis]
) -> tuple[Score, ...]:
    """The hypotheses with the predicted gain in likelihood of each alone, greatest first.

    Parameters
    ----------
    refinement : Refinement
        The present estimate.
    manoeuvres : sequence of Manoeuvre
        Those of the estimate.
    hypotheses : sequence of Hypothesis
        None of them in the model.

    Notes
    -----
    Rao's score test: with the whitened residual r, the present sensitivities A and the candidate's s, the part of s
    orthogonal to A is t = s - A (A'A)^-1 A's and the gain is r't (t't)^-1 t'r. The response to a delay or a limit is
    nonlinear: its column is the difference quotient to each of its trial values, of which the largest gain counts.
    """
    return Linearised(refinement, manoeuvres, hypotheses).scores() if hypotheses else ()


ROOM = 16_000_000
"""Numerical: size of the sensitivities of hypotheses held at once; for a long record they are computed in several
batches."""


class Linearised:
    """An estimate's likelihood, to second order in its parameters and in those of further hypotheses.

    Parameters
    ----------
    refinement : Refinement
        The estimate.
    manoeuvres : sequence of Manoeuvre
        Those of the estimate.
    hypotheses : sequence of Hypothesis
        None of them in the model. The information between two of them is not computed.
    room : int
        Size of the sensitivities held at once.
    """

    def __init__(
        self,
        refinement: Refinement,
        manoeuvres: Sequence[Manoeuvre],
        hypotheses: Sequence[Hypothesis],
        room: int = ROOM,
    ) -> None:
        self.refinement = refinement
        asked = [
            (hypothesis, hypothesis.by_chord(trial), trial)
            for hypothesis in hypotheses
            for trial in range(max((len(p.trials) for a in hypothesis.effects for p in a.effect.parameters), default=1))
        ]
        entries = list(dict.fromkeys(entry for _, chord, _ in asked for entry in chord.entries))
        free, states = len(refinement.free), sum(state.size for state in refinement.states)
        own = sum(active.slopes for active in refinement.effects)
        self.own = np.concatenate([np.arange(free), free + len(entries) + np.arange(states + own)])
        self.place = place = {entry: free + n for n, entry in enumerate(entries)}
        column = free + len(entries) + states
        self.effect_columns: list[tuple[ActiveEffect, list[int]]] = []
        for active in refinement.effects:
            self.effect_columns.append((active, list(range(column, column + active.slopes))))
            column += active.slopes
        self.asked: list[tuple[Hypothesis, list[int], int]] = []
        for hypothesis, chord, trial in asked:
            count = sum(active.slopes for active in chord.effects)
            columns = [place[entry] for entry in chord.entries] + list(range(column, column + count))
            self.asked.append((hypothesis, columns, trial))
            column += count
        samples = max(manoeuvre.flight.time.size for manoeuvre in manoeuvres)
        most = max(room // (refinement.variance.size * samples) - self.own.size, 1)
        tested = self._tested(manoeuvres, [chord for _, chord, _ in asked], column, most)
        self._tested_point = tested
        self.normal, self.gradient = tested.information, tested.gradients.sum(axis=0)
        self.present = self.own[np.diag(self.normal)[self.own] > 0.0]

    def _tested(
        self, manoeuvres: Sequence[Manoeuvre], chords: Sequence[Hypothesis], count: int, most: int
    ) -> TestedPoint:
        """The likelihood in all `count` parameters, from simulations with at most `most` columns of hypotheses each."""
        batches: list[list[int]] = [[]]
        held = 0
        for n, (_, columns, _) in enumerate(self.asked):
            if batches[-1] and held + len(columns) > most:
                batches.append([])
                held = 0
            batches[-1].append(n)
            held += len(columns)
        places, whole = self._batch(manoeuvres, chords, batches[0])
        if len(batches) == 1:
            return whole
        whole = whole.among(places, count)
        for batch in batches[1:]:
            places, part = self._batch(manoeuvres, chords, batch)
            whole = whole.beside(part.among(places, count))
        return whole

    def _batch(
        self, manoeuvres: Sequence[Manoeuvre], chords: Sequence[Hypothesis], batch: Sequence[int]
    ) -> tuple[NDArray[np.int64], TestedPoint]:
        """The places, in rising order, of the estimate's parameters and of a batch's, and the likelihood in them."""
        entries = list(dict.fromkeys(entry for n in batch for entry in chords[n].entries))
        tested = [active for n in batch for active in chords[n].effects]
        free = len(self.refinement.free)
        added = [self.place[entry] for entry in entries]
        columns = [c for n in batch for c in self.asked[n][1] if c > self.own[-1]]
        places = np.array([*self.own[:free], *added, *self.own[free:], *columns], dtype=np.int64)
        here = {int(place): n for n, place in enumerate(places)}
        groups = [[here[c] for c in self.asked[n][1]] for n in batch]
        own = np.array([here[int(place)] for place in self.own], dtype=np.int64)
        return places, _extended_point(self.refinement, manoeuvres, entries, tested, own, groups)

    @property
    def whitened(self) -> tuple[Whitened, ...] | None:
        """The stretches of the estimate, as of `whiten`, where they are one."""
        whitened = self._tested_point.whitened
        return None if whitened is None else (whitened,)

    def with_terms(self, entries: Sequence[Entry]) -> Point:
        """The likelihood of the estimate with further terms of zero value, in the parameters of that structure.

        The terms, which come after the free ones of the estimate, are of one of the hypotheses. The values are left to
        the caller, who knows the order of the model's terms.
        """
        return self._tested_point.with_parameters([self.place[entry] for entry in entries])

    def without_terms(self, entries: Sequence[Entry]) -> Point:
        """The linearised likelihood with free terms removed; values as in `with_terms`."""
        point = self._tested_point.point
        struck = np.array([self.refinement.free.index(entry) for entry in entries], dtype=np.int64)
        change = np.zeros(self.own.size)
        change[struck] = [-self.refinement.model.value(entry) for entry in entries]
        squares = point.squares_after(change)
        moved = replace(
            point,
            squares=squares,
            cost=point.cost + float(np.sum(squares - point.squares)),
            gradients=point.gradients - point.normals @ change,
        )
        return _part(moved, np.setdiff1d(np.arange(self.own.size), struck, assume_unique=True))

    def scores(self) -> tuple[Score, ...]:
        """The score of each hypothesis alone, greatest first."""
        return self._scores(_projection(self.normal, self.gradient, self.present))

    def in_place_of(
        self, entries: Sequence[Entry], effects: Sequence[ActiveEffect] = ()
    ) -> tuple[float, tuple[Score, ...]]:
        """Rise of -2 ln L when free entries and effects are removed, and its recovery by each hypothesis.

        Accurate for a hypothesis that can replace them, as the motion then hardly changes, however large each alone.
        For an effect that is far from linear in its parameter only the ranking of the hypotheses is valid.
        """
        places = [self.refinement.free.index(entry) for entry in entries]
        changes = [-self.refinement.model.value(entry) for entry in entries]
        for active, columns in self.effect_columns:
            if active in effects:
                places += columns
                changes += [active.effect.parameters[0].null - active.values[0], *([0.0] * (len(columns) - 1))]
        struck, change = np.array(places, dtype=np.int64), np.array(changes)
        gradient = self.gradient - self.normal[:, struck] @ change
        left = np.setdiff1d(self.present, struck)
        beside = _projection(self.normal, gradient, left)
        rise = change @ self.normal[np.ix_(struck, struck)] @ change - 2.0 * self.gradient[struck] @ change
        return float(rise - (gradient[left] / beside.scale) @ beside.taken), self._scores(beside)

    def _scores(self, beside: _Projection) -> tuple[Score, ...]:
        single = np.array([columns[0] for _, columns, _ in self.asked if len(columns) == 1], dtype=np.int64)
        told = {1: iter(_single_scores(single, self.normal, beside))}
        for count in {len(columns) for _, columns, _ in self.asked} - {1}:
            together = np.array([columns for _, columns, _ in self.asked if len(columns) == count], dtype=np.int64)
            told[count] = iter(_joint_scores(together, self.normal, beside))
        best: dict[int, Score] = {}
        for hypothesis, columns, trial in self.asked:
            gain, step, independence = next(told[len(columns)])
            score = Score(hypothesis, gain, step, independence, trial)
            known = best.get(id(hypothesis))
            if known is None or score.gain > known.gain:
                best[id(hypothesis)] = score
        return tuple(sorted(best.values(), key=lambda score: -score.gain))


class _Projection(NamedTuple):
    """Projection on the `present` parameters (P), to orthogonalise others: their `scale`, the `inner` inverse of their
    scaled information (P, P), and their own scaled step `taken` (P,); `gradient` (M,) of all.
    """

    present: NDArray[np.int64]
    gradient: NDArray[np.float64]
    scale: NDArray[np.float64]
    inner: NDArray[np.float64]
    taken: NDArray[np.float64]


def _projection(normal: NDArray[np.float64], gradient: NDArray[np.float64], present: NDArray[np.int64]) -> _Projection:
    scale = np.sqrt(np.diag(normal)[present])
    scaled = normal[np.ix_(present, present)] / np.outer(scale, scale)
    inner = np.asarray(np.linalg.pinv(scaled, rcond=1e-12, hermitian=True), dtype=np.float64)
    return _Projection(present, gradient, scale, inner, np.asarray(inner @ (gradient[present] / scale)))


def _extended_point(
    refinement: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    entries: Sequence[Entry],
    tested: Sequence[ActiveEffect],
    own: NDArray[np.int64],
    groups: Sequence[Sequence[int]],
) -> TestedPoint:
    """The likelihood at an estimate, with the derivatives of its parameters and of all that is tested, in groups."""
    model = refinement.model.extended(entries)
    likelihood = Likelihood(model, tuple(manoeuvres), (*refinement.free, *entries))
    likelihood.held_to_data = refinement.held_to_data
    trial = Trial(model.values, refinement.states, refinement.effects, refinement.variance, tested)
    found = tested_point(likelihood, trial, own, groups)
    if not np.isfinite(found.point.cost):
        raise OutOfRangeError
    return replace(found, point=replace(found.point, values=np.array(refinement.model.values)))


def _part(point: Point, places: NDArray[np.int64]) -> Point:
    """The likelihood in some of the parameters alone."""
    inside = np.ix_(places, places)
    return replace(
        point,
        normals=np.ascontiguousarray(point.normals[:, places[:, None], places]),
        gradients=np.ascontiguousarray(point.gradients[:, places]),
        prior_normal=point.prior_normal[inside],
        prior_gradient=point.prior_gradient[places],
    )


def _single_scores(
    places: NDArray[np.int64], normal: NDArray[np.float64], beside: _Projection
) -> list[tuple[float, tuple[float, ...], float]]:
    """Gain, step and independence of every hypothesis with a single parameter, vectorised."""
    cross = normal[np.ix_(beside.present, places)] / beside.scale[:, None]
    own = normal[places, places]
    left = own - np.sum(cross * (beside.inner @ cross), axis=0)
    independence = np.divide(left, own, out=np.zeros_like(left), where=own > 0.0)
    apart = independence >= RESIDUAL_TESTS.least_independence
    slope = beside.gradient[places] - cross.T @ beside.taken
    step = np.divide(slope, left, out=np.zeros_like(left), where=apart)
    steps = [(number,) for number in step.tolist()]
    return list(zip((slope * step).tolist(), steps, np.maximum(independence, 0.0).tolist(), strict=True))


def _joint_scores(
    places: NDArray[np.int64], normal: NDArray[np.float64], beside: _Projection
) -> list[tuple[float, tuple[float, ...], float]]:
    """As `_single_scores`, of hypotheses with several parameters each, `places` (H, k)."""
    cross = normal[beside.present[:, None], places[:, None, :]] / beside.scale[:, None]
    own = normal[places[:, :, None], places[:, None, :]]
    left = own - cross.transpose(0, 2, 1) @ beside.inner @ cross
    size, rest = (np.diagonal(each, axis1=1, axis2=2) for each in (own, left))
    shown = np.all(size > 0.0, axis=1)
    independence = np.zeros(places.shape[0])
    independence[shown] = np.min(rest[shown] / size[shown], axis=1)
    apart = shown & (independence >= RESIDUAL_TESTS.least_independence)
    gains = np.zeros(places.shape[0])
    steps: NDArray[np.float64] = np.zeros(places.shape)
    unit = np.sqrt(rest[apart])
    slope = (beside.gradient[places[apart]] - cross[apart].transpose(0, 2, 1) @ beside.taken) / unit
    scaled = left[apart] / (unit[:, :, None] * unit[:, None, :])
    step = (np.linalg.pinv(scaled, rcond=1e-8, hermitian=True) @ slope[:, :, None])[:, :, 0]
    gains[apart], steps[apart] = np.sum(step * slope, axis=1), step / unit
    rows: list[list[float]] = steps.tolist()
    shares: list[float] = np.maximum(independence, 0.0).tolist()
    return [(gain, tuple(row), share) for gain, row, share in zip(gains.tolist(), rows, shares, strict=True)]
