"""Poor initial states: forward-backward iteration and states declared unknown."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from oracles import model_error as oracles

from aerosid.errors import UsageError
from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.discrete import estimate_discrete
from aerosid.model_error.estimators.fixed_interval import fixed_interval_discrete
from aerosid.model_error.estimators.initial_states import estimate_forward_backward, with_unknown_initial
from aerosid.model_error.estimators.weights import Weights, continuous_weights


def pendulum(x, u, t):
    return np.array([x[1], -np.sin(x[0]) - 0.1 * x[1] + u[0]])


def pendulum_record():
    time = np.arange(200) * 0.05
    u = (0.3 * np.cos(0.9 * time))[:, None]
    x, states = np.array([0.6, -0.2]), []
    for k in range(time.size):
        states.append(x)
        for i in range(20):
            h, t = 0.05 / 20, time[k] + i * 0.05 / 20
            a, b, c = (np.array([np.interp(t + s * h, time, u[:, 0])]) for s in (0.0, 0.5, 1.0))
            k1 = pendulum(x, a, t)
            k2 = pendulum(x + h / 2 * k1, b, t)
            k3 = pendulum(x + h / 2 * k2, b, t)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + pendulum(x + h * k3, c, t))
    return time, u, np.array(states)


@pytest.mark.parametrize("compiled", [False, True])
def test_one_backward_run_improves_an_initial_state_that_is_half_off(compiled):
    time, u, X = pendulum_record()
    f, h = pendulum, lambda x, u, t: x[:1].copy()  # the rate is not measured: its error stays for a while
    if compiled:
        f, h = numba.njit(f), numba.njit(h)
    weights = continuous_weights([[1e-4]], 0.05, np.diag([0.0, 1e-4]), np.diag([1e-4, 1e-2]))
    plain = estimate_continuous(f, h, time, X[:, :1], 1.5 * X[0], weights, u=u)
    improved = estimate_forward_backward(f, h, time, X[:, :1], 1.5 * X[0], weights, u=u)
    assert np.abs(plain.states[0] - X[0]).max() > 0.05
    assert np.abs(improved.states[0] - X[0]).max() < 2e-3
    assert np.abs(improved.states - X).max() < 0.05 * np.abs(plain.states - X).max()
    assert np.abs(improved.model_error).max() < 0.05 * np.abs(plain.model_error).max()


def test_backward_run_takes_the_weight_of_each_step_with_it():
    time, u, X = pendulum_record()
    Q1 = np.full((200, 1, 1), 2e5)
    Q1[100:] *= 10.0
    varying = Weights(Q1, np.diag([0.0, 1e-4]), np.diag([1e-4, 1e-2]))
    found = estimate_forward_backward(pendulum, lambda x, u, t: x[:1].copy(), time, X[:, :1], 1.5 * X[0], varying, u=u)
    assert np.abs(found.states[0] - X[0]).max() < 2e-3
    assert np.array_equal(found.weights.Q1, Q1)


def test_an_unknown_initial_state_leaves_no_trace_of_its_guess():
    F, H = np.array([[0.9, 0.2], [-0.1, 0.8]]), np.array([[1.0, 0.3]])
    y = np.random.default_rng(5).normal(size=(30, 1))
    weights = with_unknown_initial(Weights(np.eye(1), np.diag([0.1, 0.3]), np.eye(2) * 1e-3), [0, 1], 1e4)
    results = []
    for guess in ([0.0, 0.0], [5.0, -80.0]):
        filtered = estimate_discrete(lambda x, u, j: F @ x, lambda x, u, j: H @ x, y, guess, weights)
        smoothed = fixed_interval_discrete(lambda x, u, j: F @ x, lambda x, u, j: H @ x, y, guess, weights)
        results.append((filtered.states[3:], smoothed.states))
    np.testing.assert_allclose(results[0][0], results[1][0], atol=3e-5)
    np.testing.assert_allclose(results[0][1], results[1][1], atol=3e-5)
    exact = oracles.dense_discrete(
        [F] * 30, [H] * 30, np.zeros((30, 2)), y, np.zeros(2), np.eye(1), np.diag([0.1, 0.3]), np.eye(2) * 1e12
    )[0]
    np.testing.assert_allclose(results[0][1], exact, atol=1e-5)


def test_only_the_named_state_is_unknown():
    S0 = np.array([[0.5, 0.1, 0.0], [0.1, 0.4, 0.05], [0.0, 0.05, 0.2]])
    weights = with_unknown_initial(Weights(np.eye(1), np.eye(3), S0), [1], 100.0)
    np.testing.assert_array_equal(weights.S0, [[0.5, 0.0, 0.0], [0.0, 5000.0, 0.0], [0.0, 0.0, 0.2]])
    with pytest.raises(UsageError, match="positive"):
        with_unknown_initial(weights, [0], 0.0)
