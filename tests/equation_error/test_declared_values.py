"""A-priori values as evidence: closed forms, a dense oracle, and flights that need or must not need them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, identified
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.declared_values import FACTORS, DeclaredUnknowns, DeclaredValues
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.terms import parse_term
from benchmarks.turbulent_flights import BODIES, NOTHING, aircraft_of, flown

SEEDS = 640_000
"""Of these flights; thresholds were chosen on others."""


def of(estimates: list[float], variance: float = 1e-12, deviation: float = 1.0, misjudged: float = 0.35) -> float:
    count = len(estimates)
    declared = DeclaredUnknowns(np.arange(count), np.zeros(count), np.full(count, deviation), 2.0, misjudged)
    return declared.disagreement(np.array(estimates), variance * np.eye(count))


def test_one_derivative_disagrees_quadratically_and_then_linearly() -> None:
    sure = 0.001  # of the standard deviations, so that their factor is one
    assert_allclose(of([1.5], misjudged=sure), 0.5 * 1.5**2, rtol=1e-9)
    assert_allclose(of([2.5], misjudged=sure), 2.0 * (2.5 - 1.0), rtol=1e-9)
    # Of the standard deviations of both values the variances add.
    assert_allclose(of([3.0], variance=3.0, misjudged=sure), 0.5 * 1.5**2)
    # What the records do not determine, whose variance is left at zero, does not disagree.
    assert of([50.0], variance=0.0) == 0.0


@given(st.lists(st.floats(-40.0, 40.0), min_size=1, max_size=12), st.floats(0.05, 20.0), st.floats(1e-6, 4.0))
def test_the_common_factor_is_the_likeliest(estimates: list[float], deviation: float, variance: float) -> None:
    """A dense minimisation of the normal and Laplace densities, written from the definition."""

    def loss(log_factor: float) -> float:
        total = 0.5 * (log_factor / 0.35) ** 2
        for value in estimates:
            wide = np.sqrt((np.exp(log_factor) * deviation) ** 2 + variance)
            distance = abs(value) / wide
            total += 0.5 * distance**2 if distance < 2.0 else 2.0 * distance - 2.0
            total += np.log(wide) - 0.5 * np.log(deviation**2 + variance)
        return float(total)

    found = of(estimates, variance, deviation)
    assert_allclose(found, min(loss(each) for each in np.log(FACTORS)), rtol=1e-9, atol=1e-9)
    # A quarter of an octave is fine enough: a dense minimum is lower by less than a hypothesis is penalised by far.
    dense = min(loss(each) for each in np.linspace(0.0, np.log(FACTORS[-1]), 400))
    assert found <= 1.02 * dense + 0.3


def test_a_file_that_is_wrong_throughout_prefers_little() -> None:
    """Ten derivatives eight standard deviations off: an effect that mends a tenth of each gains little."""
    together = of([8.0] * 10) - of([7.2] * 10)
    assert 0.0 < together < 3.0
    # One derivative off among ten that agree keeps its weight.
    alone = of([8.0] + [0.7] * 9) - of([1.0] + [0.7] * 9)
    assert alone > 8.0


def coefficients_of_two_flights() -> tuple[RegressionProblem, Point, Entry, float]:
    """The coefficient equations and the declared structure, one of its derivatives and that as flown."""
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    logs = [flown(name, body, SEEDS + n, air=0.5) for n, name in enumerate(("one", "two"))]
    errors = identified(aircraft, logs[:1], logs[1:])
    found = errors.selected.estimate
    problem = RegressionProblem(found.problem.recordings, COEFFICIENT, found.problem.settings, all_fitted=True)
    return problem, replace(errors.start, effects=()), ("C_m", parse_term("alpha")), body.terms["C_m", "alpha"]


def test_the_estimates_are_those_of_the_records_alone() -> None:
    plain, point, key, truth = coefficients_of_two_flights()
    far = DeclaredValues({key: (3.0 * truth, 0.05 * abs(truth))}, 2.0, 0.35)
    alone = estimate(plain, point)
    beside = estimate(replace(plain, declared=far), point)
    assert np.array_equal(alone.solution.values, beside.solution.values)
    assert np.array_equal(alone.solution.covariance, beside.solution.covariance)
    known = far.among(beside.design.unknowns)
    assert known is not None
    lost = known.disagreement(beside.solution.values, beside.solution.covariance)
    assert lost > 5.0
    assert_allclose(alone.log_likelihood - beside.log_likelihood, lost)


def test_informed_estimates_are_those_of_rows_added_to_the_regression() -> None:
    plain, point, key, truth = coefficients_of_two_flights()
    value, deviation = 1.2 * truth, 0.02 * abs(truth)
    known = DeclaredValues({key: (value, deviation)}, 2.0, 0.35, inform=True)
    informed = estimate(replace(plain, declared=known), point)
    solution, design = informed.solution, informed.design
    place = design.unknowns.index(("term", key))
    rows = np.vstack(
        [solution.slopes, np.diag(design.inverse_deviations), np.eye(len(design.unknowns))[[place]] / deviation]
    )
    target = np.concatenate([solution.whitened + solution.slopes @ solution.values, 0.0 * design.inverse_deviations])
    expected = np.linalg.lstsq(rows, np.append(target, value / deviation), rcond=None)[0]
    error = np.sqrt(np.diag(solution.covariance))
    assert_allclose((solution.values - expected) / error, 0.0, atol=1e-5)
    declared = known.among(design.unknowns)
    assert declared is not None
    lost = declared.disagreement(solution.values, solution.covariance)
    assert_allclose(lost, 0.5 * ((solution.values[place] - value) / deviation) ** 2)
    alone = estimate(plain, informed.point).solution
    ends = sorted((alone.values[place], value))
    assert ends[0] < solution.values[place] < ends[1]


@pytest.mark.parametrize("n", [0, 1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 3))])
def test_a_file_too_sure_of_wrong_values_names_nothing(n: int) -> None:
    """Every derivative 8 % off at random (as flown), and declared to one or two per cent: nothing is missing."""
    generator = np.random.default_rng([SEEDS, n])
    body = BODIES[n % len(BODIES)]
    aircraft = aircraft_of(body, 0.16, generator)
    sure = tuple(
        replace(d, sigma=float(generator.uniform(0.01, 0.02)) * abs(d.value)) if d.term.factors else d
        for d in aircraft.derivatives
    )
    logs = [
        flown(name, body, SEEDS + 100 + 10 * n + i, air=0.6, wrong=NOTHING, seconds=30.0)
        for i, name in enumerate(("one", "two"))
    ]
    assert not decided(replace(aircraft, derivatives=sure), logs[:1], logs[1:]).findings
