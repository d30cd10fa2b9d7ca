"""Wald test of the final estimate: three of its own standard errors, one sign, its own p-value."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from problems import Problem, entry
from scipy.stats import norm

from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.maximum_likelihood import refine
from aerosid.search.attribution import Attribution, attribute_by_search
from aerosid.search.confirmation import Confirmed, note_on_confirmed
from aerosid.search.final_significance import eliminate_by_wald_test, note_on_eliminated
from aerosid.search.hypotheses import term_hypotheses
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import SuggestedTerm

USUAL = AttributionSettings()

DRAG = ("C_X", "alpha^2")
MOMENT = ("C_m", "alpha^2")
CANDIDATES = (DRAG, MOMENT, ("C_Z", "alpha*q_hat"))
FLIGHT = Problem(undeclared={DRAG: 3.6, MOMENT: -0.3}, duration=8.0)
"""The moment is so small that the simulation without it is hardly worse, and is significant all the same."""


@cache
def searched() -> tuple[StructureSearch, Attribution]:
    model, manoeuvre = FLIGHT.prepared(FLIGHT.fly(3))
    before = refine(model, [manoeuvre], model.entries, settings=WRONG_STRUCTURE)
    terms = term_hypotheses([entry(*each) for each in CANDIDATES])
    quiet = replace(USUAL, disturbances=False)
    search = StructureSearch((manoeuvre,), terms, (), before, quiet)
    return search.without_stored_fits(), attribute_by_search(search, [])


def search_requiring(deviations: float) -> StructureSearch:
    search, _ = searched()
    settings = replace(search.settings, final_deviations=deviations)
    return StructureSearch(search.manoeuvres, search.hypotheses, (), search.declared, settings)


def ratio_of(found: Attribution, coefficient: str) -> float:
    (finding,) = [finding for finding in found.findings if finding.where == coefficient]
    return abs(finding.value) / finding.std_error


def test_significant_findings_are_unchanged() -> None:
    search, found = searched()
    assert set(found.terms) == {entry(*DRAG), entry(*MOMENT)}
    assert eliminate_by_wald_test(found, search) is found
    assert note_on_eliminated(found, 3.0) == []


def test_an_insignificant_finding_is_eliminated_and_the_rest_re_estimated() -> None:
    _, found = searched()
    weak, strong = ratio_of(found, "C_m"), ratio_of(found, "C_X")
    assert 2.0 * weak < strong
    search = search_requiring(1.2 * weak)
    retained = eliminate_by_wald_test(found, search)
    assert [finding.where for finding in retained.eliminated] == ["C_m"]
    assert retained.terms == (entry(*DRAG),)
    assert entry(*MOMENT) not in retained.completed.free
    (drag,) = retained.findings
    assert drag.value == retained.completed.model.value(entry(*DRAG)) == pytest.approx(3.6, rel=0.1)
    alone = refine(retained.completed.model, search.manoeuvres, retained.completed.free)
    assert drag.value == pytest.approx(alone.model.value(entry(*DRAG)), abs=0.5 * drag.std_error)
    (sentence,) = note_on_eliminated(retained, search.settings.final_deviations)
    assert "C_m alpha^2" in sentence


def test_the_declared_structure_remains_where_nothing_is_significant() -> None:
    search = search_requiring(1e6)
    retained = eliminate_by_wald_test(searched()[1], search)
    assert (retained.findings, retained.alternatives, len(retained.eliminated)) == ((), (), 2)
    assert retained.completed.free == search.declared.free
    assert retained.completed is retained.before


@pytest.mark.parametrize(("sign", "named"), [(1.0, True), (-1.0, False)])
def test_a_term_whose_sign_another_flight_contradicts_is_not_named(sign: float, named: bool) -> None:
    search, found = searched()
    (drag,) = [finding for finding in found.findings if finding.entry == entry(*DRAG)]
    elsewhere = Confirmed(SuggestedTerm(drag, 3.5, 5.0), sign * drag.value, 0.1 * abs(drag.value), 1e-6)
    retained = eliminate_by_wald_test(replace(found, confirmed=(elsewhere,)), search)
    assert (entry(*DRAG) in retained.terms) is named
    assert [each.entry for each in retained.confirmed] == [entry(*DRAG)] * named
    assert len(note_on_confirmed(retained.confirmed, ["another"], retained.findings, USUAL.suggestion)) == named


def test_the_p_value_is_that_of_the_reported_estimate() -> None:
    search, found = searched()
    for finding in found.findings:
        own = 2.0 * norm.sf(abs(finding.value) / finding.std_error) * len(search.hypotheses)
        assert finding.p_value == pytest.approx(np.minimum(1.0, own), rel=1e-9)
