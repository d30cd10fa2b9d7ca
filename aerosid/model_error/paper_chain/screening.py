"""Correlation screening of d(t) with candidate terms: the paper's table 3, on any flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.score_test import Score
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import EQUATION, MOTION, equation_of, loads_of, moving_of
from aerosid.model_error.aircraft_error.force_history import ErrorHistory
from aerosid.model_error.aircraft_error.forward_estimate import AircraftErrorHistory, estimate_aircraft_error
from aerosid.model_error.paper_chain.chain import Chain, ChainSettings, Fed, choose_error_density
from aerosid.signals import prefilter
from aerosid.signals.correlation import correlation
from aerosid.signals.prefilter import Butterworth
from aerosid.signals.recursive_filter import butterworth_sections, filtered_both_ways


@dataclass(frozen=True)
class ScreeningRow:
    """One candidate in the screening of d(t).

    `correlation` with d(t) as the paper has it, `partial` after the terms already there took their share, both of
    candidate and error through the same estimator; `gain` the likelihood gain of the score test; `chosen` whether
    it entered the model.
    """

    coefficient: str
    term: str
    correlation: float
    partial: float
    gain: float
    independence: float
    chosen: bool


@dataclass(frozen=True)
class RegressorPicture:
    """The model error of one equation against one candidate term, both through the recursion, over all logs.

    `candidate` (N,) is the term's picture in d(t); `left` (N,), in units of the coefficient, is d(t) less what the
    other found terms explain for a term that was `chosen`, and all of d(t) for one that was not; `slope` and
    `correlation` of `left` over `candidate` about their means.
    """

    coefficient: str
    term: str
    candidate: NDArray[np.float64]
    left: NDArray[np.float64]
    slope: float
    correlation: float
    chosen: bool


def screen(
    chain: Chain,
    manoeuvres: Sequence[Manoeuvre],
    candidates: Sequence[Entry],
    chosen: Sequence[Entry],
    scores: Sequence[Score],
    settings: ChainSettings,
) -> tuple[ScreeningRow, ...]:
    """Every candidate's correlation with the model error of its equation, greatest partial correlation first.

    Parameters
    ----------
    chain : Chain
        Of the declared structure.
    manoeuvres : sequence of Manoeuvre
        The identification flights.
    candidates : sequence of Entry
        Terms that the declared model lacks.
    chosen : sequence of Entry
        Those that entered.
    scores : sequence of Score
        Likelihood gains from the first round of the search.

    Notes
    -----
    `correlation` is the plain one of Parameswaran & Raol 1994, table 3, about the means; `partial` that of what the
    declared terms of the equation and an error of the initial state leave of either.
    """
    model = chain.model.extended(candidates)
    density = choose_error_density(chain.model, manoeuvres, settings, chain.error_density)
    histories = _histories(chain, model, density)
    gains = {score.hypothesis.entries[0]: score for score in scores if score.hypothesis.entries}
    declared = model.indices(chain.entries)
    rows = []
    for equation in range(len(moving_of(model.axes))):
        target, held = _joined(histories, equation)
        known = np.column_stack(
            [
                np.concatenate([h.responded[:, equation, :][:, declared] for h in histories])[held],
                _starts(histories, equation)[held],
            ]
        )
        basis = _orthonormal(known)
        left = target - basis @ (basis.T @ target)
        for entry in candidates:
            if equation_of(model.axes, entry[0]) != equation:
                continue
            place = model.index(entry)
            column = np.concatenate([h.responded[:, equation, place] for h in histories])[held]
            score = gains.get(entry)
            rows.append(
                ScreeningRow(
                    entry[0],
                    str(entry[1]),
                    correlation(target, column),
                    correlation(left, column - basis @ (basis.T @ column)),
                    score.gain if score else 0.0,
                    score.independence if score else 0.0,
                    entry in chosen,
                )
            )
    return tuple(sorted(rows, key=lambda row: (-row.gain, -abs(row.partial))))


def error_histories(
    chain: Chain, manoeuvres: Sequence[Manoeuvre], chosen: Sequence[Entry], settings: ChainSettings
) -> tuple[tuple[ErrorHistory, ...], dict[Entry, float]]:
    """The d(t) of the model without the chosen terms, with those terms over it, and |rho| for each chosen term.

    Parameters
    ----------
    chain : Chain
        Of the completed structure.
    chosen : sequence of Entry
        The terms that the declared model lacks.

    Returns
    -------
    One history per log and equation, d in units of the coefficient; and for each chosen term the correlation of what
    the other chosen terms leave of d with its own picture in d.
    """
    axes, places = chain.model.axes, chain.model.indices(chosen)
    _, coefficients, histories = _errors_without(chosen, chain, manoeuvres, settings)
    rows: list[ErrorHistory] = []
    for manoeuvre, history in zip(manoeuvres, histories, strict=True):
        for equation, state in enumerate(moving_of(axes)):
            names = [entry for entry in chosen if equation_of(axes, entry[0]) == equation]
            picture = history.responded[:, equation, :][:, places] @ coefficients
            d = history.d[:, equation]
            held = np.isfinite(d)
            acting = [name for name in loads_of(axes) if EQUATION[name] == state]
            wind = [name for name in acting if name in axes.wind_axes]
            turned = bool(wind) and any(entry[0] in axes.wind_axes for entry in chain.entries)
            name = wind[0] if turned else acting[0]
            unit = (-1.0 if turned else 1.0) * history.rate_per_unit[:, equation]
            rows.append(
                ErrorHistory(
                    log=manoeuvre.log.name,
                    coefficient=name,
                    time=manoeuvre.log.time,
                    d=d / unit,
                    explained=picture / unit,
                    correlation=correlation(d[held], picture[held]) if names else 0.0,
                    terms=tuple(str(entry[1]) for entry in names),
                )
            )
    correlations = {}
    for n, entry in enumerate(chosen):
        equation = equation_of(axes, entry[0])
        target, held = _joined(histories, equation)
        columns = np.concatenate([h.responded[:, equation, :][:, places] for h in histories])[held]
        others = np.delete(np.arange(len(chosen)), n)
        left = target - columns[:, others] @ coefficients[others]
        correlations[entry] = abs(correlation(left, columns[:, n]))
    return tuple(rows), correlations


def regressor_pictures(
    chain: Chain,
    manoeuvres: Sequence[Manoeuvre],
    chosen: Sequence[Entry],
    rivals: Sequence[Entry],
    settings: ChainSettings,
) -> tuple[RegressorPicture, ...]:
    """The d(t) of the model without the chosen terms against each of them and against each rival.

    Parameters
    ----------
    chain : Chain
        Of the completed structure.
    chosen : sequence of Entry
        The terms that the declared model lacks.
    rivals : sequence of Entry
        Terms that did not enter, to be seen against the whole of d.
    """
    places = chain.model.indices(chosen)
    lacking, coefficients, histories = _errors_without(chosen, chain, manoeuvres, settings, rivals)
    pictures = []
    for entry in (*chosen, *rivals):
        equation = equation_of(lacking.axes, entry[0])
        left, held = _joined(histories, equation)
        columns = np.concatenate([h.responded[:, equation, :] for h in histories])[held]
        unit = np.concatenate([h.rate_per_unit[:, equation] for h in histories])[held]
        if entry in chosen:
            others = [n for n, other in enumerate(chosen) if other != entry]
            left = left - columns[:, places[others]] @ coefficients[others]
        pictures.append(_regressor(entry, columns[:, lacking.index(entry)] / unit, left / unit, entry in chosen))
    return tuple(pictures)


def closest_rivals(rows: Sequence[ScreeningRow], candidates: Sequence[Entry]) -> tuple[Entry, ...]:
    """Of each equation, the first candidate in the order of the rows that did not enter the model."""
    entries = {(coefficient, str(term)): (coefficient, term) for coefficient, term in candidates}
    first: dict[str, Entry] = {}
    for row in rows:
        if not row.chosen and (row.coefficient, row.term) in entries:
            first.setdefault(EQUATION[row.coefficient], entries[row.coefficient, row.term])
    return tuple(first[state] for state in MOTION if state in first)


def _errors_without(
    chosen: Sequence[Entry],
    chain: Chain,
    manoeuvres: Sequence[Manoeuvre],
    settings: ChainSettings,
    rivals: Sequence[Entry] = (),
) -> tuple[AerodynamicModel, NDArray[np.float64], list[AircraftErrorHistory]]:
    """The model with the chosen terms and the rivals at zero, what the chosen were worth, and its d(t) on every log."""
    places = chain.model.indices(chosen)
    values = chain.model.values.copy()
    coefficients = values[places]
    values[places] = 0.0
    lacking = chain.model.with_values(values).extended(rivals)
    density = choose_error_density(lacking, manoeuvres, settings, chain.error_density)
    return lacking, coefficients, _histories(chain, lacking, density)


def _histories(chain: Chain, model: AerodynamicModel, density: NDArray[np.float64]) -> list[AircraftErrorHistory]:
    """The d(t) of a model on the logs of the chain, in the band of the motion."""
    return [_seen(estimate_aircraft_error(model, part.flight, part.variance, density), part) for part in chain.fed]


def _regressor(
    entry: Entry, candidate: NDArray[np.float64], left: NDArray[np.float64], chosen: bool
) -> RegressorPicture:
    """The picture with the slope of least squares about the means: the constant is the trim's."""
    spread = float(np.var(candidate))
    slope = float(np.mean((candidate - candidate.mean()) * (left - left.mean()))) / spread if spread > 0.0 else 0.0
    return RegressorPicture(entry[0], str(entry[1]), candidate, left, slope, correlation(left, candidate), chosen)


