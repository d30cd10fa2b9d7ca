"""Fits started from another estimate's linearisation converge to the same estimate as independent fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import BOTH_SQUARES, LIGHT, Problem, entry

from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.maximum_likelihood import Refinement, refine, refine_on
from aerosid.estimation.score_test import Linearised
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch

USUAL = AttributionSettings()

SQUARES = tuple(entry(*key) for key in BOTH_SQUARES)


@pytest.fixture(scope="module")
def search() -> tuple[StructureSearch, Refinement]:
    """A search over all hypotheses, and the estimate with both squares."""
    model, manoeuvre = Problem(undeclared=BOTH_SQUARES).prepared(Problem(undeclared=BOTH_SQUARES).fly())
    before = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    further = (entry("C_Z", "alpha^2"), entry("C_m", "alpha^3"))
    hypotheses = term_hypotheses((*SQUARES, *further)) + effect_hypotheses(model, [manoeuvre], LIGHT.coefficients)
    found = StructureSearch((manoeuvre,), hypotheses, LIGHT.coefficients, before, USUAL)
    return found, refine(model.extended(SQUARES), [manoeuvre], (*model.entries, *SQUARES))


@pytest.mark.parametrize("known", [False, True])
def test_re_estimation_without_a_term_equals_an_independent_estimate(
    search: tuple[StructureSearch, Refinement], known: bool
) -> None:
    """Also where the linearisation has the columns of step changes, which the estimate's model has not."""
    found, current = search[0], replace(search[1])  # none of whose parts was removed before
    found.reduced_fits.clear()
    if known:
        assert len(found.linearised_with_candidates(current).refinement.model.values) > len(current.model.values)
    part = next(part for part in found.parts(current, None) if part.entry == SQUARES[0])
    reduced = found.re_estimated_without(current, [part])
    model = current.model.without([SQUARES[0]])
    wanted = refine(model, found.manoeuvres, model.entries)
    assert reduced.converged
    # A wrong structure converges slowly along a flat valley; the remaining decrease must be insignificant.
    assert reduced.cost == pytest.approx(wanted.cost, abs=USUAL.reach)
    point = Likelihood(model, found.manoeuvres, model.entries).evaluate(
        reduced.model.values, reduced.states, (), reduced.variance
    )
    assert point is not None
    assert reduced.cost == pytest.approx(point.cost, abs=1.0)
    assert found.re_estimated_without(current, [part]) is reduced


def test_a_structure_that_converged_in_a_trial_is_not_fitted_again(
    search: tuple[StructureSearch, Refinement],
) -> None:
    found, current = search[0], replace(search[1])  # none of whose parts was removed before
    found.reduced_fits.clear()
    part = next(part for part in found.parts(current, None) if part.entry == SQUARES[0])
    again = found.re_estimated_without(current, [part])
    found.reduced_fits.clear()
    current = replace(current)
    model = found.declared.model.extended(SQUARES[1:])
    trial = refine(model, found.manoeuvres, (*found.declared.free, SQUARES[1]), settings=TRIAL)
    given_up = replace(trial, cost=trial.cost - 100.0, converged=False)
    found.store_trials([given_up, trial, replace(trial, cost=trial.cost + 1.0)])
    assert found.re_estimated_without(current, [part]) is trial
    assert trial.cost == pytest.approx(again.cost, abs=USUAL.reach)


def test_without_all_that_was_added_the_declared_structure_keeps_its_estimate(
    search: tuple[StructureSearch, Refinement],
) -> None:
    found, current = search
    assert found.declared.converged
    assert found.re_estimated_without(current, found.parts(current, None)) is found.declared
    # Not where that never converged, nor where it is another method's, or its cost has the part of a-priori estimates.
    for declared in (replace(found.declared, converged=False), replace(found.declared, is_maximum=False)):
        other = StructureSearch(found.manoeuvres, found.hypotheses, LIGHT.coefficients, declared, USUAL)
        assert other.re_estimated_without(replace(current), other.parts(current, None)) is not declared


def test_without_all_that_a_trial_added_the_estimate_that_it_was_added_to_is_kept(
    search: tuple[StructureSearch, Refinement],
) -> None:
    found = search[0]
    first, second = (found.parts(search[1], None)[n] for n in (0, 1))
    origin = refine(found.declared.model.extended(SQUARES[:1]), found.manoeuvres, (*found.declared.free, SQUARES[0]))
    for effects in ((), (next(h for h in found.hypotheses if h.kind == "control_lag").effects[0],)):
        trial, known = replace(search[1], effects=effects), replace(origin, effects=effects)
        assert known.converged
        assert found.re_estimated_without(trial, [second], known) is known
        # Not one of another structure or of other effects, nor one that did not converge.
        assert found.re_estimated_without(trial, [first], known) is not known
        assert found.re_estimated_without(trial, [second], replace(known, converged=False)) is not known
        assert found.re_estimated_without(search[1], [second], replace(origin, effects=())).effects == ()
    assert found.re_estimated_without(search[1], [second], known) is not known
    assert eliminate_insignificant(found, search[1], origin) is search[1]


def test_a_trial_continued_from_its_linearisation_converges_to_the_same_estimate(
    search: tuple[StructureSearch, Refinement],
) -> None:
    found, current = search
    trial = refine(current.model, found.manoeuvres, current.free, settings=TRIAL)
    found.linearised_with_candidates(trial)
    wanted = refine_on(trial, found.manoeuvres)
    ended = found.refined(trial)
    assert ended.cost == pytest.approx(wanted.cost, abs=1e-2)
    deviation = np.sqrt(np.diag(wanted.covariance))[: len(wanted.free)]
    places = wanted.model.indices(wanted.free)
    np.testing.assert_array_less(np.abs((ended.model.values - wanted.model.values)[places]) / deviation, 0.01)


