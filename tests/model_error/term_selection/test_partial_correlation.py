"""Partial correlation in coloured noise against dense generalised least squares and repeated records."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg, signal, stats

from aerosid.errors import UsageError
from aerosid.model_error.term_selection.partial_correlation import (
    ColourSettings,
    autoregression,
    coloured_regression,
    multiple_correlation,
    partial_correlations,
)

N = 600


def autoregressive(rng, memory, count=N):
    shocks = np.sqrt(1.0 - memory**2) * rng.standard_normal(count)
    shocks[0] /= np.sqrt(1.0 - memory**2)
    return signal.lfilter([1.0], [1.0, -memory], shocks)


def slow_columns(rng, count, samples=N):
    """Columns as smooth as an aircraft's motion."""
    return signal.lfilter([0.05], [1.0, -0.95], rng.standard_normal((samples, count)), axis=0)


def dense(target, known, candidate, memories, sizes, lengths):
    """Coefficient, deviation and partial correlation with the noise's covariance written out."""
    blocks = [size**2 * memory ** np.arange(n) for memory, size, n in zip(memories, sizes, lengths, strict=True)]
    root = np.linalg.cholesky(linalg.block_diag(*(linalg.toeplitz(block) for block in blocks)))
    y, X, c = (linalg.solve_triangular(root, a, lower=True) for a in (target, known, candidate))
    y_left, c_left = (a - X @ np.linalg.lstsq(X, a, rcond=None)[0] for a in (y, c))
    rho = y_left @ c_left / np.sqrt(y_left @ y_left * (c_left @ c_left))
    slope = y_left @ c_left / (c_left @ c_left)
    rest = y_left - slope * c_left
    return slope, np.sqrt(rest @ rest / (y.size - X.shape[1] - 1) / (c_left @ c_left)), rho


