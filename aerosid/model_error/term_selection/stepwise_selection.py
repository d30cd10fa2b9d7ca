"""Stepwise selection of the terms that a user's own system lacks, by partial correlation with its model error.

For any model function and any record: IEBMEE, discrete or continuous, the fixed interval, candidates passed through
the same estimator, partial correlation in the coloured noise of d, and recursive least squares.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import UsageError
from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.discrete import estimate_discrete
from aerosid.model_error.estimators.fixed_interval import (
    FixedInterval,
    fixed_interval_continuous,
    fixed_interval_discrete,
)
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.response import respond
from aerosid.model_error.estimators.weights import Weights
from aerosid.model_error.term_selection.partial_correlation import (
    Coloured,
    ColourSettings,
    coloured_regression,
    partial_correlations,
)
from aerosid.signals.least_squares import RecursiveFit, recursive_least_squares

Array = NDArray[np.float64]
Function = Callable[..., Any]


@dataclass(frozen=True)
class Candidate:
    """A term that the model may lack.

    Attributes
    ----------
    name : str
        As reported.
    equation : int
        Index of the state equation that contains it, from 0.
    function : callable
        function(x, u, t) -> float: what a coefficient of one adds to that equation's rate (discrete: to that state of
        the next sample).
    """

    name: str
    equation: int
    function: Callable[..., float]


@dataclass(frozen=True)
class SelectionSettings:
    """Settings of the selection.

    Attributes
    ----------
    false_alarm : float
        Share of records with nothing missing in which some candidate may enter.
    rounds : int
        How many may enter.
    passes : int
        Estimates with corrected coefficients in each round: the states improve with them.
    least_share : float
        Share of the squares of the first d that a term must explain, in (0, 1): below, a record without noise shows
        the estimator's own linearisation.
    colour : ColourSettings
        Of d's noise.
    """

    false_alarm: float = 0.001
    rounds: int = 6
    passes: int = 4
    least_share: float = 1e-6
    colour: ColourSettings = field(default_factory=ColourSettings)


@dataclass(frozen=True)
class CandidateRow:
    """What a candidate shares with d in one round: partial correlation, t-ratio, p-value among all candidates."""

    name: str
    equation: int
    correlation: float
    ratio: float
    p_value: float


@dataclass(frozen=True)
class TermSelection:
    """What the record says that the model lacks.

    Attributes
    ----------
    names : tuple of str
        Of the terms that entered, in the order in which they did.
    coefficients, deviations : (k,) arrays
        Of these, with the standard deviations in coloured noise.
    rounds : tuple of tuple of CandidateRow
        Candidates of each round, the strongest first.
    completed : callable
        The model with the terms, (x, u, t) -> (n,).
    history : ModelErrorHistory
        Forward estimate of the model as given.
    interval : FixedInterval
        Fixed-interval estimate of the model as given: its d(t) with covariance.
    recursion : RecursiveFit
        Recursive least squares of the terms, then of the initial state's error, sample by sample.
    """

    names: tuple[str, ...]
    coefficients: Array
    deviations: Array
    rounds: tuple[tuple[CandidateRow, ...], ...]
    completed: Function
    history: ModelErrorHistory
    interval: FixedInterval
    recursion: RecursiveFit


def select_terms_continuous(
    f: Function,
    h: Function,
    time: ArrayLike,
    y: ArrayLike,
    x0: ArrayLike,
    weights: Weights,
    candidates: Sequence[Candidate],
    *,
    u: ArrayLike | None = None,
    settings: SelectionSettings | None = None,
) -> TermSelection:
    """The terms that the rates f lack, on a sampled record.

    Parameters
    ----------
    f, h, time, y, x0, weights, u
        As for `estimate_continuous`; Q2^-1 says in which equations model error is allowed.
    candidates : sequence of Candidate
        Terms of these equations.
    settings : SelectionSettings, optional

    Raises
    ------
    UsageError
        Where shapes do not fit, there is no candidate, or one is in an equation without model error.
    EstimationError
        Where an estimate stops being finite.
    """
    instants = np.asarray(time, dtype=np.float64)

    def forward(model: Function) -> ModelErrorHistory:
        return estimate_continuous(model, h, instants, y, x0, weights, u=u)

    def whole(model: Function) -> FixedInterval:
        return fixed_interval_continuous(model, h, instants, y, x0, weights, u=u)

    return _select(_System(f, forward, whole, instants, u), weights, candidates, settings or SelectionSettings())


def select_terms_discrete(
    f: Function,
    h: Function,
    y: ArrayLike,
    x0: ArrayLike,
    weights: Weights,
    candidates: Sequence[Candidate],
    *,
    u: ArrayLike | None = None,
    settings: SelectionSettings | None = None,
) -> TermSelection:
    """As `select_terms_continuous`, for a map f from sample to sample; t is the sample's number as a float."""

    def forward(model: Function) -> ModelErrorHistory:
        return estimate_discrete(model, h, y, x0, weights, u=u)

    def whole(model: Function) -> FixedInterval:
        return fixed_interval_discrete(model, h, y, x0, weights, u=u)

    steps = np.arange(float(len(np.asarray(y)) - 1))
    return _select(_System(f, forward, whole, steps, u), weights, candidates, settings or SelectionSettings())


