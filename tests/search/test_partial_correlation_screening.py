"""Screening by d(t): batches of the candidates have the scores of all at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import LIGHT, NOISE, SILENT, Problem
from scipy.signal import lfilter

from aerosid.estimation.manoeuvre import prepare
from aerosid.estimation.score_test import Score
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.model_error.flight_sweeps.sweeps import FlightSweeps, is_seen
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.search.partial_correlation.attribution import swept_start
from aerosid.search.partial_correlation.screening import chords_of, screen, undisturbed_p_value
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings


@pytest.fixture(scope="module")
def screened() -> tuple[list[Score], list[Score]]:
    """All candidates of a flight with a missing term: in one batch, and in batches of seven columns or fewer."""
    log = Problem(undeclared={("C_m", "alpha^2"): -1.715}, duration=8.0).fly(21)
    model, candidates = declared_with_candidates([log], [], LIGHT)
    asked = IdentificationProblem(LIGHT, model, (), candidates, (prepare(log, LIGHT, model.columns),), ())
    settings = ModelErrorSearchSettings()
    arguments = (model, asked.manoeuvres, asked.free, (), LIGHT.coefficients, ChainSettings(), settings)
    sweeps = FlightSweeps(asked.manoeuvres, LIGHT.coefficients)
    current = sweeps.estimate(swept_start(*arguments), sweeps=2)
    hypotheses = [h for h in asked.hypotheses("all") if all(is_seen(active) for active in h.effects)]
    chords = chords_of(hypotheses)
    few = replace(settings, asked_at_once=7 * log.time.size)
    return tuple(screen(sweeps, current, hypotheses, chords, each, len(hypotheses)) for each in (settings, few))  # type: ignore[return-value]


def test_batches_score_every_candidate_as_all_at_once(screened: tuple[list[Score], list[Score]]) -> None:
    whole, pieces = ({score.hypothesis: score for score in scores} for scores in screened)
    assert whole.keys() == pieces.keys()
    assert len(whole) > 100
    greatest = max(score.gain for score in whole.values())
    for hypothesis, score in whole.items():
        other = pieces[hypothesis]
        assert other.trial == score.trial
        assert other.gain == pytest.approx(score.gain, rel=1e-7, abs=1e-9 * greatest)
        np.testing.assert_allclose(other.start, score.start, rtol=1e-6, atol=1e-12)


def test_the_missing_term_has_the_largest_score_of_the_terms(screened: tuple[list[Score], list[Score]]) -> None:
    terms = [score for score in screened[0] if score.hypothesis.is_plain_term]
    best = max(terms, key=lambda score: score.gain)
    assert best.hypothesis.label == ("aero_term", "C_m", "alpha^2")


SENSORS = (("sensor_scale", "a_x"), ("sensor_lag", "a_z"))
"""False findings on flights in coloured noise, before their columns were taken along the motion without d(t)."""


def in_coloured_noise(seed: int, memory: float = 0.7, size: float = 3.0) -> FlightLog:
    """A flight without a missing effect, its sensors' noise AR(1)."""
    log = Problem(elevator="3211", amplitude=0.045, noise=SILENT).fly(seed)
    generator = np.random.default_rng(seed)
    channels = dict(log.channels)
    for name, deviation in NOISE.items():
        if name != "delta_e":
            shocks = generator.standard_normal(log.time.size + 100)
            noise = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], shocks)[100:]
            channels[name] = channels[name] + size * deviation * noise
    return FlightLog(log.name, log.time, channels, log.units)


def sensor_p_values(log: FlightLog) -> list[float]:
    """p-value of each of `SENSORS`, fitted by itself."""
    model, candidates = declared_with_candidates([log], [], LIGHT)
    asked = IdentificationProblem(LIGHT, model, (), candidates, (prepare(log, LIGHT, model.columns),), ())
    settings = ModelErrorSearchSettings()
    sweeps = FlightSweeps(asked.manoeuvres, LIGHT.coefficients)
    start = swept_start(model, asked.manoeuvres, asked.free, (), LIGHT.coefficients, ChainSettings(), settings)
    hypotheses = [h for h in asked.hypotheses("all") if (h.kind, h.where) in SENSORS]
    assert [(h.kind, h.where) for h in hypotheses] == list(SENSORS)
    return [
        undisturbed_p_value(sweeps, sweeps.estimate(replace(start, effects=h.effects), sweeps=3), h, 1)
        for h in hypotheses
    ]


@pytest.mark.slow
def test_coloured_noise_in_d_gives_no_sensor_error_along_the_motion_without_d() -> None:
    found = np.array([sensor_p_values(in_coloured_noise(seed)) for seed in range(40, 50)])
    # Twenty tests: the least of their p-values is below 5e-4 once in a hundred such sets, their mean outside these
    # bounds once in a thousand.
    assert found.min() > 5e-4
    assert 0.28 < found.mean() < 0.72


def test_a_sensor_error_is_significant_along_the_motion_without_d() -> None:
    log = in_coloured_noise(61)
    channels = {**log.channels, "a_x": 1.3 * log["a_x"]}
    scale, lag = sensor_p_values(FlightLog(log.name, log.time, channels, log.units))
    assert scale < 1e-8
    assert lag > 1e-3


def test_candidates_other_than_sensor_errors_are_not_tested_along_the_motion_without_d(
    screened: tuple[list[Score], list[Score]],
) -> None:
    log = Problem(duration=8.0).fly(21)
    model, candidates = declared_with_candidates([log], [], LIGHT)
    asked = IdentificationProblem(LIGHT, model, (), candidates, (prepare(log, LIGHT, model.columns),), ())
    sweeps = FlightSweeps(asked.manoeuvres, LIGHT.coefficients)
    start = swept_start(
        model, asked.manoeuvres, asked.free, (), LIGHT.coefficients, ChainSettings(), ModelErrorSearchSettings()
    )
    trial = sweeps.estimate(start, search=False, sweeps=1)
    term = next(score.hypothesis for score in screened[0] if score.hypothesis.is_plain_term)
    assert undisturbed_p_value(sweeps, trial, term, 1000) == 0.0
