"""Exchange of chosen hypotheses: what is likelier comes in, and nothing that was struck out."""

from __future__ import annotations

import numpy as np
from equations_decided import frames_of

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.deletion import Selected
from aerosid.equation_error.selection.prices import rules_for
from aerosid.flight_model.terms import parse_term
from aerosid.search.hypotheses import term_hypotheses
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 7700
"""Of tests; published tables and trials begin elsewhere."""

TERMS = ["alpha^2", "alpha^3", "alpha^4", "delta_e^2"]


def test_a_term_is_exchanged_for_the_likelier_one_unless_that_is_struck_out() -> None:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    wrong = Wrong(terms={("C_m", "alpha^3"): -30.0})
    logs = [flown(name, body, SEEDS + n, air=0.2, wrong=wrong) for n, name in enumerate("ab")]
    entries = [("C_m", parse_term(term)) for term in TERMS]
    model, whole, fitted = frames_of(aircraft, logs[:1], logs[1:], entries)
    asked = tuple(term_hypotheses(entries))
    start = estimate(whole, Point(model, tuple((d.coefficient, d.term) for d in aircraft.derivatives), ()))
    search = CoefficientSearch(
        asked,
        tuple(aircraft.coefficients),
        fitted,
        rules_for(asked, start.design.target.size, 0.05, 0.1),
        lambda _found, _hypothesis: True,
        lambda _text: None,
    )
    begun = search.forward(Selected(start, ()), [h for h in asked if h.term == "alpha^4"], 1, sudden=False)
    assert [each.hypothesis.term for each in begun.chosen] == ["alpha^4"]
    assert [each.hypothesis.term for each in search.replaced(begun, asked).chosen] == ["alpha^3"]
    struck_out = [h.label for h in asked if h.term == "alpha^3"]
    without = search.replaced(begun, asked, struck_out)
    assert not {each.hypothesis.label for each in without.chosen} & set(struck_out)
