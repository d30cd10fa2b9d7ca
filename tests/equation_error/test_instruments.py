"""Instrumental variables against the textbook's formula, and on a residual that its own regressors follow."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from aerosid.equation_error.coloured_regression import colour_of
from aerosid.equation_error.design import Design, Solution, Weights, solve
from aerosid.equation_error.instruments import laguerre_functions

Array = NDArray[np.float64]

SAMPLES = 4000


def solved(target: Array, columns: Array, instruments: Array | None, size: float = 1.0) -> Solution:
    design = Design(
        ((0, "alpha"),),
        (("alpha", 0.1),),
        np.array([0, target.size]),
        target,
        columns,
        tuple(("term", n) for n in range(columns.shape[1])),
        np.zeros(columns.shape[1]),
        np.zeros(1),
        (instruments,),
    )
    return solve(design, Weights({("alpha", 0.1): colour_of(np.ones(1))}, np.array([size])))


def test_laguerre_functions_are_orthogonal_and_of_one_size() -> None:
    impulse = np.zeros(4000)
    impulse[0] = 1.0
    functions = laguerre_functions(impulse, 0.02, 0.3, 5)
    gram = functions.T @ functions
    np.testing.assert_allclose(gram, np.eye(5) * gram[0, 0], atol=1e-12 * gram[0, 0])


def test_values_are_those_of_two_stage_least_squares() -> None:
    generator = np.random.default_rng(4)
    instruments = generator.standard_normal((80, 6))
    columns = instruments[:, :2] + generator.standard_normal((80, 2))
    target = columns @ np.array([1.0, -2.0]) + generator.standard_normal(80)
    first = instruments @ np.linalg.solve(instruments.T @ instruments, instruments.T @ columns)
    second = np.linalg.solve(first.T @ columns, first.T @ target)
    found = solved(target, columns, instruments)
    np.testing.assert_allclose(found.values, second, rtol=1e-10)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(first.T @ first), rtol=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_a_regressor_that_follows_the_residual_misleads_least_squares_and_not_the_instruments(seed: int) -> None:
    generator = np.random.default_rng(seed)
    control = np.repeat(generator.choice([-1.0, 1.0], SAMPLES // 20), 20)
    gust = lfilter([1.0], [1.0, -0.7], 0.5 * generator.standard_normal(SAMPLES))
    motion = lfilter([0.2], [1.0, -0.8], control + gust)
    target = 2.0 * motion + gust
    plain = solved(target, motion[:, None], None, float(np.std(gust)))
    found = solved(target, motion[:, None], laguerre_functions(control, 0.1, 0.3, 6), float(np.std(gust)))
    # The colour of the gust widens the deviation of white innovations at most by sqrt((1 + .7)/(1 - .7)).
    wide = np.sqrt(1.7 / 0.3)
    assert abs(plain.values[0] - 2.0) > 6.0 * wide * np.sqrt(plain.covariance[0, 0])
    assert abs(found.values[0] - 2.0) < 4.0 * wide * np.sqrt(found.covariance[0, 0])