@dataclass(frozen=True)
class _System:
    """A model with its estimators; `time` (M,) of the samples, or of the steps' beginnings."""

    f: Function
    forward: Callable[[Function], ModelErrorHistory]
    whole: Callable[[Function], FixedInterval]
    time: Array
    u: ArrayLike | None

    def with_terms(self, terms: Sequence[Candidate], coefficients: Array) -> Function:
        """The model with terms added."""
        if not terms:
            return self.f

        def completed(x: Array, u: Array, t: float) -> Array:
            rates = np.array(self.f(x, u, t), dtype=np.float64)
            for term, value in zip(terms, coefficients, strict=True):
                rates[term.equation] += value * term.function(x, u, t)
            return rates

        return completed

    def columns(self, terms: Sequence[Candidate], states: Array) -> Array:
        """Each term of coefficient one along states, (M, n, terms)."""
        count, n = self.time.size, states.shape[1]
        inputs = np.zeros((count, 0)) if self.u is None else np.asarray(self.u, dtype=np.float64)
        found = np.zeros((count, n, len(terms)))
        for m, term in enumerate(terms):
            for k in range(count):
                found[k, term.equation, m] = term.function(states[k], inputs[k], self.time[k])
        if not np.isfinite(found).all():
            bad = terms[int(np.flatnonzero(~np.isfinite(found).all(axis=(0, 1)))[0])].name
            raise UsageError(
                f"candidate {bad!r} is not finite along the estimated states; give it where it is defined."
            )
        return found


@dataclass(frozen=True)
class _Pictures:
    """d of the equations with model error, and what candidates and an error of the initial state show in it."""

    target: Array
    terms: Array
    initial: Array
    lengths: tuple[int, ...]


