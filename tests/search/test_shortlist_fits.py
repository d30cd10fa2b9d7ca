"""Trial fits of a shortlist: what is left out could not have won, and a restart that returns is given up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import BOTH_SQUARES, Problem, entry

from aerosid.estimation.competing_fits import fit_competing_structures
from aerosid.estimation.deviations import deviations
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.maximum_likelihood import Refinement, Start, refine
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.search.finding_evidence import findings_with_p_values
from aerosid.search.forward_selection import forward_selection
from aerosid.search.hypotheses import term_hypotheses
from aerosid.search.settings import AttributionSettings
from aerosid.search.shortlist_fits import fits_of, leading_fits
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import shortlisted

OFFERED = [
    entry(coefficient, text)
    for coefficient in ("C_m", "C_X")
    for text in ("alpha^2", "alpha^3", "alpha^4", "pos(alpha)^2", "alpha*q_hat", "alpha*delta_e")
]


def searched(settings: AttributionSettings | None = None) -> StructureSearch:
    model, manoeuvre = Problem(undeclared=BOTH_SQUARES).prepared(Problem(undeclared=BOTH_SQUARES).fly())
    declared = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    usual = replace(AttributionSettings(), disturbances=False)
    return StructureSearch((manoeuvre,), term_hypotheses(OFFERED), (), declared, settings or usual, model)


@pytest.fixture(scope="module")
def search() -> StructureSearch:
    """Terms alone, of which two are missing."""
    return searched()


def test_a_term_that_is_left_out_would_not_have_won(search: StructureSearch) -> None:
    shortlist = shortlisted(search, search.scores(search.declared))
    fits, left_out = leading_fits(search, search.declared, shortlist)
    assert {score.hypothesis.label for score in left_out} | {each.score.hypothesis.label for each in fits} == {
        score.hypothesis.label for score in shortlist
    }
    assert len(left_out) > len(shortlist) / 2
    best = min(search.penalised_cost(each.fit) for each in fits)
    for score in left_out:
        anew = refine(
            search.declared.model.extended(score.hypothesis.entries),
            search.manoeuvres,
            (*search.declared.free, *score.hypothesis.entries),
        )
        assert search.penalised_cost(anew) > best


def test_a_fit_that_returns_to_a_known_estimate_is_given_up(
    search: StructureSearch, monkeypatch: pytest.MonkeyPatch
) -> None:
    shortlist = shortlisted(search, search.scores(search.declared))
    ((score, known), *_) = fits_of(search, search.declared, shortlist[:1])
    assert known.converged
    assert search.declared_values is not None
    start = Start(search.declared_values.extended(score.hypothesis.entries), known.free)
    count = 0
    evaluate = Likelihood.evaluate

    def counted(*arguments: object) -> object:
        nonlocal count
        count += 1
        return evaluate(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Likelihood, "evaluate", counted)
    evaluations = []
    fits: list[Refinement] = []
    for each in (replace(start, known=known), start):
        count = 0
        fits += fit_competing_structures([each], search.manoeuvres, TRIAL, [0.0], np.inf)
        evaluations.append(count)
    returning, independent = fits
    assert not returning.converged
    assert independent.converged
    assert independent.cost == pytest.approx(known.cost, abs=2.0)
    assert evaluations[0] < evaluations[1]


def test_what_a_score_test_whitened_is_not_simulated_again(search: StructureSearch) -> None:
    current = replace(search.declared)
    search.linearised_with_candidates(current)
    stored = search.stored_whitened(current)
    assert stored is not None
    for quick in (True, False):
        known, anew = (deviations(current, search.manoeuvres, quick=quick, whitened=part) for part in (stored, None))
        np.testing.assert_allclose(known.corrected, anew.corrected, rtol=1e-9)
    assert unexplained_channels(current, search.manoeuvres, whitened=stored) == unexplained_channels(
        current, search.manoeuvres
    )
    assert search.stored_whitened(replace(current)) is None


def test_without_a_report_a_gain_is_the_statistic_of_wald(search: StructureSearch) -> None:
    unreported = searched(replace(search.settings, reported=False))
    current, _ = forward_selection(unreported, unreported.declared)
    uncertainty = deviations(current, unreported.manoeuvres)
    findings = findings_with_p_values(unreported, current, uncertainty)
    assert {(each.where, each.term) for each in findings} == set(BOTH_SQUARES)
    assert not current.reduced  # nothing was re-estimated without them
    for each in findings:
        assert each.entry is not None
        error = uncertainty.white[current.free.index(each.entry)]
        assert each.gain == pytest.approx((each.value / error) ** 2)