def test_a_linearisation_with_a_term_is_the_likelihood_of_the_larger_structure(
    search: tuple[StructureSearch, Refinement],
) -> None:
    found, current = search
    (term,) = (entry("C_Z", "alpha^2"),)
    point = Linearised(current, found.manoeuvres, term_hypotheses((term,))).with_terms([term])
    model = current.model.extended([term])
    wanted = Likelihood(model, found.manoeuvres, (*current.free, term)).evaluate(
        model.values, current.states, (), current.variance
    )
    assert wanted is not None
    assert point.cost == pytest.approx(wanted.cost, rel=1e-12)
    for name in ("normals", "gradients", "squares", "counts"):
        np.testing.assert_allclose(getattr(point, name), getattr(wanted, name), rtol=1e-9, atol=1e-9)


def test_values_of_another_model_are_refused(search: tuple[StructureSearch, Refinement]) -> None:
    found, current = search
    likelihood = Likelihood(found.declared.model, found.manoeuvres, ())
    with pytest.raises(ValueError, match="values were given for"):
        likelihood.evaluate(current.model.values, current.states, (), current.variance)


def test_scores_computed_in_batches_equal_those_computed_at_once(search: tuple[StructureSearch, Refinement]) -> None:
    """Each batch simulates the own parameters again; the information between two hypotheses is never needed."""
    found, current = search
    candidates = found.candidate_hypotheses(current)
    at = found.with_candidate_columns(current, candidates)
    whole = Linearised(at, found.manoeuvres, candidates)
    samples = found.manoeuvres[0].flight.time.size
    parts = Linearised(at, found.manoeuvres, candidates, room=8 * samples * (whole.own.size + 20))
    effects = [active for hypothesis in candidates for active in hypothesis.effects]
    assert len(effects) > 100  # several batches
    for one, other in zip(whole.scores(), parts.scores(), strict=True):
        assert one.hypothesis == other.hypothesis
        assert other.gain == pytest.approx(one.gain, rel=1e-9, abs=1e-9)
    np.testing.assert_allclose(parts.normal, whole.normal, rtol=1e-9, atol=1e-9 * np.abs(whole.normal).max())
    # And with the information between all of them, which no score uses.
    model = at.model.extended([entry for hypothesis in candidates for entry in hypothesis.entries])
    chords = [chord for hypothesis, _, trial in whole.asked for chord in (hypothesis.by_chord(trial),)]
    free = (*at.free, *(entry for entry in whole.place))
    tested = [active for chord in chords for active in chord.effects]
    dense = Likelihood(model, found.manoeuvres, free)
    together, gradient = np.zeros_like(whole.normal), np.zeros_like(whole.gradient)
    for part in dense.stretches(model.values, at.states, at.effects, at.variance, tested):
        together += np.einsum("nmi,nmj->ij", part.columns, part.columns, optimize=True)
        gradient += np.einsum("nm,nmi->i", np.nan_to_num(part.residual), part.columns)
    np.testing.assert_allclose(whole.normal[whole.own], together[whole.own], rtol=1e-9, atol=1e-6)
    for _, columns, _ in whole.asked:
        inside = np.ix_(columns, columns)
        np.testing.assert_allclose(whole.normal[inside], together[inside], rtol=1e-9)
    np.testing.assert_allclose(whole.gradient, gradient, rtol=1e-9, atol=1e-6)


def test_variance_inflation_of_coloured_residuals_raises_the_gain_that_a_parameter_needs(
    search: tuple[StructureSearch, Refinement],
) -> None:
    """The penalty is eight: a decrease of twenty exceeds it for white residuals, not where the inflation is four."""
    found, current = search
    larger = replace(current, free=(*current.free, entry("C_Z", "alpha^2")), cost=current.cost - 20.0)
    assert found.penalised_cost(larger, 1.0) == found.penalised_cost(larger) < found.penalised_cost(current)
    assert found.penalised_cost(larger, 4.0) > found.penalised_cost(current, 4.0)
    # Structures of equal penalty are ranked by their likelihood, whatever the inflation.
    likelier = replace(current, cost=current.cost - 1.0)
    assert found.penalised_cost(likelier, 4.0) < found.penalised_cost(current, 4.0)


def test_the_score_of_several_parameters_is_their_additional_decrease_of_the_cost(
    search: tuple[StructureSearch, Refinement],
) -> None:
    found, current = search
    candidates = found.candidate_hypotheses(current)
    about = Linearised(found.with_candidate_columns(current, candidates), found.manoeuvres, candidates)

    def fall(places: list[int]) -> float:
        scale = np.sqrt(np.diag(about.normal)[places])
        scaled = about.normal[np.ix_(places, places)] / np.outer(scale, scale)
        return float(about.gradient[places] / scale @ np.linalg.solve(scaled, about.gradient[places] / scale))

    present = about.present.tolist()
    columns = {(id(hypothesis), trial): places for hypothesis, places, trial in about.asked}
    several = [score for score in about.scores() if score.hypothesis.parameters > 1 and score.independence > 1e-3]
    assert several
    for score in several:
        wanted = fall(present + columns[id(score.hypothesis), score.trial]) - fall(present)
        assert score.gain == pytest.approx(wanted, rel=1e-6, abs=1e-6)