def _seen(history: AircraftErrorHistory, fed: Fed) -> AircraftErrorHistory:
    """The history with d(t) and every picture in it low-passed alike, to the band in which the aircraft moves.

    d(t) of the recursion follows the noise of its channels far above the frequencies at which forces act; the band is
    that of the angle of attack, which every force follows. Nothing is low-passed where that band is not known.
    """
    band = fed.cut_off.per_channel.get("alpha") if fed.cut_off is not None else None
    interval = float(np.median(np.diff(fed.flight.time)))
    if band is None or PICTURE_BAND * band >= 0.4 / interval:
        return history
    low_pass = Butterworth(2, PICTURE_BAND * band)

    steps = np.diff(fed.flight.time)
    even = bool(np.ptp(steps) < 1e-3 * interval) and bool(np.isfinite(history.d).all())
    sections = butterworth_sections(low_pass.order, low_pass.cut_off_hz, interval)

    def smooth(values: NDArray[np.float64]) -> NDArray[np.float64]:
        if even:  # all columns at once
            return filtered_both_ways(sections, values)
        flat = values.reshape(values.shape[0], -1)
        columns = [prefilter.apply(low_pass, fed.flight.time, column) for column in flat.T]
        return np.column_stack(columns).reshape(values.shape) if columns else values

    return replace(history, d=smooth(history.d), responded=smooth(history.responded), initial=smooth(history.initial))


