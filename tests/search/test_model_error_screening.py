"""Screening by d(t): pieces of the candidates say what all of them at once say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import LIGHT, Problem

from aerosid.estimation.manoeuvre import prepare
from aerosid.estimation.score_test import Score
from aerosid.loop.identification import asked_of
from aerosid.loop.methods import Question
from aerosid.model_error.flight_sweep import FlightSweeps, is_seen
from aerosid.model_error.paper_chain import ChainSettings
from aerosid.search.model_error_attribution import swept_start
from aerosid.search.model_error_screening import chords_of, screen
from aerosid.search.model_error_settings import ModelErrorSearchSettings


@pytest.fixture(scope="module")
def screened() -> tuple[list[Score], list[Score]]:
    """All candidates of a flight that lacks a term: in one piece, and in pieces of seven columns or fewer."""
    log = Problem(undeclared={("C_m", "alpha^2"): -1.715}, duration=8.0).fly(21)
    model, candidates = asked_of([log], [], LIGHT)
    asked = Question(LIGHT, model, (), candidates, (prepare(log, LIGHT, model.columns),), ())
    settings = ModelErrorSearchSettings()
    arguments = (model, asked.manoeuvres, asked.free, (), LIGHT.coefficients, ChainSettings(), settings)
    sweeps = FlightSweeps(asked.manoeuvres, LIGHT.coefficients)
    current = sweeps.estimate(swept_start(*arguments), sweeps=2)
    hypotheses = [h for h in asked.hypotheses("all") if all(is_seen(active) for active in h.effects)]
    chords = chords_of(hypotheses)
    few = replace(settings, asked_at_once=7 * log.time.size)
    return tuple(screen(sweeps, current, hypotheses, chords, each, len(hypotheses)) for each in (settings, few))  # type: ignore[return-value]


def test_pieces_score_every_candidate_as_all_at_once(screened: tuple[list[Score], list[Score]]) -> None:
    whole, pieces = ({score.hypothesis: score for score in scores} for scores in screened)
    assert whole.keys() == pieces.keys()
    assert len(whole) > 100
    greatest = max(score.gain for score in whole.values())
    for hypothesis, score in whole.items():
        other = pieces[hypothesis]
        assert other.trial == score.trial
        assert other.gain == pytest.approx(score.gain, rel=1e-7, abs=1e-9 * greatest)
        np.testing.assert_allclose(other.start, score.start, rtol=1e-6, atol=1e-12)


def test_the_missing_term_leads_the_terms(screened: tuple[list[Score], list[Score]]) -> None:
    terms = [score for score in screened[0] if score.hypothesis.is_plain_term]
    best = max(terms, key=lambda score: score.gain)
    assert best.hypothesis.label == ("aero_term", "C_m", "alpha^2")
