"""The report tells on which grounds an effect was refuted, and only validation's are called validation's decisions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from equations_decided import decided

from aerosid.effects.refutation import Refutation
from aerosid.loop.verdict import notes_on_refuted, validation_decisions
from aerosid.search.equation_error_attribution import attribute_by_equations
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SEED = 7900
"""Of tests; published tables and trials begin elsewhere."""

GROUNDS = {
    ("aero_term", "C_m", "alpha^2"): Refutation.PREDICTION,
    ("aero_term", "C_X", "q_hat"): Refutation.OWN_FIT,
}


def test_each_refuted_effect_is_told_with_its_grounds() -> None:
    by_prediction, by_own_fit = notes_on_refuted(GROUNDS)
    assert by_prediction.startswith("C_m alpha^2 ")
    assert "prediction of the validation flights" in by_prediction
    assert by_own_fit.startswith("C_X q_hat ")
    assert "validation" not in by_own_fit
    assert "its coefficient itself is fitted worse" in by_own_fit
    (by_parts, _) = notes_on_refuted(GROUNDS, by_blocks=True)
    assert "of parts of them from the rest" in by_parts


def test_validation_is_said_to_have_decided_only_what_it_did() -> None:
    aircraft = aircraft_of(BODIES[0], 0.08, np.random.default_rng(SEED))
    log = flown("one", BODIES[0], SEED, air=0.0, seconds=24.0)
    decision = replace(decided(aircraft, [log], []), refuted=GROUNDS)
    found = attribute_by_equations(decision, [each.manoeuvre for each in decision.completed.problem.recordings])
    assert validation_decisions(found) == ("refuted C_m alpha^2",)
