"""How much the data speak for a term: score tests before a fit, corrected deviations after it.

The score test asks what a candidate would gain in likelihood, from its sensitivities through the estimator and without
fitting it. The corrected covariance counts that residuals of real flights are coloured: plain Cramer-Rao deviations
are then several times too small.
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
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.likelihood_point import Point
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, whiten
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.longitudinal import OUTPUT_COUNT, OUTPUTS
from aerosid.signals.fit_statistics import noise_memories, whiteness
from aerosid.signals.residual_covariance import coloured_covariance_groups, published_covariance_groups


@dataclass(frozen=True)
class Score:
    """What one hypothesis would bring.

    Attributes
    ----------
    hypothesis : Hypothesis
        The candidate.
    gain : float
        Expected fall of -2 ln L at the present noise levels; chi-square with as many degrees of freedom as the
        hypothesis has numbers where nothing is missing and residuals are white.
    start : tuple of float
        The numbers that a single linear step gives it.
    independence : float
        Share of the candidate's effect that what is there already cannot imitate, 0 to 1.
    trial : int
        Which of its trial values that is the best of.
    """

    hypothesis: Hypothesis
    gain: float
    start: tuple[float, ...]
    independence: float
    trial: int = 0


LEAST_INDEPENDENCE = 1e-5
"""Below this share a candidate is another name for terms already there: 0.3 % of its effect is its own."""


def score_hypotheses(
    refinement: Refinement, manoeuvres: Sequence[Manoeuvre], hypotheses: Sequence[Hypothesis]
) -> tuple[Score, ...]:
    """The hypotheses with the gain in likelihood that each alone would bring, greatest first.

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
    that A cannot imitate is t = s - A (A'A)^-1 A's and the gain is r't (t't)^-1 t'r. A delay or a limit is not linear
    in its number: its column is taken over the distance of each of its trial values, and the best one counts.
    """
    return Linearised(refinement, manoeuvres, hypotheses).scores() if hypotheses else ()


ROOM = 16_000_000
"""Numbers that the sensitivities of hypotheses may fill at once: of a long record they are asked in several turns."""


class Linearised:
    """An estimate's likelihood, to second order in its parameters and in those of hypotheses beside it.

    Parameters
    ----------
    refinement : Refinement
        The estimate.
    manoeuvres : sequence of Manoeuvre
        Those of the estimate.
    hypotheses : sequence of Hypothesis
        None of them in the model. Nothing is known of two of them together.
    room : int
        Numbers that sensitivities may fill at once.
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
        free, states = len(refinement.free), 5 * len(manoeuvres)
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
        most = max(room // (OUTPUT_COUNT * samples) - self.own.size, 1)
        self.point = self._beside(manoeuvres, [chord for _, chord, _ in asked], column, most)
        self.normal, self.gradient = self.point.normals.sum(axis=0), self.point.gradients.sum(axis=0)
        self.present = self.own[np.diag(self.normal)[self.own] > 0.0]

    def _beside(self, manoeuvres: Sequence[Manoeuvre], chords: Sequence[Hypothesis], count: int, most: int) -> Point:
        """The likelihood in all `count` parameters, from simulations with at most `most` columns of hypotheses each."""
        batches: list[list[int]] = [[]]
        held = 0
        for n, (_, columns, _) in enumerate(self.asked):
            if batches[-1] and held + len(columns) > most:
                batches.append([])
                held = 0
            batches[-1].append(n)
            held += len(columns)
        whole: Point | None = None
        for batch in batches:
            entries = list(dict.fromkeys(entry for n in batch for entry in chords[n].entries))
            tested = [active for n in batch for active in chords[n].effects]
            free = len(self.refinement.free)
            added = [self.place[entry] for entry in entries]
            columns = [c for n in batch for c in self.asked[n][1] if c > self.own[-1]]
            places = np.array([*self.own[:free], *added, *self.own[free:], *columns], dtype=np.int64)
            here = {int(place): n for n, place in enumerate(places)}
            groups = [[here[c] for c in self.asked[n][1]] for n in batch]
            part = _extended_point(self.refinement, manoeuvres, entries, tested, groups)
            if whole is None:
                whole = replace(
                    part,
                    normals=np.zeros((OUTPUT_COUNT, count, count)),
                    gradients=np.zeros((OUTPUT_COUNT, count)),
                    prior_normal=np.zeros((count, count)),
                    prior_gradient=np.zeros(count),
                )
            inside = places[:, None], places
            for known, found in zip(whole.normals, part.normals, strict=True):
                known[inside] = np.where(known[inside] != 0.0, known[inside], found)
            whole.gradients[:, places] = part.gradients
        assert whole is not None
        return whole

    def with_terms(self, entries: Sequence[Entry]) -> Point:
        """The likelihood of the estimate with further terms of zero value, in the parameters of that structure.

        The terms, which come after the free ones of the estimate, are of one of the hypotheses. The values are left to
        the caller, who knows the order of the model's terms.
        """
        free = len(self.refinement.free)
        added = np.array([self.place[entry] for entry in entries], dtype=np.int64)
        return _part(self.point, np.concatenate([self.own[:free], added, self.own[free:]]))

    def without_terms(self, entries: Sequence[Entry]) -> Point:
        """What the linearisation says of the likelihood where free terms are struck out; values as in `with_terms`."""
        struck = np.array([self.refinement.free.index(entry) for entry in entries], dtype=np.int64)
        change = np.zeros(self.normal.shape[0])
        change[struck] = [-self.refinement.model.value(entry) for entry in entries]
        squares = self.point.squares_after(change)
        moved = replace(
            self.point,
            squares=squares,
            cost=self.point.cost + float(np.sum(squares - self.point.squares)),
            gradients=self.point.gradients - self.point.normals @ change,
        )
        return _part(moved, np.setdiff1d(self.own, struck, assume_unique=True))

    def scores(self) -> tuple[Score, ...]:
        """What each hypothesis alone would bring, greatest first."""
        return self._scores(_projection(self.normal, self.gradient, self.present))

    def in_place_of(
        self, entries: Sequence[Entry], effects: Sequence[ActiveEffect] = ()
    ) -> tuple[float, tuple[Score, ...]]:
        """Rise of -2 ln L when free entries and effects are struck out, and what of it each hypothesis would win back.

        Exact for a hypothesis that can stand in their place: the motion then hardly changes, however large each alone.
        Of an effect that is far from linear in its number the order of the hypotheses is right, the rise is not.
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
        alone = iter(_single_scores(single, self.normal, beside))
        best: dict[int, Score] = {}
        for hypothesis, columns, trial in self.asked:
            if len(columns) == 1:
                gain, step, independence = next(alone)
                score = Score(hypothesis, gain, (step,), independence, trial)
            else:
                score = replace(_score(hypothesis, columns, self.normal, beside), trial=trial)
            known = best.get(id(hypothesis))
            if known is None or score.gain > known.gain:
                best[id(hypothesis)] = score
        return tuple(sorted(best.values(), key=lambda score: -score.gain))


class _Projection(NamedTuple):
    """What takes the `present` parameters (P) out of others: their `scale`, the `inner` inverse of their scaled
    information (P, P), and the scaled step `taken` (P,) that they would make; `gradient` (M,) of all.
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
    groups: Sequence[Sequence[int]],
) -> Point:
    """The likelihood at an estimate, with the derivatives of its parameters and of all that is tested, in groups."""
    model = refinement.model.extended(entries)
    likelihood = Likelihood(model, tuple(manoeuvres), (*refinement.free, *entries))
    likelihood.held_to_data = refinement.held_to_data
    at = refinement.states, refinement.effects, refinement.variance
    point = likelihood.evaluate(model.values, *at, tested, groups)
    if point is None:
        raise OutOfRangeError
    return replace(point, values=np.array(refinement.model.values))


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
) -> list[tuple[float, float, float]]:
    """Gain, step and independence of every hypothesis of a single number, all at once."""
    cross = normal[np.ix_(beside.present, places)] / beside.scale[:, None]
    own = normal[places, places]
    left = own - np.sum(cross * (beside.inner @ cross), axis=0)
    independence = np.divide(left, own, out=np.zeros_like(left), where=own > 0.0)
    apart = independence >= LEAST_INDEPENDENCE
    slope = beside.gradient[places] - cross.T @ beside.taken
    step = np.divide(slope, left, out=np.zeros_like(left), where=apart)
    return list(zip((slope * step).tolist(), step.tolist(), np.maximum(independence, 0.0).tolist(), strict=True))


