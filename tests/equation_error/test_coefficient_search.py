"""Exchange of chosen hypotheses: what is likelier comes in, and nothing that was struck out."""

from __future__ import annotations

import numpy as np
import pytest
from equations_decided import frames_of

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import in_place_of
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.penalties import rules_for
from aerosid.equation_error.selection.structure import Selected
from aerosid.flight_model.terms import parse_term
from aerosid.search.hypotheses import term_hypotheses
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 7700
"""Of tests; published tables and trials begin elsewhere."""

TERMS = ["alpha^2", "alpha^3", "alpha^4", "delta_e^2"]


@pytest.fixture(scope="module")
def search_and_start() -> tuple[CoefficientSearch, Selected]:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    wrong = Wrong(terms={("C_m", "alpha^3"): -30.0})
    logs = [flown(name, body, SEEDS + n, air=0.2, wrong=wrong) for n, name in enumerate("ab")]
    entries = [("C_m", parse_term(term)) for term in TERMS]
    model, whole, fitted = frames_of(aircraft, logs[:1], logs[1:], entries)
    asked = tuple(term_hypotheses(entries))
    start = estimate(whole, Point(model, tuple((d.coefficient, d.term) for d in aircraft.derivatives), ()))
    rules = rules_for(asked, start.design.target.size, 0.05, 0.1)
    coefficients = tuple(aircraft.coefficients)
    search = CoefficientSearch(asked, coefficients, fitted, rules, lambda _found, _hypothesis: True, lambda _text: None)
    fourth = [h for h in asked if h.term == "alpha^4"]
    begun = search.forward(Selected(start, ()), fourth, 1, sudden=False)
    assert [each.hypothesis.term for each in begun.chosen] == ["alpha^4"]
    return search, begun


def test_a_term_is_exchanged_for_the_likelier_one_unless_that_is_struck_out(
    search_and_start: tuple[CoefficientSearch, Selected],
) -> None:
    search, begun = search_and_start
    assert [each.hypothesis.term for each in search.replaced(begun, search.asked).chosen] == ["alpha^3"]
    struck_out = [h.label for h in search.asked if h.term == "alpha^3"]
    without = search.replaced(begun, search.asked, struck_out)
    assert not {each.hypothesis.label for each in without.chosen} & set(struck_out)


def test_what_promises_to_lose_is_left_out_and_asked_when_all_are(
    search_and_start: tuple[CoefficientSearch, Selected],
) -> None:
    search, begun = search_and_start
    (each,) = begun.chosen

    def answer(selected: Selected, farthest: float | None = None) -> list[tuple[str, float, float]]:
        limit = None if farthest is None else lambda _hypothesis: farthest
        return [(r.hypothesis.term, r.behind, r.value) for r in in_place_of(selected, each, search.asked, limit)]

    fresh, again = Selected(begun.estimate, begun.chosen), Selected(begun.estimate, begun.chosen)
    every = answer(fresh)
    assert every[0][0] == "alpha^3"
    assert answer(again, 0.0)[0] == every[0]
    far_ahead = Selected(begun.estimate, begun.chosen)
    assert not answer(far_ahead, -1e3)  # nothing promises so much
    assert answer(far_ahead, 0.0)[0] == every[0]
    assert answer(again) == answer(far_ahead) == every
    assert answer(fresh, -1e3) == every  # known already