def test_coefficient_deviation_and_correlation_are_those_of_dense_generalised_least_squares():
    rng = np.random.default_rng(3)
    lengths, memories, sizes = (N, N // 2), (0.9, 0.5), (0.2, 3.0)
    known, candidate = slow_columns(rng, 4, sum(lengths)), slow_columns(rng, 1, sum(lengths))[:, 0]
    noise = np.concatenate([s * autoregressive(rng, m, n) for m, s, n in zip(memories, sizes, lengths, strict=True)])
    target = known @ [1.0, -2.0, 0.5, 3.0] + 0.7 * candidate + noise
    slope, deviation, rho = dense(target, known, candidate, memories, sizes, lengths)
    fit = coloured_regression(target, np.column_stack([known, candidate]), lengths)
    assert fit.coefficients[-1] == pytest.approx(slope, abs=0.15 * deviation)
    assert np.sqrt(fit.covariance[-1, -1]) == pytest.approx(deviation, rel=0.1)
    beside = coloured_regression(target, known, lengths)
    found = partial_correlations(beside, candidate[:, None])
    assert found.correlation[0] == pytest.approx(rho, abs=0.04)
    assert found.coefficient[0] == pytest.approx(slope, abs=0.3 * deviation)


def test_white_noise_gives_the_textbook_partial_correlation_and_t_ratio():
    rng = np.random.default_rng(4)
    known, candidate = slow_columns(rng, 3), slow_columns(rng, 1)
    target = known @ [1.0, 2.0, 3.0] + rng.standard_normal(N)
    white = ColourSettings(highest_order=0)
    found = partial_correlations(coloured_regression(target, known, (N,), white), candidate, white)
    both = np.column_stack([known, candidate])
    solution, squares, *_ = np.linalg.lstsq(both, target, rcond=None)
    error = np.sqrt(squares[0] / (N - 4) * np.linalg.inv(both.T @ both)[-1, -1])
    assert found.ratio[0] == pytest.approx(solution[-1] / error, rel=1e-9)
    assert found.correlation[0] == pytest.approx(found.ratio[0] / np.sqrt(found.ratio[0] ** 2 + N - 4), rel=1e-9)
    assert found.p_value[0] == pytest.approx(2.0 * stats.t.sf(abs(found.ratio[0]), N - 4), rel=1e-9)


def test_candidates_entering_together_explain_what_least_squares_of_both_explains():
    rng = np.random.default_rng(5)
    known, candidates = slow_columns(rng, 3), slow_columns(rng, 2)
    target = known @ [1.0, 2.0, 3.0] + candidates @ [0.5, -0.5] + rng.standard_normal(N)
    white = ColourSettings(highest_order=0)
    gain, coefficients, _ = multiple_correlation(coloured_regression(target, known, (N,), white), candidates, white)
    both = np.column_stack([known, candidates])
    solution, rest, *_ = np.linalg.lstsq(both, target, rcond=None)
    _, before, *_ = np.linalg.lstsq(known, target, rcond=None)
    np.testing.assert_allclose(coefficients, solution[-2:], rtol=1e-9)
    assert gain == pytest.approx((before[0] - rest[0]) / rest[0] * (N - 5), rel=1e-9)


@pytest.mark.parametrize("memory", [0.0, 0.8, 0.95])
def test_false_alarms_in_coloured_noise_are_as_many_as_stated(memory):
    """At one in twenty for each candidate; plain correlation alarms on most of them at 0.95."""
    rng = np.random.default_rng(11)
    ratios, plain = [], []
    for _ in range(150):
        known, candidates = slow_columns(rng, 4), slow_columns(rng, 6)
        target = known @ np.ones(4) + autoregressive(rng, memory)
        ratios.append(partial_correlations(coloured_regression(target, known, (N,)), candidates).ratio)
        white = ColourSettings(highest_order=0)
        plain.append(partial_correlations(coloured_regression(target, known, (N,), white), candidates).ratio)
    critical = stats.t.isf(0.025, N - 5)
    alarms = np.mean(np.abs(ratios) > critical)
    # Binomial three-sigma of 900 trials is 2.2 %; the noise model's own scatter adds a percent.
    assert 0.02 < alarms < 0.085
    assert np.mean(np.abs(plain) > critical) > (0.4 if memory > 0.5 else 0.02)


@settings(max_examples=25, deadline=None)
@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6), st.floats(-3.0, 3.0))
def test_units_and_known_columns_change_no_correlation(unit, scale, mixed):
    rng = np.random.default_rng(6)
    known, candidates = slow_columns(rng, 3, 300), slow_columns(rng, 2, 300)
    target = known @ np.ones(3) + candidates[:, 0] + autoregressive(rng, 0.7, 300)
    base = partial_correlations(coloured_regression(target, known, (300,)), candidates)
    other = partial_correlations(
        coloured_regression(unit * (target + mixed * known[:, 0]), known, (300,)),
        scale * (candidates + mixed * known[:, :1]),
    )
    np.testing.assert_allclose(other.correlation, base.correlation, atol=1e-6)
    np.testing.assert_allclose(other.coefficient * scale / unit, base.coefficient, rtol=1e-5)


def test_a_combination_of_known_columns_correlates_with_nothing():
    rng = np.random.default_rng(7)
    known = slow_columns(rng, 3)
    target = known @ np.ones(3) + rng.standard_normal(N)
    found = partial_correlations(coloured_regression(target, known, (N,)), (known @ [1.0, 2.0, 3.0])[:, None])
    assert (found.correlation[0], found.p_value[0]) == (0.0, 1.0)


def test_the_filter_of_a_second_order_process_is_found():
    rng = np.random.default_rng(8)
    taps = np.array([1.0, -1.5, 0.7])
    record = signal.lfilter([1.0], taps, rng.standard_normal(6000))
    np.testing.assert_allclose(autoregression(record)[:3], taps, atol=0.05)


def test_what_the_record_does_not_determine_has_no_deviation():
    rng = np.random.default_rng(9)
    known = np.column_stack([slow_columns(rng, 2), np.zeros(N)])
    fit = coloured_regression(known @ [1.0, 1.0, 0.0] + rng.standard_normal(N), known, (N,))
    assert fit.coefficients[2] == 0.0
    assert np.isinf(fit.covariance[2, 2])


@pytest.mark.parametrize(
    ("target", "known", "lengths", "told"),
    [
        (np.zeros(10), np.zeros((9, 1)), (10,), "do not match"),
        (np.zeros(10), np.zeros((10, 1)), (9,), "do not match"),
        (np.full(10, np.nan), np.ones((10, 1)), (10,), "not finite"),
        (np.arange(3.0), np.eye(3), (3,), "longer record"),
    ],
)
def test_broken_input_is_said_in_one_sentence(target, known, lengths, told):
    with pytest.raises(UsageError, match=told):
        coloured_regression(target, known, lengths)
