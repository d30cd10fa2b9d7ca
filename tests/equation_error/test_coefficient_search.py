"""Replacement of selected hypotheses: by likelier ones, and by none that is excluded."""

from __future__ import annotations

import numpy as np
import pytest
from equations_decided import frames_of

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.alternatives import replacements_of
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.penalties import criterion_for
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.flight_model.terms import parse_term
from aerosid.search.hypotheses import term_hypotheses
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 7700
"""Of tests; published tables and trials begin elsewhere."""

TERMS = ["alpha^2", "alpha^3", "alpha^4", "delta_e^2"]


@pytest.fixture(scope="module")
def search_and_initial() -> tuple[CoefficientSearch, SelectedStructure]:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    wrong = Wrong(terms={("C_m", "alpha^3"): -30.0})
    logs = [flown(name, body, SEEDS + n, air=0.2, wrong=wrong) for n, name in enumerate("ab")]
    entries = [("C_m", parse_term(term)) for term in TERMS]
    model, whole, fitted = frames_of(aircraft, logs[:1], logs[1:], entries)
    hypotheses = tuple(term_hypotheses(entries))
    start = estimate(whole, Point(model, tuple((d.coefficient, d.term) for d in aircraft.derivatives), ()))
    criterion = criterion_for(hypotheses, start.design.target.size, 0.05, 0.1)
    coefficients = tuple(aircraft.coefficients)
    search = CoefficientSearch(hypotheses, coefficients, fitted, criterion, lambda _found, _hypothesis: True)
    fourth = [h for h in hypotheses if h.term == "alpha^4"]
    initial = search.forward(SelectedStructure(start, ()), fourth, 1, step_changes=False)
    assert [each.hypothesis.term for each in initial.chosen] == ["alpha^4"]
    return search, initial


def test_a_term_is_replaced_by_the_likelier_one_unless_excluded(
    search_and_initial: tuple[CoefficientSearch, SelectedStructure],
) -> None:
    search, initial = search_and_initial
    assert [each.hypothesis.term for each in search.with_replacements(initial, search.hypotheses).chosen] == ["alpha^3"]
    excluded = [h.label for h in search.hypotheses if h.term == "alpha^3"]
    without = search.with_replacements(initial, search.hypotheses, excluded)
    assert not {each.hypothesis.label for each in without.chosen} & set(excluded)


def test_replacements_of_large_predicted_deficit_are_estimated_only_without_a_limit(
    search_and_initial: tuple[CoefficientSearch, SelectedStructure],
) -> None:
    search, initial = search_and_initial
    (each,) = initial.chosen

    def replacements(selected: SelectedStructure, largest: float | None = None) -> list[tuple[str, float, float]]:
        limit = None if largest is None else lambda _hypothesis: largest
        return [
            (r.hypothesis.term, r.deficit, r.value) for r in replacements_of(selected, each, search.hypotheses, limit)
        ]

    fresh, again = (
        SelectedStructure(initial.estimate, initial.chosen),
        SelectedStructure(initial.estimate, initial.chosen),
    )
    every = replacements(fresh)
    assert every[0][0] == "alpha^3"
    assert replacements(again, 0.0)[0] == every[0]
    far_ahead = SelectedStructure(initial.estimate, initial.chosen)
    assert not replacements(far_ahead, -1e3)  # no predicted gain is so large
    assert replacements(far_ahead, 0.0)[0] == every[0]
    assert replacements(again) == replacements(far_ahead) == every
    assert replacements(fresh, -1e3) == every  # cached already