PICTURE_BAND = 1.0
"""Display: cut-off of the pictures over the frequency above which alpha holds no signal worth keeping, 1."""


def _joined(histories: Sequence[AircraftErrorHistory], equation: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The d of one equation over all logs without missing samples, and which samples were there."""
    d = np.concatenate([history.d[:, equation] for history in histories])
    present = np.isfinite(d)
    return d[present], present


def _starts(histories: Sequence[AircraftErrorHistory], equation: int) -> NDArray[np.float64]:
    """The responses to errors of the initial states, one block of columns a log."""
    samples, states = [history.d.shape[0] for history in histories], histories[0].initial.shape[2]
    columns = np.zeros((sum(samples), states * len(histories)))
    start = 0
    for n, history in enumerate(histories):
        columns[start : start + samples[n], states * n : states * (n + 1)] = history.initial[:, equation, :]
        start += samples[n]
    return columns


def _orthonormal(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """An orthonormal basis of the columns' span; directions within rounding of the others are left out."""
    length = np.linalg.norm(columns, axis=0)
    scaled = columns[:, length > 0.0] / length[length > 0.0]
    left, strength, _ = np.linalg.svd(scaled, full_matrices=False)
    basis: NDArray[np.float64] = left[:, strength > 1e-9 * strength[0]]
    return basis
