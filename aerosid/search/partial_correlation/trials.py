"""Shortlist of candidates by their scores in d(t), and their first-order trials.

A first-order trial is the regression on a candidate's columns and the known ones along the measured motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from aerosid.effects import KINDS
from aerosid.effects.aerodynamic_terms import rarity
from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.score_test import Score
from aerosid.model_error.flight_sweeps.sweeps import FlightSweeps
from aerosid.model_error.flight_sweeps.swept_model import Rows, Sweep, SweptModel
from aerosid.search.partial_correlation.parts import has_plausible_apparent_mass
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings

Array = NDArray[np.float64]


def net_gain(score: Score, settings: ModelErrorSearchSettings) -> float:
    """Gain of a candidate's correlation with d(t), less the penalties of its parameters and its rarity."""
    hypothesis = score.hypothesis
    rare = sum(rarity(term) for _, term in hypothesis.entries)
    effects = [active.effect for active in hypothesis.effects if active.effect.kind in KINDS]
    rare += max((KINDS[effect.kind].rarity_at(effect.where) for effect in effects), default=0.0)
    return score.gain - settings.price * (hypothesis.parameters - 1) - rare


def shortlisted(
    scores: Sequence[Score], current: Sweep, first: Manoeuvre, settings: ModelErrorSearchSettings, tested: int
) -> list[Score]:
    """The best few candidates, one per label, and the best of kinds that the first-order ranking does not cover.

    Parameters
    ----------
    scores : sequence of Score
        Largest net gain first.
    current : Sweep
        The present structure's estimate.
    first : Manoeuvre
        A flight, for the density of the air and the mass.
    tested : int
        Number of candidates of the search (Bonferroni).
    """
    least = float(special.ndtri(0.5 * settings.false_alarm / max(tested, 1))) ** 2
    limit = settings.apparent_mass
    scores = [
        score for score in scores if has_plausible_apparent_mass(score.hypothesis, score.start, current, first, limit)
    ]
    priced = [(score, net_gain(score, settings)) for score in scores]
    best = max((value for score, value in priced if score.hypothesis.is_plain_term), default=0.0)
    listed: dict[tuple[str, str, str], Score] = {}
    for score, value in priced:
        linear = settings.kept_statistics and score.hypothesis.is_plain_term
        enough = value > settings.least_share * least and value >= settings.nearly_best * best * linear
        # Where trials are held, those by simulation are expensive: one of each kind, below.
        apart = settings.kept_statistics and _is_nonlinear(score.hypothesis)
        if enough and not apart and len(listed) < settings.shortlist:
            listed.setdefault(score.hypothesis.label, score)
    greatest = max((score.gain for score in listed.values()), default=0.0)
    kinds = {score.hypothesis.kind for score in listed.values()}
    for score in scores:
        kind = score.hypothesis.kind
        enough = score.gain > max(settings.unlike_share * greatest, least)
        if _is_nonlinear(score.hypothesis) and kind not in kinds and enough:
            kinds.add(kind)
            listed.setdefault(score.hypothesis.label, score)
    return list(listed.values())


def _is_nonlinear(hypothesis: Hypothesis) -> bool:
    """Whether the candidate's kind is far from linear, so that its first-order rank is not meaningful."""
    return hypothesis.kind in KINDS and not KINDS[hypothesis.kind].follows_its_score


def is_linear(hypothesis: Hypothesis) -> bool:
    """Whether the response is linear in a candidate's parameters, as for terms, biases and scale factors.

    It is not where a parameter has several trial values, nor for a step change, whose instant is a parameter too.
    """
    numbers = [parameter for active in hypothesis.effects for parameter in active.effect.parameters]
    return hypothesis.time is None and all(len(parameter.trials) < 2 for parameter in numbers)


def first_order_trials(sweeps: FlightSweeps, current: Sweep, scores: Sequence[Score]) -> list[Sweep]:
    """Fits of each candidate by one regression, the statistics of d(t) held and the noise's colour re-estimated.

    The motion with d(t) is the measured one whatever the model error, so that the columns along it are those of a full
    trial.

    Parameters
    ----------
    sweeps : FlightSweeps
        The flights.
    current : Sweep
        The present structure's estimate.
    scores : sequence of Score
        The candidates, each of them linear.

    Returns
    -------
    list of Sweep
        In the order of the scores; each with the candidate's parameters after its step, the others unchanged.
    """
    if not scores:
        return []
    entries = list(dict.fromkeys(entry for score in scores for entry in score.hypothesis.entries))
    effects = [active for score in scores for active in score.hypothesis.by_chord(score.trial).effects]
    rows = sweeps.asked(current, entries, effects)
    place = {entry: n for n, entry in enumerate(entries)}
    column = len(entries)
    found = []
    for score in scores:
        hypothesis = score.hypothesis
        count = sum(active.slopes for active in hypothesis.effects)
        extended = _with_candidate_columns(
            current.swept, rows, [place[e] for e in hypothesis.entries], range(column, column + count)
        )
        column += count
        fit = sweeps.regressed(extended)
        free, slopes = len(current.swept.free), current.swept.slopes
        own = len(hypothesis.entries)
        step = fit.coefficients[free : free + own]
        moved = hypothesis.at(fit.coefficients[free + own + slopes : free + own + slopes + count].tolist(), score.trial)
        model = current.swept.model.extended(hypothesis.entries)
        values = model.values.copy()
        values[model.indices(hypothesis.entries)] = step
        swept = replace(
            current.swept,
            model=model.with_values(values),
            free=(*current.swept.free, *hypothesis.entries),
            effects=(*current.swept.effects, *moved.effects),
        )
        found.append(Sweep(swept, extended, fit, fit.cost + rows.log_sum, (), False))
    return found


def _with_candidate_columns(swept: SweptModel, rows: Rows, terms: Sequence[int], numbers: Sequence[int]) -> Rows:
    """Rows with some candidate columns among the known ones, in the order of a structure that holds them."""
    free, slopes = len(swept.free), swept.slopes
    known = rows.known
    parts = (
        known[:, :free],
        rows.asked[:, list(terms)],
        known[:, free : free + slopes],
        rows.asked[:, list(numbers)],
        known[:, free + slopes :],
    )
    return replace(rows, known=np.column_stack(parts), asked=rows.asked[:, :0])
