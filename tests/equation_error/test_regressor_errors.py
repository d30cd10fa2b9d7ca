"""Least squares against instrumental variables: an oracle, false alarms, and attenuation by a noisy rate gyro."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import declared
from scipy.stats import binom

from aerosid.equation_error.equations.instrumental_variables import instrumental_variables
from aerosid.equation_error.regression.coloured_regression import colour_of
from aerosid.equation_error.regression.design import Weights
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.least_squares import solve
from aerosid.equation_error.regression.related_problems import as_compared
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.cross_validation import fits_of
from aerosid.equation_error.selection.regressor_errors import (
    ComparedDerivative,
    RegressorErrors,
    regressor_errors,
    with_instrumental_values,
    with_regressor_errors,
    with_values,
)
from aerosid.flight_model.terms import parse_term
from benchmarks.planted_aircraft import Body
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SEEDS = 7870
"""Of tests; published tables and trials begin elsewhere."""

DAMPED = replace(BODIES[3], C_m=(BODIES[3].C_m[0], BODIES[3].C_m[1], -60.0, -2.0))
"""Moments by rate, angle and elevator that nearly cancel, as of a heavily damped aircraft."""

DAMPING = ("term", ("C_m", parse_term("q_hat")))


def estimated(body: Body, seed: int, noise: float = 0.0, air: float = 0.2) -> Estimate:
    """The declared structure's estimate, with noise of this deviation, rad/s, in the pitch rate."""
    logs = []
    for k, name in enumerate("ab"):
        log = flown(name, body, SEEDS + 10 * seed + k, air=air, seconds=24.0)
        added = noise * np.random.default_rng([seed, k]).standard_normal(log.time.size)
        logs.append(replace(log, channels={**log.channels, "q": log["q"] + added}))
    return declared(aircraft_of(body, 0.08, np.random.default_rng(SEEDS + seed)), logs[:1], logs[1:])


def reported_always(found: Estimate) -> Estimate:
    """The estimate with settings by which every difference is reported."""
    settings = replace(found.problem.settings, regressor_false_alarm=1.1)
    return replace(found, problem=replace(found.problem, settings=settings))


def test_it_is_two_stage_least_squares_where_the_residuals_are_white() -> None:
    found = estimated(BODIES[0], 5)
    weights = Weights((colour_of(np.ones(1)),) * len(found.design.segments), found.solution.weights.sizes)
    white = reported_always(replace(found, solution=solve(found.design, weights)))
    (row,) = (row for row in regressor_errors(white, ()) if row.coefficient == "C_m")
    # The moment's rows and instruments as the module describes them, solved densely.
    settings = replace(found.problem.settings, laguerre_order=found.problem.settings.regressor_order)
    (basis, *_) = instrumental_variables(found.problem.recordings, settings)
    place = next(s for s, (index, name) in enumerate(found.design.segments) if (index, name) == (0, "C_m"))
    rows = found.design.rows(place)
    own = [p for p, unknown in enumerate(found.design.unknowns) if np.any(found.design.columns[rows, p])]
    regressors, target = found.design.columns[rows][:, own], found.design.target[rows]
    exogenous = [n for n, p in enumerate(own) if p != found.design.unknowns.index(DAMPING)]
    exogenous = [n for n in exogenous if "alpha" not in str(found.design.unknowns[own[n]][1])]
    instruments = np.column_stack([basis, regressors[:, exogenous]])
    projection = instruments @ np.linalg.pinv(instruments)
    expected = np.linalg.lstsq(projection @ regressors, target, rcond=None)[0]
    for each in row.derivatives:
        assert each.instrumental == pytest.approx(
            expected[own.index(found.design.unknowns.index(each.unknown))], rel=1e-5
        )


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_noisy_gyro_attenuates_the_damping_less_by_instrumental_variables(seed: int) -> None:
    found = reported_always(estimated(DAMPED, seed, noise=0.01))
    (row,) = (row for row in regressor_errors(found, ()) if row.coefficient == "C_m")
    rate = next(each for each in row.derivatives if each.unknown == DAMPING)
    assert rate.value > -55.0
    assert rate.instrumental < rate.value - 5.0
    assert abs(rate.instrumental + 60.0) < 4.0 * rate.std_error


def test_false_alarms_are_as_rare_as_stated() -> None:
    """Eight aircraft in gusts, three coefficients each: fewer alarms than the stated rate has once in a thousand."""
    alarms = sum(len(regressor_errors(estimated(body, 40, air=0.6), ())) for body in BODIES)
    assert alarms <= binom.ppf(0.999, 3 * len(BODIES), 0.05)


def test_standard_errors_contain_the_difference_unless_the_others_are_reported() -> None:
    found = estimated(BODIES[0], 6)
    covariance = corrected_covariance(found.design, found.solution)
    place = found.design.unknowns.index(DAMPING)
    value = float(found.solution.values[place])
    derivative = ComparedDerivative(DAMPING, value, value - 3.0, 0.7)
    row = RegressorErrors("C_m", 0.001, 0.8, (derivative,), {})
    widened = with_regressor_errors(covariance, found, [row])
    assert widened[place, place] == pytest.approx(covariance[place, place] + 0.8 * 9.0)
    instead = with_regressor_errors(2.0 * covariance, found, [replace(row, adopted=True)])
    assert instead[place, place] == pytest.approx(0.7**2 + covariance[place, place])
    assert np.linalg.eigvalsh(instead)[0] > -1e-12 * np.linalg.eigvalsh(instead)[-1]


def test_what_predicts_the_other_record_worse_is_not_reported_in_place_of_least_squares() -> None:
    tested = []
    for seed in range(3):
        found = reported_always(estimated(DAMPED, seed, noise=0.01))
        settings = replace(found.problem.settings, regressor_doubt=1.1)
        found = replace(found, problem=replace(found.problem, settings=settings))
        compared = as_compared(found.problem)
        for row in regressor_errors(found, ()):
            moved = with_values(found, row.values)
            fits = zip(fits_of(compared, found), fits_of(compared, moved), strict=True)
            (gain,) = (b.r2 - a.r2 for a, b in fits if a.coefficient == row.coefficient and not a.fitted)
            assert row.adopted is (gain > -settings.least_rise)
            tested.append(row.adopted)
    assert set(tested) == {True, False}


def test_an_estimate_with_instrumental_values_has_them_in_its_model_too() -> None:
    found = estimated(BODIES[0], 7)
    moved = with_instrumental_values(found, {"C_m"})
    entry = DAMPING[1]
    assert moved.solution.values[moved.design.unknowns.index(DAMPING)] == moved.point.model.value(entry)  # type: ignore[arg-type]
    assert moved.point.model.value(entry) != found.point.model.value(entry)  # type: ignore[arg-type]
    assert with_instrumental_values(found, set()) is found


def test_a_coefficient_of_controls_alone_is_the_same_by_both() -> None:
    """Its regressors are instruments themselves: there is no difference to compare with chance."""
    found = reported_always(estimated(BODIES[0], 8))
    kept = [u for u in found.design.unknowns if u[0] != "term" or u[1][0] != "C_m" or "delta_e" in str(u[1][1])]  # type: ignore[index]
    design = found.design.without([u for u in found.design.unknowns if u not in kept])
    alone = replace(found, design=design, solution=solve(design, found.solution.weights))
    assert "C_m" not in {row.coefficient for row in regressor_errors(alone, ())}
