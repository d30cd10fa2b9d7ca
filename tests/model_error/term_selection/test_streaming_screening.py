"""Recursive screening against batch least squares, and against the scatter of repeated records."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from aerosid.errors import UsageError
from aerosid.model_error.term_selection.streaming_screening import ScreeningSettings, StreamingScreening

N = 300


def record(rng, memory=0.0, count=N, columns=4):
    X = signal.lfilter([0.2], [1.0, -0.8], rng.standard_normal((count, columns)), axis=0)
    shocks = np.sqrt(1.0 - memory**2) * rng.standard_normal(count)
    shocks[0] /= np.sqrt(1.0 - memory**2)
    return X, signal.lfilter([1.0], [1.0, -memory], shocks)


def screened(y, X, known, settings=None, asked=None):
    screening = StreamingScreening(X.shape[1], settings=settings)
    for target, row in zip(y, X, strict=True):
        screening.update(target, row)
    return screening.ask(known, asked)


def test_coefficients_and_partial_correlations_are_those_of_batch_least_squares():
    X, noise = record(np.random.default_rng(1))
    y = X[:, :3] @ [1.0, -2.0, 0.5] + 0.3 * X[:, 3] + noise
    found = screened(y, X, [0, 1, 2])
    known = X[:, :3]
    left, asked = (a - known @ np.linalg.lstsq(known, a, rcond=None)[0] for a in (y, X[:, 3]))
    np.testing.assert_allclose(found.coefficients[:3], np.linalg.lstsq(known, y, rcond=None)[0], rtol=1e-8)
    assert found.correlation[3] == pytest.approx(left @ asked / np.sqrt(left @ left * (asked @ asked)), rel=1e-8)


def test_deviations_are_newey_and_wests():
    """Written out as a double sum over samples."""
    X, noise = record(np.random.default_rng(2), 0.7)
    lags = 10
    found = screened(X @ np.ones(4) + noise, X, range(4), ScreeningSettings(lags=lags, weightings=0))
    y = X @ np.ones(4) + noise
    residual = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    middle = np.zeros((4, 4))
    for lag in range(lags + 1):
        gamma = residual[lag:] @ residual[: N - lag] / N
        products = X[lag:].T @ X[: N - lag]
        middle += (1.0 - lag / (lags + 1)) * gamma * (products if lag == 0 else products + products.T)
    inverse = np.linalg.inv(X.T @ X)
    expected = np.sqrt(np.diag(inverse @ middle @ inverse) * N / (N - 5))
    np.testing.assert_allclose(found.deviations, expected, rtol=1e-8)


def test_several_equations_are_weighted_by_their_own_noise():
    rng = np.random.default_rng(3)
    X = rng.standard_normal((2, N, 2))
    y = X @ [1.0, -1.0] + np.array([[0.01], [10.0]]) * rng.standard_normal((2, N))
    screening = StreamingScreening(2, 2)
    for k in range(N):
        screening.update(y[:, k], X[:, k])
    quiet = np.linalg.lstsq(X[0], y[0], rcond=None)[0]
    np.testing.assert_allclose(screening.ask([0, 1]).coefficients, quiet, atol=2e-4)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_deviations_match_the_scatter_of_repeated_records(memory):
    rng = np.random.default_rng(4)
    values, deviations = [], []
    for _ in range(120):
        X, noise = record(rng, memory)
        found = screened(X @ np.ones(4) + noise, X, range(4))
        values.append(found.coefficients)
        deviations.append(found.deviations)
    # The scatter of 120 records is known to 6 %; tapering costs some of a strong colour.
    ratio = np.sqrt(np.mean(np.square(deviations), axis=0)) / np.std(values, axis=0)
    assert np.all((ratio > 0.75) & (ratio < 1.25))


def test_nothing_is_said_before_there_are_enough_samples():
    X, noise = record(np.random.default_rng(5), count=15)
    found = screened(noise, X, [0])
    assert np.isnan(found.coefficients).all()
    assert (found.p_value == 1.0).all()


def test_missing_samples_are_skipped():
    X, noise = record(np.random.default_rng(6))
    y = X @ np.ones(4) + noise
    gappy = y.copy()
    gappy[50:60] = np.nan
    kept = np.isfinite(gappy)
    expected = screened(y[kept], X[kept], range(4)).coefficients
    np.testing.assert_allclose(screened(gappy, X, range(4)).coefficients, expected, rtol=1e-12)


def test_a_sample_of_another_size_is_refused_in_one_sentence():
    screening = StreamingScreening(3)
    with pytest.raises(UsageError, match="2 columns where 1 of 3"):
        screening.update(0.0, [1.0, 2.0])
    with pytest.raises(UsageError, match="0 columns"):
        StreamingScreening(0)