def _score(hypothesis: Hypothesis, columns: list[int], normal: NDArray[np.float64], beside: _Projection) -> Score:
    """One hypothesis, the present parameters projected out."""
    places = np.array(columns, dtype=np.int64)
    cross = normal[np.ix_(beside.present, places)] / beside.scale[:, None]
    own = normal[np.ix_(places, places)]
    left = own - cross.T @ beside.inner @ cross
    size = np.diag(own)
    if not np.all(size > 0.0):
        return Score(hypothesis, 0.0, (0.0,) * len(columns), 0.0)
    independence = float(np.min(np.diag(left) / size))
    if independence < LEAST_INDEPENDENCE:
        return Score(hypothesis, 0.0, (0.0,) * len(columns), max(independence, 0.0))
    slope = beside.gradient[places] - cross.T @ beside.taken
    unit = np.sqrt(np.diag(left))
    step = np.linalg.pinv(left / np.outer(unit, unit), rcond=1e-8, hermitian=True) @ (slope / unit)
    return Score(hypothesis, float(step @ (slope / unit)), tuple((step / unit).tolist()), independence)


@dataclass(frozen=True)
class Deviations:
    """Standard deviations of an estimate's parameters: the free entries (F), and the numbers of the effects (K).

    Attributes
    ----------
    corrected : ndarray, shape (F,)
        Of the free entries, counting the residuals' colour.
    white : ndarray, shape (F,)
        As if the residuals were white: the Cramer-Rao bound.
    published : ndarray, shape (F,)
        As Morelli & Klein published the correction: too small on short records.
    covariance : ndarray, shape (F, F)
        Corrected covariance of the free entries.
    correlation_max : ndarray, shape (F,)
        Largest absolute correlation of each entry with any other parameter of the estimate.
    effects : ndarray, shape (K,)
        Corrected deviations of the effects' numbers.
    effects_white : ndarray, shape (K,)
        As if the residuals were white.
    """

    corrected: NDArray[np.float64]
    white: NDArray[np.float64]
    published: NDArray[np.float64]
    covariance: NDArray[np.float64]
    correlation_max: NDArray[np.float64]
    effects: NDArray[np.float64]
    effects_white: NDArray[np.float64]


