"""Sensitivities to effects' parameters against all records' residuals, and fits that start from another's columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import frames_of
from numpy.testing import assert_allclose, assert_array_equal

from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_lag
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import frozen
from aerosid.effects.step_change import step_change
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import (
    CLOSE,
    Estimate,
    effect_sensitivities,
    estimate,
    linear_values,
    maximise_likelihood,
)
from aerosid.equation_error.regression.least_squares import solve
from aerosid.equation_error.regression.parameter_limits import free_parameters
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    deletions,
    first_order_loss,
)
from aerosid.equation_error.selection.wald_tests import distances_from_null
from aerosid.flight_model.terms import parse_term
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 7_900
"""Of tests; published tables and trials begin elsewhere."""

BODY = BODIES[0]
LAG = 0.12


@pytest.fixture(scope="module")
def two_records() -> tuple[RegressionProblem, Estimate]:
    """Both records of an aircraft whose C_m lacks a term, regressed with a lag and a step of each record's own."""
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(SEEDS))
    wrong = Wrong(terms={("C_m", "alpha^2"): -2.0}, elevator_delay=LAG)
    logs = [flown(name, BODY, SEEDS + n, air=0.2, wrong=wrong, seconds=20.0) for n, name in enumerate("ab")]
    model, whole, _ = frames_of(aircraft, logs[:1], logs[1:], [])
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives)
    steps = [
        ActiveEffect(step_change(name, moment, 0.04), (size, moment), log)
        for name, moment, size, log in (("C_m", 8.0, 2e-3, "a"), ("C_X", 11.0, -3e-3, "b"))
    ]
    lag = ActiveEffect(control_lag("delta_e"), (0.05,))
    return whole, estimate(whole, Point(model, free, ()).with_effects((*steps, lag)))


def test_the_parameters_of_an_effect_on_one_record_leave_the_others_unchanged(
    two_records: tuple[RegressionProblem, Estimate],
) -> None:
    problem, found = two_records
    known = linear_values(found.design, found.solution)
    parameters = free_parameters(found.point.effects)
    here = problem.residuals(found.point, known)
    columns = effect_sensitivities(problem, known, found.point, parameters)
    for column, (index, number) in zip(columns.T, parameters, strict=True):
        active = found.point.effects[index]
        moved = active.perturbed(number, active.effect.parameters[number].step)
        effects = (*found.point.effects[:index], moved, *found.point.effects[index + 1 :])
        whole = problem.residuals(replace(found.point, effects=effects), known)
        assert_array_equal(column, (here - whole) / (moved.values[number] - active.values[number]))
        own = {found.problem.recordings[record].name for record, _ in found.design.segments}
        acting = {
            found.problem.recordings[record].name
            for s, (record, _) in enumerate(found.design.segments)
            if np.any(column[found.design.rows(s)] != 0.0)
        }
        assert acting == ({active.log} if active.log else own)


@pytest.mark.parametrize("start", [0.02, 0.3])
def test_a_fit_that_starts_from_the_columns_of_a_reduced_structure_reaches_the_same_optimum(
    two_records: tuple[RegressionProblem, Estimate], start: float
) -> None:
    problem, found = two_records
    reduced = estimate(problem, found.point.with_effects(found.point.effects[:2]), found.solution.weights)
    lag = Hypothesis("control_lag", "delta_e", effects=(ActiveEffect(control_lag("delta_e"), (start,)),))
    initial = with_hypothesis(reduced.point, lag)
    alone = maximise_likelihood(problem, initial, reduced.solution.weights, steps=12)
    near = maximise_likelihood(problem, initial, reduced.solution.weights, steps=12, near=reduced)
    assert near.log_likelihood == pytest.approx(alone.log_likelihood, abs=CLOSE)
    deviations = np.sqrt(np.diag(alone.estimate.solution.covariance))[-5:]
    expected = [value for active in alone.point.effects for value in active.values]
    values = [value for active in near.point.effects for value in active.values]
    assert np.all(np.abs(np.subtract(values, expected)) <= 0.1 * deviations)


def test_a_parameter_at_its_limit_is_held_and_the_others_are_estimated_given_it(
    two_records: tuple[RegressionProblem, Estimate],
) -> None:
    """The lag ends at .19 s: where it may not exceed .15 s, the optimum is that of a lag which is known to be .15 s."""
    problem, found = two_records
    effect = control_lag("delta_e")
    (parameter,) = effect.parameters
    limited = replace(effect, parameters=(replace(parameter, highest=0.15),))
    *steps, lag = found.point.effects
    assert lag.values[0] > 0.16
    held = estimate(problem, found.point.with_effects((*steps, ActiveEffect(limited, (0.05,)))), steps=12)
    given = estimate(
        problem, found.point.with_effects((*steps, frozen(ActiveEffect(effect, (0.15,))))), held.solution.weights
    )
    assert held.point.effects[-1].values == (0.15,)
    assert held.log_likelihood == pytest.approx(given.log_likelihood, abs=CLOSE)
    # What the regression predicts of it is what can be reached, and the others' deviations are those with it known.
    assert solve(held.design, held.solution.weights).log_likelihood == pytest.approx(held.log_likelihood, abs=CLOSE)
    deviations, expected = (np.sqrt(np.diag(each.solution.covariance)) for each in (held, given))
    assert deviations[-1] == 0.0
    assert_allclose(deviations[:-1], expected, rtol=1e-2)
    assert distances_from_null(held, Hypothesis("control_lag", "delta_e", effects=(lag,))) == []


def test_the_loss_to_first_order_is_that_of_a_separate_estimate_where_an_effect_is_linear(
    two_records: tuple[RegressionProblem, Estimate],
) -> None:
    problem, found = two_records
    square = ("C_m", parse_term("alpha^2"))
    whole = estimate(problem, with_hypothesis(found.point, Hypothesis("aero_term", "C_m", "alpha^2", (square,))))
    hypotheses = [
        Hypothesis("aero_term", "C_m", "alpha^2", (square,)),
        *(Hypothesis(active.effect.kind, active.effect.where, effects=(active,)) for active in whole.point.effects),
    ]
    chosen = [SelectedEffect(hypothesis, kinematic=False, gain=1.0) for hypothesis in hypotheses]
    selected = SelectedStructure(whole, tuple(chosen))
    losses = [first_order_loss(selected, each) for each in chosen]
    separate = [whole.gain_over(reduced) for reduced in deletions(selected, chosen)]
    # The term, and the steps of a size that no noise makes; a lag of .1 s is not linear, and clearly necessary.
    assert losses[:3] == pytest.approx(separate[:3], rel=0.1, abs=1.0)
    assert separate[0] > 20.0
    assert min(losses[3], separate[3]) > 100.0
