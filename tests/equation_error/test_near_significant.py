"""Near-significant effects are reported with their values, and not selected."""

from __future__ import annotations

import numpy as np
import pytest
from equations_decided import decided, identified

from aerosid.equation_error.decision import EquationErrorDecision, decide
from aerosid.equation_error.selection.candidates import is_instrument_error
from aerosid.equation_error.selection.near_significant import near_significant_effect
from aerosid.equation_error.selection.stepwise import recordings_agree
from aerosid.loop.equation_error_notes import note_on_near_significant
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

BODY = BODIES[1]


def with_lift_of_airspeed(size: float) -> EquationErrorDecision:
    """Two flights whose lift depends a little on airspeed."""
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(9301))
    wrong = Wrong(terms={("C_Z", "V_hat"): size})
    logs = [flown(name, BODY, 9320 + i, air=0.5, wrong=wrong) for i, name in enumerate("ab")]
    return decided(aircraft, logs[:1], logs[1:])


def test_a_near_significant_term_is_reported_with_its_value() -> None:
    found = with_lift_of_airspeed(0.1)
    assert not found.findings
    (row,) = found.near_significant
    assert row.hypothesis.label == ("aero_term", "C_Z", "V_hat")
    assert abs(row.value - 0.1) < 2.0 * row.std_error
    assert 0.5 * row.penalty <= row.gain < row.penalty
    # A square of airspeed about its trim is twice the first power: the record cannot distinguish them.
    assert ("aero_term", "C_Z", "V_hat^2") in {other.label for other in row.indistinguishable}
    ((without_it, with_it),) = row.validation_fits
    assert (without_it.recording, without_it.coefficient) == ("b", "C_Z")
    assert with_it.r2 > without_it.r2
    text = note_on_near_significant(row)
    assert text.startswith("Near-significant: C_Z V_hat of 0.092 ± 0.019 gains 9.7 in ln L; ")
    assert "; the penalty for the number of hypotheses is 12" in text
    assert "C_Z V_hat^2 fits nearly as well" in text


def test_selected_and_absent_effects_are_not_near_significant() -> None:
    assert with_lift_of_airspeed(0.0).near_significant == ()
    found = with_lift_of_airspeed(0.4)
    assert [row.hypothesis.label for row in found.findings] == [("aero_term", "C_Z", "V_hat")]
    listed = {row.hypothesis.label for row in (*found.findings, *found.alternatives)}
    assert not listed & {row.hypothesis.label for row in found.near_significant}


def test_the_penalty_of_an_instrument_error_counts_all_hypotheses() -> None:
    """A scale factor of .993 is near-significant just below the penalty that one of .991 exceeds."""
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(9301))
    wrong = Wrong(scale={"theta": 0.993})
    logs = [flown(name, BODY, 9320 + i, air=0.5, wrong=wrong) for i, name in enumerate("ab")]
    errors = identified(aircraft, logs[:1], logs[1:])
    (row,) = decide(errors, aircraft.coefficients).near_significant
    assert row.hypothesis.label == ("sensor_scale", "q", "")
    # Even odds cost half of ln N; the rest is the share in the false-alarm rate: smaller for products of factors.
    settings, samples = row.estimate.problem.settings, row.estimate.design.target.size
    factors = [sum(f.power for _, term in h.entries for f in term.factors) for h in errors.hypotheses]
    shares = [settings.factor_odds ** max(n - 1, 0) for n in factors] + [settings.factor_odds] * 2
    share = np.exp(0.5 * np.log(samples) - row.penalty) / settings.false_alarm
    assert share == pytest.approx(1.0 / sum(shares), rel=0.02)


def test_an_error_that_a_calibrated_instrument_retains_is_not_named() -> None:
    """A scale factor of .9965 in quiet air exceeds the penalty; .004 is what a calibration leaves."""
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(9301))
    wrong = Wrong(scale={"theta": 0.9965})
    logs = [flown(name, BODY, 9530 + i, air=0.05, wrong=wrong, seconds=140.0) for i, name in enumerate("ab")]
    errors = identified(aircraft, logs[:1], logs[1:])
    assert errors.selected.chosen == ()
    sensors = [hypothesis for hypothesis in errors.hypotheses if is_instrument_error(hypothesis)]
    row = near_significant_effect(errors.selected, errors.criterion, sensors, recordings_agree)
    assert row is not None
    assert row.hypothesis.label == ("sensor_scale", "theta", "")
    assert row.is_retained
    assert row.gain > row.penalty
    assert "a calibrated instrument retains as much" in note_on_near_significant(row)