QUICK_SHORTFALL = 1.15
"""By how much the published correction falls short on records of some hundred samples: 2.5-7 % of cover at 95 %."""


def deviations(refinement: Refinement, manoeuvres: Sequence[Manoeuvre], *, quick: bool = False) -> Deviations:
    """The estimate's standard deviations, plain and corrected for coloured residuals.

    Parameters
    ----------
    quick : bool
        Take the published correction, raised by its usual shortfall, in place of the modelled one: for searches.

    Notes
    -----
    Morelli & Klein, Journal of Aircraft 34 (2), 1997: the autocorrelation of each output's residual takes the place
    of white noise in the covariance of the estimate; the modelled correction is that of `residual_covariance`.
    """
    groups = []
    for part in whiten(refinement, manoeuvres):
        for i in range(OUTPUT_COUNT):
            held = np.isfinite(part.residual[:, i])
            if held.any():
                groups.append((part.columns[held, i, :], part.residual[held, i], 1.0))
    white = refinement.covariance
    # What a record cannot tell apart has no deviation; the rest must not fail for it.
    keep = np.flatnonzero(np.isfinite(np.diag(white)) & (np.diag(white) > 0.0))
    corrected = np.full(white.shape, np.inf)
    chosen = [(x[:, keep], r, w) for x, r, w in groups]
    try:
        if quick:
            part_published = published_covariance_groups(chosen)
            part_corrected = QUICK_SHORTFALL**2 * part_published
        else:
            found = coloured_covariance_groups(chosen)
            part_published, part_corrected = found.published, found.corrected
    except ValueError:
        part_published = part_corrected = np.full((keep.size, keep.size), np.inf)
    corrected[np.ix_(keep, keep)] = part_corrected
    published = np.full(white.shape[0], np.inf)
    published[keep] = np.sqrt(np.maximum(np.diag(part_published), 0.0))
    # Autocovariances of a short record need not be positive definite; no deviation is below the white one then.
    floor = np.diag(white)
    variance = np.where(np.diag(corrected) > 0.0, np.diag(corrected), floor)
    free = len(refinement.free)
    first = free + 5 * len(manoeuvres)
    spread = np.sqrt(np.diag(white))
    relation = np.zeros_like(white)
    relation[np.ix_(keep, keep)] = white[np.ix_(keep, keep)] / np.outer(spread[keep], spread[keep])
    np.fill_diagonal(relation, 0.0)
    return Deviations(
        corrected=np.sqrt(variance)[:free],
        white=spread[:free],
        published=published[:free],
        covariance=corrected[:free, :free],
        correlation_max=np.max(np.abs(relation), axis=1)[:free] if free else np.zeros(0),
        effects=np.sqrt(variance)[first:],
        effects_white=spread[first:],
    )


