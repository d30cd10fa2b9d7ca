"""Recursive least squares against dense solutions; measures of collinearity against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from aerosid.signals.least_squares import (
    RecursiveLeastSquares,
    condition_number,
    correlation,
    recursive_least_squares,
    variance_inflation,
)


def ordinary(regressors: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and unit-variance covariance by numpy's singular value decomposition on scaled columns."""
    scale = np.linalg.norm(regressors, axis=0)
    coefficients = np.linalg.lstsq(regressors / scale, target, rcond=None)[0] / scale
    inverse = np.linalg.pinv(regressors / scale, rcond=1e-15)
    return coefficients, inverse @ inverse.T / np.outer(scale, scale)


@settings(max_examples=60, deadline=None)
@example(count=6, samples=53, collinear=0.001, decades=0.0, seed=6)
@given(
    count=st.integers(1, 7),
    samples=st.integers(20, 60),
    collinear=st.floats(1e-3, 1.0),
    decades=st.floats(0.0, 6.0),
    seed=st.integers(0, 10**6),
)
def test_the_last_sample_is_ordinary_least_squares(
    count: int, samples: int, collinear: float, decades: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    regressors = rng.standard_normal((samples, count))
    regressors[:, -1] = regressors[:, 0] + collinear * regressors[:, -1]
    regressors *= 10.0 ** np.linspace(-decades / 2.0, decades / 2.0, count)
    truth = rng.uniform(1.0, 3.0, count) / np.linalg.norm(regressors, axis=0)
    target = regressors @ truth + 1e-3 * rng.standard_normal(samples)
    fit = recursive_least_squares(regressors, target)
    coefficients, covariance = ordinary(regressors, target)
    # Rounding errors are bounded by the condition times the whole solution, in columns of unit length: a coefficient
    # that is nearly zero by chance is no more accurate than the others.
    norms = np.linalg.norm(regressors, axis=0)
    within = 1e-10 * np.abs(coefficients * norms).max()
    np.testing.assert_allclose(fit.coefficients * norms, coefficients * norms, rtol=0.0, atol=within)
    np.testing.assert_allclose(fit.history[-1] * norms, coefficients * norms, rtol=0.0, atol=within)
    np.testing.assert_allclose(fit.variance_history[-1], np.diag(covariance), rtol=1e-7)
    residual = target - regressors @ coefficients
    assert fit.residual_variance == pytest.approx(residual @ residual / (samples - count), rel=1e-7)


def test_every_sample_is_weighted_least_squares_with_forgetting() -> None:
    rng = np.random.default_rng(1)
    regressors, target = rng.standard_normal((40, 3)), rng.standard_normal(40)
    weights = rng.uniform(0.1, 4.0, 40)
    fit = recursive_least_squares(regressors, target, forgetting=0.93, weights=weights)
    for last in (2, 3, 17, 39):
        memory = np.sqrt(weights[: last + 1] * 0.93 ** np.arange(last, -1, -1))
        coefficients, covariance = ordinary(regressors[: last + 1] * memory[:, None], target[: last + 1] * memory)
        np.testing.assert_allclose(fit.history[last], coefficients, rtol=1e-9)
        np.testing.assert_allclose(fit.variance_history[last], np.diag(covariance), rtol=1e-9)
    assert np.all(np.isnan(fit.history[:2]))
    assert np.all(np.isfinite(fit.history[2:]))


def test_a_prior_counts_as_in_the_normal_equations() -> None:
    rng = np.random.default_rng(2)
    regressors, target = rng.standard_normal((25, 3)), rng.standard_normal(25)
    prior, root = np.array([1.0, -2.0, 30.0]), rng.standard_normal((3, 3)) * [1.0, 1e-3, 1e3]
    covariance0 = root.T @ root
    weights = rng.uniform(0.5, 2.0, 25)
    fit = recursive_least_squares(regressors, target, prior=prior, covariance0=covariance0, weights=weights)
    np.testing.assert_allclose(fit.covariance, fit.covariance.T)
    information = np.linalg.inv(covariance0)
    for last in (0, 5, 24):
        chosen, diagonal = regressors[: last + 1], np.diag(weights[: last + 1])
        total = information + chosen.T @ diagonal @ chosen
        expected = np.linalg.solve(total, information @ prior + chosen.T @ diagonal @ target[: last + 1])
        np.testing.assert_allclose(fit.history[last], expected, rtol=1e-6)
        np.testing.assert_allclose(fit.variance_history[last], np.diag(np.linalg.inv(total)), rtol=1e-6)


def test_sample_by_sample_gives_the_same_numbers_to_the_last_digit() -> None:
    rng = np.random.default_rng(3)
    regressors, target = rng.standard_normal((30, 4)), rng.standard_normal(30)
    target[7] = np.nan
    covariance0 = np.array([1.0, 2.0, 3.0, 4.0])
    fit = recursive_least_squares(regressors, target, forgetting=0.98, covariance0=covariance0)
    flying = RecursiveLeastSquares(4, forgetting=0.98, covariance0=covariance0)
    for n in range(30):
        flying.update(regressors[n], target[n])
        np.testing.assert_array_equal(flying.coefficients, fit.history[n])
    np.testing.assert_array_equal(flying.covariance, fit.covariance)
    assert flying.residual_variance == fit.residual_variance


def test_missing_samples_change_nothing_but_their_own_absence() -> None:
    rng = np.random.default_rng(4)
    regressors, target = rng.standard_normal((50, 2)), rng.standard_normal(50)
    target[10:20] = np.nan
    regressors[30, 1] = np.inf
    there = np.isfinite(target) & np.isfinite(regressors).all(axis=1)
    fit = recursive_least_squares(regressors, target, forgetting=0.9)
    dense = recursive_least_squares(regressors[there], target[there], forgetting=0.9)
    np.testing.assert_array_equal(fit.coefficients, dense.coefficients)
    np.testing.assert_array_equal(fit.history[20], fit.history[9] if not there[20] else dense.history[10])


def test_the_end_alone_is_that_of_all_samples_to_the_last_digit() -> None:
    rng = np.random.default_rng(5)
    regressors, target = rng.standard_normal((50, 3)), rng.standard_normal(50)
    for missing in (20, 49):
        target[missing] = np.nan
        whole = recursive_least_squares(regressors, target, forgetting=0.95)
        end = recursive_least_squares(regressors, target, forgetting=0.95, end_alone=True)
        np.testing.assert_array_equal(end.coefficients, whole.coefficients)
        np.testing.assert_array_equal(end.standard_errors, whole.standard_errors)
        np.testing.assert_array_equal(end.standard_error_history, whole.standard_error_history[-1:])
        np.testing.assert_array_equal(end.history, whole.history[-1:])


def test_what_the_record_does_not_determine_is_nan() -> None:
    first = np.linspace(0.0, 1.0, 30)
    fit = recursive_least_squares(np.column_stack([first, 3.0 * first]), first)
    assert np.all(np.isnan(fit.coefficients))
    assert np.all(np.isnan(fit.standard_errors))


def test_standard_errors_cover_white_noise() -> None:
    rng = np.random.default_rng(5)
    regressors = rng.standard_normal((60, 3)) * [1.0, 100.0, 0.01]
    covered = np.zeros(3)
    for _ in range(1000):
        fit = recursive_least_squares(regressors, 0.3 * rng.standard_normal(60))
        covered += np.abs(fit.coefficients) < 2.0025 * fit.standard_errors  # Student's t, 57 degrees of freedom, 95 %
    assert np.all(np.abs(covered / 1000.0 - 0.95) < 0.025)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"target": np.zeros(4)}, "do not match"),
        ({"forgetting": 0.0}, "forgetting"),
        ({"forgetting": 1.1}, "forgetting"),
        ({"weights": -np.ones(5)}, "not negative"),
        ({"prior": np.zeros(2)}, "covariance0"),
        ({"covariance0": np.array([[1.0, 2.0], [2.0, 1.0]])}, "positive definite"),
        ({"covariance0": np.ones(3)}, "shapes"),
    ],
)
def test_wrong_arguments_are_named(arguments: dict[str, object], words: str) -> None:
    given_arguments: dict[str, object] = {"regressors": np.ones((5, 2)), "target": np.zeros(5)} | arguments
    with pytest.raises(ValueError, match=words):
        recursive_least_squares(**given_arguments)  # type: ignore[arg-type]


def test_collinearity_by_its_definitions() -> None:
    rng = np.random.default_rng(6)
    regressors = rng.standard_normal((80, 3)) * [1.0, 1e4, 1e-4]
    regressors[:, 2] += 0.9e-4 * regressors[:, 0]
    for j in range(3):
        others = np.delete(regressors, j, axis=1)
        rest = regressors[:, j] - others @ ordinary(others, regressors[:, j])[0]
        expected = regressors[:, j] @ regressors[:, j] / (rest @ rest)
        assert variance_inflation(regressors)[j] == pytest.approx(expected, rel=1e-9)
    unit = regressors / np.linalg.norm(regressors, axis=0)
    values = np.sqrt(np.linalg.eigvalsh(unit.T @ unit))
    assert condition_number(regressors) == pytest.approx(values[-1] / values[0], rel=1e-9)
    assert np.all(np.isinf(variance_inflation(np.ones((9, 2)))))
    covariance = np.array([[4.0, -3.0, 0.0], [-3.0, 9.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(correlation(covariance), [[1.0, -0.5, 0.0], [-0.5, 1.0, 0.0], [0.0, 0.0, 1.0]])
