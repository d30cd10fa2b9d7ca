"""Screening of candidates by partial correlation with d(t), each passed through the same estimator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from aerosid.effects import BodyEffect, OutputEffect, PositionEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.estimation.score_test import Score
from aerosid.model_error.flight_sweeps.sweeps import FlightSweeps
from aerosid.model_error.flight_sweeps.swept_model import Sweep
from aerosid.model_error.term_selection.partial_correlation import correlated_alone, correlated_together, remainders
from aerosid.search.partial_correlation.parts import plain_t_ratios
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings
from aerosid.signals.spectral_covariance import score_covariance

Array = NDArray[np.float64]


SENSOR_EFFECTS = OutputEffect, PositionEffect
"""Kinds of effect of the sensors."""

EFFECTS_CONTAINING_D = *SENSOR_EFFECTS, BodyEffect
"""Kinds whose regressors contain d(t) itself: of the sensor's channel, or of the moment about the body's axis."""


@dataclass(frozen=True)
class Chord:
    """A hypothesis with difference quotients to one of its trial values as derivatives; `place`: its index."""

    place: int
    hypothesis: Hypothesis
    trial: int

    @property
    def columns(self) -> int:
        """Number of its free parameters."""
        return len(self.hypothesis.entries) + sum(active.slopes for active in self.hypothesis.effects)


def chords_of(hypotheses: Sequence[Hypothesis]) -> list[Chord]:
    """Every hypothesis with the chord to each of its trial values."""
    return [
        Chord(place, hypothesis.by_chord(trial), trial)
        for place, hypothesis in enumerate(hypotheses)
        for trial in range(max((len(p.trials) for a in hypothesis.effects for p in a.effect.parameters), default=1))
    ]


def screen(
    sweeps: FlightSweeps,
    current: Sweep,
    hypotheses: Sequence[Hypothesis],
    chords: Sequence[Chord],
    settings: ModelErrorSearchSettings,
    tested: int,
) -> list[Score]:
    """Scores of the candidates by partial correlation with d(t), each by its chord of largest gain.

    Parameters
    ----------
    sweeps : FlightSweeps
        The flights.
    current : Sweep
        The present structure's estimate.
    hypotheses : sequence of Hypothesis
        The candidates.
    chords : sequence of Chord
        Those of the candidates to be screened.
    tested : int
        Number of candidates of the search, for p-values (Bonferroni).
    """
    best: dict[int, Score] = {}
    samples = sum(manoeuvre.flight.time.size for manoeuvre in sweeps.flights.manoeuvres)
    room = max(settings.asked_at_once // samples, 1)
    for some in _in_batches(chords, room):
        for chord, found in zip(some, _screened(sweeps, current, some, settings, tested), strict=True):
            gain, step, independence = found
            known = best.get(chord.place)
            if known is None or gain > known.gain:
                best[chord.place] = Score(hypotheses[chord.place], gain, step, independence, chord.trial)
    return list(best.values())


def undisturbed_p_value(sweeps: FlightSweeps, trial: Sweep, hypothesis: Hypothesis, tested: int) -> float:
    """p-value of a sensor's or the body's parameters, their regressors taken along the motion without d(t).

    d(t) takes in part of a sensor's coloured noise, and the regressor of a sensor error (lag, scale factor) contains
    the d(t) of its own channel: regressor and residual then share that noise, and their correlation, however
    significant, is no evidence of a sensor error. The regressor of a moment of inertia contains the d(t) of its own
    moment, so that it follows any model error there. Regressors along the motion without d(t) do not. The residual
    there is coloured within each channel and, where forces are missing, between channels: both are allowed for. Zero
    for terms and controls, and where that motion cannot be simulated.

    Parameters
    ----------
    sweeps : FlightSweeps
        The flights.
    trial : Sweep
        The structure with the candidate.
    hypothesis : Hypothesis
        The candidate.
    tested : int
        Number of candidates of the search (Bonferroni).
    """
    entered = {
        (active.name, active.log) for active in hypothesis.effects if isinstance(active.effect, EFFECTS_CONTAINING_D)
    }
    places: list[int] = []
    offsets: list[float] = []
    place = len(trial.swept.free)
    for active in trial.swept.effects:
        if (active.name, active.log) in entered:
            places += range(place, place + active.slopes)
            offsets += [v - p.null for v, p in zip(active.values, active.effect.parameters, strict=True)]
        place += active.slopes
    if not places:
        return 0.0
    try:
        undisturbed = sweeps.undisturbed(trial)
    except OutOfRangeError:
        return 0.0
    return min(1.0, tested * _joint_p_value(sweeps, undisturbed, places, np.array(offsets)))


def _joint_p_value(sweeps: FlightSweeps, undisturbed: Sweep, places: list[int], offsets: Array) -> float:
    """Joint p-value of parameters at `offsets` from their null values, in noise coloured in and between channels."""
    known = undisturbed.fit.whitened(undisturbed.rows.known)
    others = np.delete(known, places, axis=1)
    others = others / np.maximum(np.linalg.norm(others, axis=0), np.finfo(float).tiny)
    basis, strength, _ = np.linalg.svd(others, full_matrices=False)
    basis = basis[:, strength > 1e-10 * strength[0]]
    own = known[:, places]
    remaining = own - basis @ (basis.T @ own)
    size = np.linalg.norm(remaining, axis=0)
    if float(np.min(size / np.linalg.norm(own, axis=0))) ** 2 <= sweeps.settings.colour.least_independence:
        return 1.0
    columns = remaining / size
    # The residual with these parameters at their null values, to first order.
    target = undisturbed.fit.whitened(undisturbed.rows.target[:, None])[:, 0] + own @ offsets
    target -= basis @ (basis.T @ target)
    solution = np.linalg.lstsq(columns, target, rcond=1e-8)[0]
    covariance, freedom = np.zeros((len(places), len(places))), 0.0
    for x, e in _by_sample(sweeps, undisturbed, columns, target - columns @ solution):
        of_flight, degrees = score_covariance(x, e)
        covariance += of_flight
        freedom += degrees
    scores = columns.T @ target
    statistic = float(scores @ np.linalg.pinv(covariance, hermitian=True) @ scores)
    return float(special.fdtrc(scores.size, freedom, statistic / scores.size))


def _by_sample(
    sweeps: FlightSweeps, undisturbed: Sweep, columns: Array, residual: Array
) -> Iterator[tuple[Array, Array]]:
    """Columns (N, outputs, k) and residuals (N, outputs) of each flight; zero where nothing was measured."""
    for n, manoeuvre in enumerate(sweeps.flights.manoeuvres):
        samples = manoeuvre.flight.measured.shape
        x, e = np.zeros((*samples, columns.shape[1])), np.zeros(samples)
        for part, (flight, output) in zip(undisturbed.fit.groups, undisturbed.rows.channels, strict=True):
            if flight == n:
                held = np.isfinite(manoeuvre.flight.measured[:, output])
                x[held, output], e[held, output] = columns[part], residual[part]
        yield x, e


def _in_batches(chords: Sequence[Chord], columns: int) -> Iterator[list[Chord]]:
    """Batches of at most so many columns; at least one chord each."""
    batch: list[Chord] = []
    held = 0
    for chord in chords:
        if batch and held + chord.columns > columns:
            yield batch
            batch, held = [], 0
        batch.append(chord)
        held += chord.columns
    if batch:
        yield batch


def _screened(
    sweeps: FlightSweeps, current: Sweep, chords: Sequence[Chord], settings: ModelErrorSearchSettings, tested: int
) -> list[tuple[float, tuple[float, ...], float]]:
    """Of each chord the chi-square of its parameters, their step and their independence."""
    entries = list(dict.fromkeys(entry for chord in chords for entry in chord.hypothesis.entries))
    effects = [active for chord in chords for active in chord.hypothesis.effects]
    rows = sweeps.asked(current, entries, effects)
    remaining = remainders(current.fit, rows.asked)
    single = correlated_alone(current.fit, remaining, asked=tested)
    ratios = single.ratio if settings.partial else plain_t_ratios(rows.target, rows.asked)
    place = {entry: n for n, entry in enumerate(entries)}
    column = len(entries)
    found: list[tuple[float, tuple[float, ...], float]] = []
    for chord in chords:
        count = sum(active.slopes for active in chord.hypothesis.effects)
        columns = [place[entry] for entry in chord.hypothesis.entries] + list(range(column, column + count))
        column += count
        if len(columns) == 1:
            only = columns[0]
            gain, step = float(ratios[only] ** 2), (float(single.coefficient[only]),)
            found.append((gain, step, float(single.independence[only])))
        else:
            found.append(correlated_together(current.fit, remaining.among(np.array(columns))))
    return found
