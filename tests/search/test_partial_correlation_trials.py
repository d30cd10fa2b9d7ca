"""First-order trials along a motion with d(t), against fits by simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import LIGHT, Problem

from aerosid.estimation.manoeuvre import prepare
from aerosid.estimation.score_test import Score
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.model_error.flight_sweeps.sweeps import FlightSweeps, is_seen
from aerosid.model_error.flight_sweeps.swept_model import Sweep
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.search.partial_correlation.attribution import swept_start
from aerosid.search.partial_correlation.screening import chords_of, screen
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings
from aerosid.search.partial_correlation.trials import first_order_trials, is_linear, net_gain, shortlisted

MISSING = ("C_m", "alpha^2")
SETTINGS = ModelErrorSearchSettings(kept_statistics=True)


@pytest.fixture(scope="module")
def screened() -> tuple[IdentificationProblem, FlightSweeps, Sweep, list[Score]]:
    log = Problem(undeclared={MISSING: -1.715}, duration=8.0).fly(21)
    model, candidates = declared_with_candidates([log], [], LIGHT)
    asked = IdentificationProblem(LIGHT, model, (), candidates, (prepare(log, LIGHT, model.columns),), ())
    arguments = (model, asked.manoeuvres, asked.free, (), LIGHT.coefficients, ChainSettings(), SETTINGS)
    sweeps = FlightSweeps(asked.manoeuvres, LIGHT.coefficients)
    current = sweeps.estimate(swept_start(*arguments), sweeps=2)
    hypotheses = [h for h in asked.hypotheses("all") if all(is_seen(active) for active in h.effects)]
    scores = screen(sweeps, current, hypotheses, chords_of(hypotheses), SETTINGS, len(hypotheses))
    return asked, sweeps, current, sorted(scores, key=lambda score: -net_gain(score, SETTINGS))


@pytest.mark.parametrize("label", [("aero_term", *MISSING), ("sensor_scale", "q", "")])
def test_a_first_order_trial_agrees_with_a_fit_by_simulation(
    screened: tuple[IdentificationProblem, FlightSweeps, Sweep, list[Score]], label: tuple[str, str, str]
) -> None:
    _, sweeps, current, scores = screened
    score = next(score for score in scores if score.hypothesis.label == label)
    (trial,) = first_order_trials(sweeps, current, [score])
    entries, effects = score.hypothesis.entries, score.hypothesis.effects
    further = replace(
        current.swept,
        model=current.swept.model.extended(entries),
        free=(*current.swept.free, *entries),
        effects=(*current.swept.effects, *effects),
    )
    flown = sweeps.estimate(further, search=False)
    place = len(flown.swept.free) - len(entries)
    deviation = np.sqrt(np.diag(flown.fit.covariance))[place]
    at = [
        sweep.swept.model.value(entries[0]) if entries else sweep.swept.effects[-1].values[0]
        for sweep in (trial, flown)
    ]
    assert at[0] == pytest.approx(at[1], abs=0.5 * deviation)
    assert current.cost - trial.cost == pytest.approx(current.cost - flown.cost, rel=0.1, abs=4.0)


def test_only_candidates_with_a_linear_response_are_linear(
    screened: tuple[IdentificationProblem, FlightSweeps, Sweep, list[Score]],
) -> None:
    kinds = {score.hypothesis.kind for score in screened[3] if is_linear(score.hypothesis)}
    assert {"aero_term", "sensor_bias", "sensor_scale"} <= kinds
    assert not kinds & {"step_change", "control_lag", "control_delay", "sensor_lag", "sensor_delay"}


def test_an_implausible_apparent_mass_is_not_tried(
    screened: tuple[IdentificationProblem, FlightSweeps, Sweep, list[Score]],
) -> None:
    asked, _, current, scores = screened
    heave = next(s for s in scores if s.hypothesis.label == ("aero_term", "C_Z", "alpha_dot_hat"))
    best = next(s for s in scores if s.hypothesis.label == ("aero_term", *MISSING))
    first = asked.manoeuvres[0]
    # The mass of the air in a cylinder about the chord is about a hundredth of the aircraft's: a C_Z of 1 per alphadot.
    for step, there in ((-1.0, True), (-500.0, False)):
        leading = [replace(heave, gain=10.0 * best.gain, start=(step,)), best]
        listed = shortlisted(leading, current, first, SETTINGS, len(scores))
        assert (heave.hypothesis in [s.hypothesis for s in listed]) == there
        assert (best.hypothesis in [s.hypothesis for s in listed]) != there  # a tenth of the first is not nearly best
