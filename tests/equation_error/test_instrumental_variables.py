"""Instrumental variables against the textbook formula, and on a residual correlated with its own regressors."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from aerosid.equation_error.equations.instrumental_variables import laguerre_functions
from aerosid.equation_error.regression.coloured_regression import colour_of
from aerosid.equation_error.regression.design import Design, Weights
from aerosid.equation_error.regression.gain import gain_over
from aerosid.equation_error.regression.least_squares import Solution, regress, solve
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]

SAMPLES = 4000


def solved(target: Array, columns: Array, instruments: Array | None, size: float = 1.0) -> Solution:
    design = design_over(target, columns, instruments)
    return solve(design, Weights((colour_of(np.ones(1)),), np.array([size])))


def design_over(target: Array, columns: Array, instruments: Array | None) -> Design:
    return Design(
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


def test_laguerre_functions_are_orthonormal_up_to_a_factor() -> None:
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
def test_a_correlated_regressor_biases_least_squares_but_not_instrumental_variables(seed: int) -> None:
    generator = np.random.default_rng(seed)
    control = np.repeat(generator.choice([-1.0, 1.0], SAMPLES // 20), 20)
    gust = lfilter([1.0], [1.0, -0.7], 0.5 * generator.standard_normal(SAMPLES))
    motion = lfilter([0.2], [1.0, -0.8], control + gust)
    target = 2.0 * motion + gust
    plain = solved(target, motion[:, None], None, float(np.std(gust)))
    found = solved(target, motion[:, None], laguerre_functions(control, 0.1, 0.3, 6), float(np.std(gust)))
    # The colour of the gust increases the standard error of white innovations at most by sqrt((1 + .7)/(1 - .7)).
    wide = np.sqrt(1.7 / 0.3)
    assert abs(plain.values[0] - 2.0) > 6.0 * wide * np.sqrt(plain.covariance[0, 0])
    assert abs(found.values[0] - 2.0) < 4.0 * wide * np.sqrt(found.covariance[0, 0])


def test_the_gain_integrates_out_the_noise_size() -> None:
    generator = np.random.default_rng(6)
    instruments = generator.standard_normal((80, 9))
    columns = instruments @ generator.standard_normal((9, 2))
    target = columns @ np.array([0.3, 0.4]) + generator.standard_normal(80)
    settings = EquationErrorSettings(usual_excess=1.7, usual_freedom=12.0)
    wide, narrow = (design_over(target, x, instruments) for x in (columns, columns[:, :1]))
    found = regress(wide, settings)
    power = {}
    for name, x in (("wide", columns), ("narrow", columns[:, :1])):
        white = found.weights.colours[0].whitened(np.column_stack([target, x, instruments]))
        basis = np.linalg.qr(white[:, 1 + x.shape[1] :])[0]
        along = basis.T @ white[:, : 1 + x.shape[1]]
        left = along[:, 0] - along[:, 1:] @ np.linalg.lstsq(along[:, 1:], along[:, 0], rcond=None)[0]
        power[name] = float(left @ left)
    # A scaled inverse chi squared prior integrated out: Student's t of nine degrees of freedom less three for trends.
    size = found.weights.sizes[0] ** 2 / found.weights.excess["alpha", 0.1]
    known = 12.0 * 1.7 * size
    expected = 0.5 * (6 + 12) * np.log((power["narrow"] + known) / (power["wide"] + known))
    gain = gain_over(narrow, 0.0, found, settings)
    assert gain == pytest.approx(expected, rel=1e-9)
    assert gain > 1.0
