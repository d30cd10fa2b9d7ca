"""Least squares with parameters at their limits, against a dense solver of bounded least squares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import lsq_linear

from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_lag
from aerosid.effects.sensor import sensor_bias
from aerosid.equation_error.regression.design import Design, white_weights
from aerosid.equation_error.regression.least_squares import Solution, solve
from aerosid.equation_error.regression.parameter_limits import solved_within_limits

ROWS, TERMS, FAR = 60, 3, 1e3


def design_with(parameters: int, seed: int) -> Design:
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((ROWS, TERMS + parameters))
    columns[:, TERMS:] += columns[:, :1]  # what a held parameter leaves goes to the others
    return Design(
        segments=((0, "C_m"),),
        groups=(("C_m", 0.1),),
        bounds=np.array([0, ROWS]),
        target=columns @ rng.standard_normal(TERMS + parameters) + rng.standard_normal(ROWS),
        columns=columns,
        unknowns=(*(("term", n) for n in range(TERMS)), *(("effect", n, 0) for n in range(parameters))),
        inverse_deviations=np.zeros(TERMS + parameters),
        floors=np.zeros(1),
        instruments=(None,),
    )


def least_squares(design: Design) -> Solution:
    return solve(design, white_weights(design))


@pytest.mark.parametrize("seed", range(40))
def test_the_step_is_that_of_bounded_least_squares(seed: int) -> None:
    """One parameter at its lower limit and one far from any; both signs of the unbounded step occur."""
    design = design_with(2, seed)
    lag, bias = control_lag("delta_e"), sensor_bias("q", "rad/s", 1e-3)
    (of_lag,) = lag.parameters
    effects = (ActiveEffect(lag, (of_lag.lowest,)), ActiveEffect(bias, (0.0,)))
    lower, upper = np.full(TERMS + 2, -FAR), np.full(TERMS + 2, FAR)
    lower[TERMS] = 0.0
    expected = lsq_linear(design.columns, design.target, (lower, upper), method="bvls", tol=1e-14).x
    held, found = solved_within_limits(design, effects, least_squares)
    assert_allclose(found.values, expected, atol=1e-6)
    unbounded = np.linalg.lstsq(design.columns, design.target)[0]
    if unbounded[TERMS] < 0.0:
        assert found.values[TERMS] == 0.0
        assert found.covariance[TERMS, TERMS] == 0.0
        others = np.delete(np.arange(TERMS + 2), TERMS)
        dense = np.linalg.inv(design.columns[:, others].T @ design.columns[:, others])
        assert_allclose(found.covariance[np.ix_(others, others)], dense * found.weights.sizes[0] ** 2, rtol=1e-8)
    else:
        assert held is design


def test_a_step_away_from_a_limit_is_free() -> None:
    design = design_with(1, 3)
    (parameter,) = control_lag("delta_e").parameters
    lag = replace(control_lag("delta_e"), parameters=(replace(parameter, highest=1.0),))
    _, unbounded = solved_within_limits(design, [ActiveEffect(lag, (0.5,))], least_squares)
    at = 1.0 if unbounded.values[-1] < 0.0 else parameter.lowest
    held, found = solved_within_limits(design, [ActiveEffect(lag, (at,))], least_squares)
    assert held is design
    assert_allclose(found.values, unbounded.values)