NOISE_RATIO = 1.3
"""A residual this many times the log's own white noise is more than noise: the noise is known to 5-15 %."""


AS_REMEMBERED = 1.5
"""A residual this many times what its memory makes of the log's white noise is more than a sensor's own noise.

That noise is known from its rough part alone, within 25 %; what comes and goes, as samples that hang, has more left.
"""


def is_coloured(residual: NDArray[np.float64]) -> bool:
    """Whether a residual (N,) repeats itself, slowly or swinging: Ljung and Box's test at one in ten thousand."""
    found = whiteness(residual)
    return found is not None and found.p_value < 1e-4


def unexplained_channels(refinement: Refinement, manoeuvres: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """The channels whose residual is greater than their noise and coloured: there the model is still wrong.

    A sensor's own noise may be coloured too; `noise_memories` says how the two differ.
    """
    level = np.sqrt(refinement.variance)
    wrong: dict[str, None] = {}
    for part in whiten(refinement, manoeuvres):
        manoeuvre = manoeuvres[part.log]
        memories = noise_memories(manoeuvre.flight.time, part.residual)
        for i, name in enumerate(OUTPUTS):
            residual = part.residual[:, i]
            held = np.isfinite(residual)
            if held.sum() < 20:
                continue
            ratio = float(np.sqrt(np.mean(residual[held] ** 2))) * level[i] / manoeuvre.noise[i]
            own = ratio < AS_REMEMBERED * _understated(memories[i])
            if ratio > NOISE_RATIO and is_coloured(residual[held]) and not own:
                wrong[name] = None
    return tuple(wrong)


def _understated(memory: float) -> float:
    """By how much noise that keeps `memory` of each sample exceeds what its second differences show; NaN of NaN."""
    return float(np.sqrt(3.0 / ((3.0 - memory) * (1.0 - memory)))) if memory < 1.0 else np.nan


def coloured_noise(refinement: Refinement, manoeuvres: Sequence[Manoeuvre]) -> tuple[tuple[str, str, float], ...]:
    """Log, channel and memory of each sensor whose own noise is coloured: what one sample keeps of the last."""
    found = []
    for part in whiten(refinement, manoeuvres):
        manoeuvre = manoeuvres[part.log]
        memories = noise_memories(manoeuvre.flight.time, part.residual)
        for i, name in enumerate(OUTPUTS):
            residual = part.residual[:, i]
            if memories[i] > 0.0 and is_coloured(residual[np.isfinite(residual)]):
                found.append((manoeuvre.name, name, float(memories[i])))
    return tuple(found)
