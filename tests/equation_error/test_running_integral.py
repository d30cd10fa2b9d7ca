"""Running integral and derivative: exact on cubics, of the order declared."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from aerosid.equation_error.equations.running_integral import derivative, linear_as_differentiated, running_integral

NUMBERS = st.floats(-10.0, 10.0)


@given(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), st.integers(4, 40))
def test_the_integral_of_a_cubic_is_exact(coefficients: tuple[float, ...], samples: int) -> None:
    cubic = np.polynomial.Polynomial(coefficients)
    time = 0.1 * np.arange(samples)
    np.testing.assert_allclose(running_integral(cubic(time), 0.1), cubic.integ()(time), atol=1e-9)


def test_the_error_falls_with_the_fourth_power_of_the_interval() -> None:
    errors = []
    for samples in (101, 201, 401):
        time = np.linspace(0.0, 10.0, samples)
        found = running_integral(np.cos(3.0 * time), float(time[1]))
        errors.append(float(np.abs(found - np.sin(3.0 * time) / 3.0).max()))
    slopes = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(slopes > 3.6)


def test_derivative_and_integral_undo_each_other_in_the_band() -> None:
    time = 0.04 * np.arange(500)
    signal = np.sin(2.0 * np.pi * 1.5 * time)
    back = derivative(running_integral(signal, 0.04), 0.04)
    assert back[5:-5] == pytest.approx(signal[5:-5], abs=3e-3)


@given(st.integers(4, 60), st.integers(0, 20), st.floats(0.01, 2.0))
def test_the_derivative_is_that_of_the_interpolating_cubic_spline(samples: int, seed: int, interval: float) -> None:
    values = np.random.default_rng(seed).normal(size=samples)
    time = interval * np.arange(samples)
    expected = CubicSpline(time, values, bc_type="not-a-knot")(time, 1)
    np.testing.assert_allclose(derivative(values, interval), expected, atol=1e-9 / interval)


def test_the_derivative_of_an_integrated_polyline_is_attenuated_as_stated() -> None:
    """The exact integral of straight lines between random samples, differentiated by the spline through it."""
    polyline = np.random.default_rng(3).standard_normal((80, 2))
    integral = np.concatenate([np.zeros((1, 2)), np.cumsum(0.04 * 0.5 * (polyline[1:] + polyline[:-1]), axis=0)])
    shown = np.column_stack([derivative(column, 0.04) for column in integral.T])
    np.testing.assert_allclose(linear_as_differentiated(polyline)[12:-12], shown[12:-12], atol=1e-5)
    assert np.abs(shown - polyline)[12:-12].max() > 0.3
