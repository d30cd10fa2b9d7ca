"""Screening of candidates by partial correlation with d(t), each passed through the same estimator."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.score_test import Score
from aerosid.model_error.flight_sweep import FlightSweeps
from aerosid.model_error.partial_correlation import correlated_alone, correlated_together, remainders
from aerosid.model_error.swept_model import Sweep
from aerosid.search.model_error_parts import plain_t_ratios
from aerosid.search.model_error_settings import ModelErrorSearchSettings


@dataclass(frozen=True)
class Chord:
    """A hypothesis with its derivatives taken over the distance of one of its trial values; `of`: its place."""

    of: int
    hypothesis: Hypothesis
    trial: int

    @property
    def columns(self) -> int:
        """How many numbers it makes free."""
        return len(self.hypothesis.entries) + sum(active.slopes for active in self.hypothesis.effects)


def chords_of(hypotheses: Sequence[Hypothesis]) -> list[Chord]:
    """Every hypothesis by the chord of each of its trial values."""
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
    asked: int,
) -> list[Score]:
    """What the correlation of each candidate with d(t) is worth, by the chord that brings most.

    Parameters
    ----------
    sweeps : FlightSweeps
        The flights.
    current : Sweep
        The present structure's estimate.
    hypotheses : sequence of Hypothesis
        The candidates.
    chords : sequence of Chord
        Of those of them that are asked.
    asked : int
        How many candidates the search looks at, for p-values.
    """
    best: dict[int, Score] = {}
    samples = sum(manoeuvre.flight.time.size for manoeuvre in sweeps.flights.manoeuvres)
    room = max(settings.asked_at_once // samples, 1)
    for some in _in_batches(chords, room):
        for chord, found in zip(some, _screened(sweeps, current, some, settings, asked), strict=True):
            gain, step, independence = found
            known = best.get(chord.of)
            if known is None or gain > known.gain:
                best[chord.of] = Score(hypotheses[chord.of], gain, step, independence, chord.trial)
    return list(best.values())


def _in_batches(chords: Sequence[Chord], columns: int) -> Iterator[list[Chord]]:
    """So many that their columns are no more; at least one."""
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
    sweeps: FlightSweeps, current: Sweep, chords: Sequence[Chord], settings: ModelErrorSearchSettings, asked: int
) -> list[tuple[float, tuple[float, ...], float]]:
    """Of each chord the chi-square of its numbers, their step and their independence."""
    entries = list(dict.fromkeys(entry for chord in chords for entry in chord.hypothesis.entries))
    effects = [active for chord in chords for active in chord.hypothesis.effects]
    rows = sweeps.asked(current, entries, effects)
    left = remainders(current.fit, rows.asked)
    single = correlated_alone(current.fit, left, asked=asked)
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
            found.append(correlated_together(current.fit, left.among(np.array(columns))))
    return found
