"""Near-significant terms are reported with their estimates, and only where the model is inadequate."""

from __future__ import annotations

import pytest
from problems import LIGHT, Problem, entry, shaken

from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.logs.flight_log import FlightLog
from aerosid.search.hypotheses import term_hypotheses
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import note_on_suggested, suggested_terms

USUAL = AttributionSettings()

DRAG = ("C_X", "alpha^2")


def searched(problem: Problem, log: FlightLog) -> tuple[StructureSearch, Refinement]:
    model, manoeuvre = problem.prepared(log)
    before = refine(model, [manoeuvre], model.entries, settings=WRONG_STRUCTURE)
    terms = term_hypotheses((entry(*DRAG), entry("C_m", "alpha^3"), entry("C_Z", "alpha*q_hat")))
    return StructureSearch((manoeuvre,), terms, LIGHT.coefficients, before, USUAL), before


def test_a_near_significant_term_is_reported_with_its_standard_error() -> None:
    problem = Problem(undeclared={DRAG: 3.6})
    search, before = searched(problem, shaken(problem.fly(), 5))
    first, *_ = suggested_terms(search, before)
    assert (first.finding.where, first.finding.term) == DRAG
    assert first.finding.value == pytest.approx(3.6, rel=0.2)
    assert first.ratio == pytest.approx(first.finding.value / first.finding.std_error)
    (sentence, *_) = note_on_suggested([first])
    assert "C_X alpha^2" in sentence
    assert "standard errors from zero" in sentence
    assert not [each for each in suggested_terms(search, before, [("aero_term", *DRAG)]) if each.finding.where == "C_X"]


def test_no_term_is_suggested_where_the_model_is_adequate() -> None:
    problem = Problem()
    search, before = searched(problem, problem.fly())
    assert suggested_terms(search, before) == ()
