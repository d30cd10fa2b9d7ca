"""Consistency against a textbook likelihood, and chosen weights against the noise that was planted."""

from __future__ import annotations

import numpy as np
import pytest

from aerosid.errors import EstimationError, UsageError
from aerosid.model_error.estimators.consistency import (
    covariance_constrained_weights,
    judge_consistency,
    most_likely_weights,
)
from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.discrete import estimate_discrete
from aerosid.model_error.estimators.functions import Partials
from aerosid.model_error.estimators.weights import continuous_weights, discrete_weights, step_covariance

F = np.array([[0.0, 1.0], [-1.0, -0.3]])
DENSITY, R, DT = np.diag([0.0, 0.5]), np.diag([0.01, 0.04]), 0.05


def noisy_record(N=1500, seed=0):
    """A linear system that is driven by white noise of density DENSITY; samples of covariance R."""
    rng = np.random.default_rng(seed)
    fine = 10
    x, states = np.zeros(2), []
    for _ in range(N):
        states.append(x)
        for _ in range(fine):
            x = x + DT / fine * F @ x + np.array([0.0, np.sqrt(0.5 * DT / fine)]) * rng.normal()
    return np.arange(N) * DT, np.array(states) + rng.normal(size=(N, 2)) * np.sqrt(np.diag(R))


def run(y, time, weights):
    history = estimate_continuous(
        lambda x, u, t: F @ x, lambda x, u, t: x.copy(), time, y, np.zeros(2), weights,
        partials=Partials(f_x=lambda x, u, t: F, h_x=lambda x, u, t: np.eye(2)),
    )  # fmt: skip
    return judge_consistency(history, y, R, history.states)


def test_discrete_likelihood_is_the_textbook_one():
    time, y = noisy_record(N=60)
    y[7, 0] = y[20] = np.nan
    big = np.linalg.inv(np.eye(2) - F * DT / 2) @ (np.eye(2) + F * DT / 2)
    Q = step_covariance(F, DENSITY, DT)
    weights = discrete_weights(R, Q, np.eye(2) * 0.1)
    history = estimate_discrete(lambda x, u, j: big @ x, lambda x, u, j: x.copy(), y, np.zeros(2), weights)
    found = judge_consistency(history, y, R, history.states)
    x, P, total = np.zeros(2), np.eye(2) * 0.1, 0.0
    squares = count = 0
    for j in range(60):
        if j:
            x, P = big @ x, big @ P @ big.T + Q
        held = ~np.isnan(y[j])
        H = np.eye(2)[held]
        B = H @ P @ H.T + R[np.ix_(held, held)]
        nu = y[j][held] - H @ x
        if j:
            total += np.log(np.linalg.det(B)) + nu @ np.linalg.inv(B) @ nu if held.any() else 0.0
            squares, count = squares + nu @ np.linalg.inv(B) @ nu, count + held.sum()
        K = P @ H.T @ np.linalg.inv(B)
        x, P = x + K @ nu, (np.eye(2) - K @ H) @ P
    assert time.size == 60
    assert found.minus_two_log_likelihood == pytest.approx(total, rel=1e-8)
    assert found.innovation_ratio == pytest.approx(squares / count, rel=1e-8)


def test_the_most_likely_weights_are_those_that_were_planted():
    time, y = noisy_record()
    start = continuous_weights(R, DT, DENSITY * 300.0, np.eye(2) * 0.1)
    chosen = most_likely_weights(lambda weights: run(y, time, weights), start, (-5.0, 2.0))
    assert 0.6 < chosen.factor * 300.0 < 1.7
    assert 0.9 < chosen.consistency.innovation_ratio < 1.1
    # A likelihood is judged by what it gives up away from its best.
    for factor in (0.1, 10.0):
        other = run(y, time, start.with_model_error_scaled(chosen.factor * factor))
        assert other.minus_two_log_likelihood > chosen.consistency.minus_two_log_likelihood + 20.0


def test_covariance_constraint_makes_residuals_as_large_as_the_noise():
    time, y = noisy_record()
    start = continuous_weights(R, DT, DENSITY, np.eye(2) * 0.1)
    chosen = covariance_constrained_weights(lambda weights: run(y, time, weights), start, (-6.0, 3.0))
    assert np.mean(chosen.consistency.residual_ratio) == pytest.approx(1.0, abs=0.02)
    stiff = run(y, time, start.with_model_error_scaled(chosen.factor * 30.0))
    assert np.mean(stiff.residual_ratio) < 0.9


def test_an_estimator_that_always_breaks_down_is_named():
    def broken(weights):
        raise EstimationError("stops being finite")

    weights = continuous_weights(R, DT, DENSITY, np.eye(2))
    with pytest.raises(UsageError, match="breaks down with every weight"):
        most_likely_weights(broken, weights)