def _select(
    system: _System, weights: Weights, candidates: Sequence[Candidate], settings: SelectionSettings
) -> TermSelection:
    equations = np.flatnonzero(np.diagonal(weights.Q2_inverse, axis1=-2, axis2=-1).reshape(-1, len(weights.S0)).any(0))
    _require(candidates, equations, len(weights.S0))
    history, interval = system.forward(system.f), system.whole(system.f)
    chosen: list[int] = []
    values = np.zeros(len(candidates))
    rounds: list[tuple[CandidateRow, ...]] = []
    pictures = _pictures(system, candidates, history, interval.states, equations)
    fit = coloured_regression(pictures.target, pictures.initial, pictures.lengths, settings.colour)
    first = float(fit.residual @ fit.residual)  # an error of the initial state makes the first samples of d large
    for _ in range(settings.rounds + 1):
        found = partial_correlations(fit, pictures.terms, settings.colour)
        rows = [
            CandidateRow(
                c.name, c.equation, float(found.correlation[m]), float(found.ratio[m]), float(found.p_value[m])
            )
            for m, c in enumerate(candidates)
        ]
        rounds.append(tuple(sorted(rows, key=lambda row: -abs(row.ratio))))
        places = [m for m in range(len(candidates)) if m not in chosen]
        best = max(places, key=lambda m: abs(float(found.ratio[m])), default=None)
        if best is None or len(chosen) == settings.rounds or found.p_value[best] > settings.false_alarm:
            break
        left = fit.residual @ fit.residual
        if float(found.correlation[best]) ** 2 * left < settings.least_share * first:
            break
        chosen.append(best)
        fit, pictures = _refined(system, candidates, chosen, values, equations, settings)
    k = len(chosen)
    known = np.column_stack([pictures.terms[:, chosen], pictures.initial])
    recursion = recursive_least_squares(*_in_time(known, pictures))
    terms = [candidates[m] for m in chosen]
    return TermSelection(
        tuple(term.name for term in terms),
        values[chosen],
        np.sqrt(np.diag(fit.covariance))[:k],
        tuple(rounds),
        system.with_terms(terms, values[chosen]),
        history,
        interval,
        recursion,
    )


def _refined(
    system: _System,
    candidates: Sequence[Candidate],
    chosen: Sequence[int],
    values: Array,
    equations: NDArray[np.int64],
    settings: SelectionSettings,
) -> tuple[Coloured, _Pictures]:
    """The regression with the chosen terms, each pass at the states of the model corrected by the last; sets values."""
    terms = [candidates[m] for m in chosen]
    for turn in range(settings.passes):
        model = system.with_terms(terms, values[list(chosen)])
        pictures = _pictures(system, candidates, system.forward(model), system.whole(model).states, equations)
        known = np.column_stack([pictures.terms[:, chosen], pictures.initial])
        fit = coloured_regression(pictures.target, known, pictures.lengths, settings.colour)
        step = fit.coefficients[: len(chosen)]
        if turn + 1 == settings.passes:
            break
        values[list(chosen)] += step
    return fit, pictures


def _pictures(
    system: _System,
    candidates: Sequence[Candidate],
    history: ModelErrorHistory,
    states: Array,
    equations: NDArray[np.int64],
) -> _Pictures:
    columns = system.columns(candidates, states)
    count, n, width = columns.shape
    both = np.concatenate([columns, np.zeros((count, n, n))], axis=2)
    start = np.concatenate([np.zeros((n, width)), np.eye(n)], axis=1)
    responses = respond(history, both, start)
    target = np.concatenate([history.model_error[:, e] for e in equations])
    stacked = np.concatenate([responses[:, e, :] for e in equations])
    return _Pictures(target, stacked[:, :width], stacked[:, width:], (count,) * len(equations))


def _in_time(known: Array, pictures: _Pictures) -> tuple[Array, Array]:
    """Rows in the order of time: all equations of a sample, then the next sample."""
    groups = len(pictures.lengths)
    order = np.arange(known.shape[0]).reshape(groups, -1).T.ravel()
    return known[order], pictures.target[order]


def _require(candidates: Sequence[Candidate], equations: NDArray[np.int64], states: int) -> None:
    if not candidates:
        raise UsageError("no candidate was given; give at least one Candidate(name, equation, function).")
    names = [candidate.name for candidate in candidates]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise UsageError(f"candidate {twice!r} is given twice; give each a name of its own.")
    for candidate in candidates:
        if not 0 <= candidate.equation < states:
            raise UsageError(
                f"candidate {candidate.name!r} is in equation {candidate.equation}, but the system has equations 0 "
                f"to {states - 1}."
            )
        if candidate.equation not in equations:
            raise UsageError(
                f"candidate {candidate.name!r} is in equation {candidate.equation}, where Q2^-1 allows no model "
                "error; give a density above zero there."
            )
