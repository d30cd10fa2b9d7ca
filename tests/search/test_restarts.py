"""Restarts at a gross residual: profile likelihood of a control effect, no restart of a term far behind."""

from dataclasses import replace

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import questioned
from problems import BOTH_SQUARES, LIGHT, Problem, entry

from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.competing_fits import evaluated_starts, fit_competing_structures
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.maximum_likelihood import Start, refine
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.restarts import profile_starts, restart_candidates
from aerosid.search.settings import AttributionSettings
from aerosid.search.shortlist_fits import fits_of
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import shortlisted


@pytest.mark.parametrize("followed", [AttributionSettings().trials.profile_followed, 10])
def test_the_profile_start_of_a_large_lag_is_near_its_true_value(followed: int) -> None:
    late = {"delta_a": lambda time, given: np.interp(time - 0.4, time, given)}
    log = commuter.Lateral(seed=31, surfaces=late, duration=12.0).log()
    aircraft = commuter.aircraft(commuter.SIDE)
    model, manoeuvre = questioned(aircraft, log)
    free = [(d.coefficient, d.term) for d in aircraft.derivatives]
    declared = refine(model, [manoeuvre], free, settings=TRIAL)
    offered: tuple[Hypothesis, ...] = effect_hypotheses(model, [manoeuvre])
    delays = [each for each in offered if each.label == ("control_delay", "delta_a", "")]
    usual = AttributionSettings()
    settings = replace(usual, trials=replace(usual.trials, profile_followed=followed))
    search = StructureSearch((manoeuvre,), tuple(delays), (), declared, settings, model)
    (start,) = profile_starts(search, declared, delays, np.inf)
    (active,) = start.effects
    assert active.values[0] == pytest.approx(0.4, rel=0.5)


def test_the_predicted_cost_of_a_start_is_that_of_a_full_step_of_its_linearisation() -> None:
    model, manoeuvre = Problem().prepared(Problem().fly())
    free = tuple(model.entries)
    (known,) = evaluated_starts([Start(model, free)], [manoeuvre])
    assert known.start.point is not None
    point = known.start.point
    likelihood = Likelihood(model, (manoeuvre,), free)
    at = likelihood.starting_variance()
    plain = likelihood.evaluate(model.values, (manoeuvre.first_state,), (), at)
    assert plain is not None
    assert point.cost == plain.cost
    variance = point.maximum_likelihood_variance(likelihood.variance_floor)
    ratio = point.variance / variance
    normal = np.einsum("i,ijk->jk", ratio, point.normals)
    step = np.linalg.lstsq(normal, ratio @ point.gradients, rcond=1e-12)[0]
    left = [
        squares - 2.0 * g @ step + step @ n @ step
        for squares, g, n in zip(point.squares, point.gradients, point.normals, strict=True)
    ]
    shown = point.counts > 0.0
    predicted_cost = (
        np.sum(point.counts[shown] * np.log(np.array(left)[shown] / point.counts[shown])) + point.counts.sum()
    )
    assert known.predicted_cost - point.cost == pytest.approx(predicted_cost - point.squares.sum(), rel=1e-6)


def test_a_term_that_is_not_restarted_would_not_win_from_the_declared_values() -> None:
    model, manoeuvre = Problem(undeclared=BOTH_SQUARES).prepared(Problem(undeclared=BOTH_SQUARES).fly())
    fitted = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    terms = [entry("C_m", text) for text in ("alpha^2", "alpha^3", "alpha*q_hat", "alpha*delta_e")]
    offered = term_hypotheses(terms) + effect_hypotheses(model, [manoeuvre], LIGHT.coefficients)
    search = StructureSearch((manoeuvre,), offered, LIGHT.coefficients, fitted, AttributionSettings(), model)
    shortlist = shortlisted(search, search.scores(fitted))
    fits = fits_of(search, fitted, shortlist)
    level = min(search.penalised_cost(each.fit) for each in fits)
    again = [score for score, _ in restart_candidates(search, fitted, fits, level)]
    assert {score.hypothesis.label for score in shortlist if score.hypothesis.effects} <= {
        s.hypothesis.label for s in again
    }
    assert ("aero_term", "C_m", "alpha^2") in {score.hypothesis.label for score in again}
    left = [score.hypothesis.entries for score in shortlist if score not in again]
    assert left
    for entries in left:
        anew = refine(model.extended(entries), [manoeuvre], [*model.entries, *entries])
        assert search.penalised_cost(anew) > level


def test_a_start_that_cannot_be_simulated_loses_at_infinite_cost() -> None:
    model, manoeuvre = Problem().prepared(Problem().fly())
    free = tuple((d.coefficient, d.term) for d in LIGHT.derivatives)
    wild = model.values.copy()
    wild[model.index(entry("C_m", "alpha"))] = 1e3
    starts = [Start(model.with_values(wild), free), Start(model, free)]
    lost, sound = evaluated_starts(starts, [manoeuvre])
    assert lost.predicted_cost == np.inf
    assert lost.start.point is None
    assert np.isfinite(sound.predicted_cost)
    for level in (None, np.inf):  # together and each alone
        lost, found = fit_competing_structures(starts, [manoeuvre], TRIAL, [0.0, 0.0], level)
        assert lost.cost == np.inf
        assert not lost.converged
        assert found.converged
        assert found.cost == refine(model, [manoeuvre], free, settings=TRIAL).cost


def test_a_control_effect_without_any_simulated_start_has_no_fit() -> None:
    model, manoeuvre = Problem().prepared(Problem().fly())
    free = tuple((d.coefficient, d.term) for d in LIGHT.derivatives)
    delays = [each for each in effect_hypotheses(model, [manoeuvre]) if each.label == ("control_delay", "delta_e", "")]
    declared = refine(model, [manoeuvre], free, settings=TRIAL)
    search = StructureSearch((manoeuvre,), tuple(delays), (), declared, AttributionSettings(), model)
    wild = declared.model.values.copy()
    wild[declared.model.index(entry("C_m", "alpha"))] = 1e3
    assert profile_starts(search, replace(declared, model=declared.model.with_values(wild)), delays, np.inf) == []


def test_a_start_that_only_a_continuation_reaches_has_no_likelihood_of_its_own() -> None:
    """An unstable aircraft diverges in open loop; continued from the data it would have other derivatives."""
    model, manoeuvre = Problem(duration=20.0).prepared(Problem(duration=20.0).fly())
    free = tuple((d.coefficient, d.term) for d in LIGHT.derivatives)
    unstable = model.values.copy()
    unstable[model.index(entry("C_m", "alpha"))] = 2.0
    start = Start(model.with_values(unstable), free)
    (evaluated,) = evaluated_starts([start], [manoeuvre])
    assert evaluated.predicted_cost == np.inf
    assert evaluated.start.point is None
    (fitted,) = fit_competing_structures([start], [manoeuvre], TRIAL, [0.0])
    assert np.isfinite(fitted.cost)
