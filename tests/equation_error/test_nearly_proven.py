"""What would be named were it the only question is told with its number, and nothing of it is named."""

from __future__ import annotations

import numpy as np
import pytest
from equations_decided import decided, proved

from aerosid.equation_error.decision import EquationErrorDecision, decide
from aerosid.loop.methods import note_on_near_significant
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

BODY = BODIES[1]


def with_lift_of_airspeed(size: float) -> EquationErrorDecision:
    """Two flights whose lift depends a little on airspeed."""
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(9301))
    wrong = Wrong(terms={("C_Z", "V_hat"): size})
    logs = [flown(name, BODY, 9320 + i, air=0.5, wrong=wrong) for i, name in enumerate("ab")]
    return decided(aircraft, logs[:1], logs[1:])


def test_a_term_that_comes_near_its_price_is_told_with_its_number() -> None:
    found = with_lift_of_airspeed(0.1)
    assert not found.findings
    (row,) = found.nearly
    assert row.hypothesis.label == ("aero_term", "C_Z", "V_hat")
    assert abs(row.value - 0.1) < 2.0 * row.std_error
    assert 0.5 * row.price <= row.gain < row.price
    # A square of airspeed about its trim is twice the first power: the record cannot tell which.
    assert ("aero_term", "C_Z", "V_hat^2") in {rival.label for rival in row.rivals}
    ((standing, with_it),) = row.unseen
    assert (standing.recording, standing.coefficient) == ("b", "C_Z")
    assert with_it.r2 > standing.r2
    said = note_on_near_significant(row)
    assert said.startswith("Near-significant: C_Z V_hat of 0.092 ± 0.019 gains 9.8 in ln L; ")
    assert "; the penalty for the number of hypotheses is 12" in said
    assert "C_Z V_hat^2 fits nearly as well" in said


def test_what_is_named_or_absent_is_not_told_as_nearly_proven() -> None:
    assert with_lift_of_airspeed(0.0).nearly == ()
    found = with_lift_of_airspeed(0.4)
    assert [row.hypothesis.label for row in found.findings] == [("aero_term", "C_Z", "V_hat")]
    listed = {row.hypothesis.label for row in (*found.findings, *found.alternatives)}
    assert not listed & {row.hypothesis.label for row in found.nearly}


def test_a_fault_of_an_instrument_pays_for_all_that_was_asked_of_forces_too() -> None:
    """A scale of .993 is told just below the price at which the search lets one of .991 enter."""
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(9301))
    wrong = Wrong(scale={"theta": 0.993})
    logs = [flown(name, BODY, 9320 + i, air=0.5, wrong=wrong) for i, name in enumerate("ab")]
    faults = proved(aircraft, logs[:1], logs[1:])
    (row,) = decide(faults, aircraft.coefficients).nearly
    assert row.hypothesis.label == ("sensor_scale", "q", "")
    # Even odds cost half of ln N; the rest is the share in a false alarm: one of so many, products of factors less.
    settings, samples = row.estimate.frame.settings, row.estimate.design.target.size
    factors = [sum(f.power for _, term in h.entries for f in term.factors) for h in faults.asked]
    shares = [settings.factor_odds ** max(n - 1, 0) for n in factors] + [settings.factor_odds] * 2
    share = np.exp(0.5 * np.log(samples) - row.price) / settings.false_alarm
    assert share == pytest.approx(1.0 / sum(shares), rel=0.02)
