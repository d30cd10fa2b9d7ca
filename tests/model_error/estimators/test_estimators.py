"""Discrete and continuous recursions against dense minimisers of J, Kalman filters, and planted model errors."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import model_error as oracles
from scipy.integrate import solve_ivp

from aerosid.errors import EstimationError, UsageError
from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.discrete import estimate_discrete
from aerosid.model_error.estimators.functions import Partials, model_functions
from aerosid.model_error.estimators.response import respond
from aerosid.model_error.estimators.weights import Weights, continuous_weights, discrete_weights, step_covariance

RNG = np.random.default_rng(3)


def linear_record(N=30, n=3, p=2):
    rng = np.random.default_rng(12)
    F = np.array([0.9 * np.linalg.qr(rng.normal(size=(n, n)))[0] + 0.1 * rng.normal(size=(n, n)) for _ in range(N)])
    H, b, y = rng.normal(size=(N, p, n)), rng.normal(size=(N, n)), rng.normal(size=(N, p))
    return F, H, b, y, rng.normal(size=n)


def run_linear(F, H, b, y, x0, weights):
    return estimate_discrete(lambda x, u, j: F[int(j)] @ x + b[int(j)], lambda x, u, j: H[int(j)] @ x, y, x0, weights)


def test_discrete_last_state_is_the_dense_minimiser_of_J():
    F, H, b, y, x0 = linear_record()
    y[5, 1] = y[11] = np.nan
    weights = Weights(np.array([[2.0, 0.3], [0.3, 0.7]]), np.diag([0.5, 0.05, 1.5]), np.eye(3) * 0.4 + 0.1)
    for last in (1, 2, 7, 30):
        found = run_linear(F, H, b, y[:last], x0, weights)
        x, _, covariance, _ = oracles.dense_discrete(F, H, b, y[:last], x0, weights.Q1, weights.Q2_inverse, weights.S0)
        np.testing.assert_allclose(found.states[-1], x[-1], atol=1e-8)
        np.testing.assert_allclose(found.covariance[-1], covariance[-1], atol=1e-8)


@pytest.mark.parametrize("reading", ["covariance is 2 S", "covariance is S"])
def test_discrete_recursion_is_a_kalman_filter_in_both_readings_of_the_factor_2(reading):
    F, H, b, y, x0 = linear_record()
    R, Q, P0 = np.array([[0.5, 0.1], [0.1, 0.3]]), np.diag([0.4, 0.1, 0.9]), np.eye(3) * 0.7
    if reading == "covariance is 2 S":
        weights, factor = discrete_weights(R, Q, P0), 2.0
    else:
        weights, factor = Weights(0.5 * np.linalg.inv(R), 2.0 * Q, P0), 1.0
    found = run_linear(F, H, b, y, x0, weights)
    states, covariances, predicted, _ = oracles.kalman_filter(F, H, b, y, x0, P0, Q, R)
    np.testing.assert_allclose(found.states, states, atol=1e-8)
    np.testing.assert_allclose(factor * found.S, covariances, atol=1e-8)
    np.testing.assert_allclose(found.model_error, (states - predicted)[1:], atol=1e-8)
    np.testing.assert_allclose(found.innovations, y - np.einsum("kij,kj->ki", H, predicted), atol=1e-8)


CONTINUOUS_F = np.array([[0.0, 1.0, 0.2], [-2.0, -0.4, 0.5], [0.0, 0.3, -1.0]])
CONTINUOUS_H = np.array([[1.0, 0.0, 0.0], [0.0, 0.5, 1.0]])


def smooth_record(time):
    y = np.column_stack([np.sin(1.3 * time) + 0.3, np.cos(0.7 * time) - 0.5 * time])
    return y, np.column_stack([np.cos(time), 0.3 * time, np.sin(2.0 * time)])


def run_continuous(time, y, u, x0, weights, F=CONTINUOUS_F, H=CONTINUOUS_H):
    return estimate_continuous(lambda x, u, t: F @ x + u, lambda x, u, t: H @ x, time, y, x0, weights, u=u)


def test_continuous_last_state_tends_to_the_dense_minimiser_of_J_at_second_order():
    weights = Weights(np.diag([3.0, 20.0]), np.diag([0.5, 2.0, 0.3]), np.eye(3) * 0.4)
    x0, errors = np.array([0.2, -0.1, 0.4]), []
    fine = np.linspace(0.0, 2.0, 321)
    y, u = smooth_record(fine)
    exact = oracles.dense_boundary_value(
        CONTINUOUS_F, CONTINUOUS_H, u, fine, y, x0, weights.Q1, weights.Q2_inverse, weights.S0
    )[0][-1]
    for N in (21, 41, 81):
        time = np.linspace(0.0, 2.0, N)
        y, u = smooth_record(time)
        found = run_continuous(time, y, u, x0, weights)
        errors.append(np.abs(found.states[-1] - exact).max())
    assert errors[-1] < 1e-4
    assert 3.4 < errors[0] / errors[1] < 4.6
    assert 3.4 < errors[1] / errors[2] < 4.6


def test_continuous_last_state_is_the_dense_minimiser_where_the_path_is_straight():
    # x1' = x2, x2' = d: the open-loop path is straight and the residual linear in time, so that nothing is approximate.
    F, H = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[1.0, 0.0]])
    time = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.6, 0.65, 0.8])
    y, u = RNG.normal(size=(8, 1)), np.zeros((8, 2))
    weights = Weights(np.diag([50.0]), np.diag([0.0, 9.0]), np.diag([0.5, 2.0]))
    x0 = np.array([0.1, -0.3])
    found = run_continuous(time, y, u, x0, weights, F, H)
    for last in range(2, 9):
        x, _ = oracles.dense_boundary_value(
            F, H, u, time[:last], y[:last], x0, weights.Q1, weights.Q2_inverse, weights.S0
        )
        np.testing.assert_allclose(found.states[last - 1], x[-1], atol=1e-9)


@pytest.mark.parametrize("reading", ["covariance is 2 S", "covariance is S"])
def test_continuous_recursion_is_a_kalman_bucy_filter_in_both_readings_of_the_factor_2(reading):
    R, Q, P0, dt = np.diag([0.02, 0.01]), np.diag([0.5, 2.0, 0.3]), np.eye(3) * 0.8, 0.01
    x0 = np.array([0.2, -0.1, 0.4])
    time = np.arange(201) * dt
    y, u = smooth_record(time)
    if reading == "covariance is 2 S":
        weights, factor = continuous_weights(R, dt, Q, P0), 2.0
    else:
        weights, factor = Weights(0.5 * np.linalg.inv(R) / dt, 2.0 * Q, P0), 1.0
    found = run_continuous(time, y, u, x0, weights)
    density = np.linalg.inv(R * dt)

    def rates(t, z):
        x, P = z[:3], z[3:].reshape(3, 3)
        measured = np.array([np.interp(t, time, y[:, i]) for i in range(2)])
        drive = np.array([np.interp(t, time, u[:, i]) for i in range(3)])
        K = P @ CONTINUOUS_H.T @ density
        dx = CONTINUOUS_F @ x + drive + K @ (measured - CONTINUOUS_H @ x)
        dP = CONTINUOUS_F @ P + P @ CONTINUOUS_F.T + Q - K @ CONTINUOUS_H @ P
        return np.concatenate([dx, dP.ravel()])

    z = solve_ivp(rates, (0.0, 2.0), np.concatenate([x0, P0.ravel()]), rtol=1e-9, atol=1e-11, max_step=dt).y[:, -1]
    np.testing.assert_allclose(found.states[-1], z[:3], atol=1e-4)  # the residual's curvature over a step
    np.testing.assert_allclose(factor * found.S[-1], z[3:].reshape(3, 3), rtol=1e-6, atol=1e-9)


def test_discrete_tends_to_continuous_at_first_order():
    R, Q, P0, x0 = np.diag([0.02, 0.01]), np.diag([0.5, 2.0, 0.3]), np.eye(3) * 0.8, np.array([0.2, -0.1, 0.4])
    gaps = []
    for N in (201, 401, 801):
        time = np.linspace(0.0, 2.0, N)
        dt = time[1]
        y, u = smooth_record(time)
        continuous = run_continuous(time, y, u, x0, continuous_weights(R, 0.02, Q, P0))
        # Samples every dt carry the continuous information R 0.02 where each has the covariance R 0.02 / dt.
        discrete = estimate_discrete(
            lambda x, u, j, dt=dt: x + dt * (CONTINUOUS_F @ x + u),
            lambda x, u, j: CONTINUOUS_H @ x,
            y,
            x0,
            discrete_weights(R * 0.02 / dt, Q * dt, P0),
            u=u,
        )
        gaps.append([
            np.abs(discrete.states[-1] - continuous.states[-1]).max(),
            np.abs(discrete.S[-1] - continuous.S[-1]).max(),
            np.abs(discrete.model_error[-1] / dt - continuous.model_error[-1]).max(),
        ])  # fmt: skip
    ratios = np.array(gaps[:-1]) / np.array(gaps[1:])
    assert np.all((ratios > 1.7) & (ratios < 2.3)), ratios


def duffing(x, u, t):
    return np.array([(u[0] - 0.32 * x[0] - x[1] - 0.05 * x[1] ** 3) / 2.56, x[0]])


def fly(rates, time, u, x0, fine=20):
    """States at the samples by a fine Runge-Kutta integration of the truth."""
    x, states = np.array(x0, dtype=float), [np.array(x0, dtype=float)]
    for k in range(len(time) - 1):
        h = (time[k + 1] - time[k]) / fine
        for i in range(fine):
            t = time[k] + i * h
            at = [u[k] + (u[k + 1] - u[k]) * (i + s) / fine for s in (0.0, 0.5, 1.0)]
            k1 = rates(x, at[0], t)
            k2 = rates(x + h / 2 * k1, at[1], t + h / 2)
            k3 = rates(x + h / 2 * k2, at[1], t + h / 2)
            k4 = rates(x + h * k3, at[2], t + h)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states.append(x)
    return np.array(states)


def test_a_perfect_model_has_no_model_error():
    time = np.arange(200) * 0.05
    u = 2.5 * np.cos(time)[:, None]
    X = fly(duffing, time, u, [1.0, 0.5])
    weights = continuous_weights(np.eye(2) * 1e-4, 0.05, np.diag([1.0, 0.0]), np.eye(2) * 1e-4)
    found = estimate_continuous(duffing, lambda x, u, t: x.copy(), time, X, X[0], weights, u=u)
    assert np.abs(found.model_error).max() < 1e-6  # what one Runge-Kutta step of 50 ms leaves

    def step(x, u, j):
        return np.array([0.5 * x[0] + 0.623 * x[1] - 0.05 * x[0] ** 3 + 2.5 * np.cos(0.3 * j), 0.1 * x[1]])

    Y = [np.array([1.0, 0.5])]
    for j in range(60):
        Y.append(step(Y[-1], None, j))
    exact = estimate_discrete(step, lambda x, u, j: x.copy(), np.array(Y), Y[0], Weights(*(np.eye(2),) * 3))
    assert np.abs(exact.model_error).max() < 1e-14


def record_with_planted_error(dt, seconds=12.0):
    time = np.arange(0.0, seconds, dt)
    u = 2.5 * np.cos(time)[:, None]
    return time, u, fly(duffing, time, u, [1.0, 0.5], fine=max(2, int(dt / 2e-3)))


def lacking(x, u, t):
    return np.array([(u[0] - 0.32 * x[0] - x[1]) / 2.56, x[0]])


@pytest.mark.parametrize("dt", [0.01, 0.03, 0.1])
@pytest.mark.parametrize("factor", [1e-3, 1e-1, 1.0, 1e3])
def test_a_planted_coefficient_returns_whatever_the_weights(factor, dt):
    time, u, X = record_with_planted_error(dt)
    weights = continuous_weights(np.diag([1e-4, 1e-4]), dt, np.diag([1e-2 * factor, 0.0]), np.eye(2) * 1e-6)
    found = estimate_continuous(lacking, lambda x, u, t: x.copy(), time, X, X[0], weights, u=u)
    candidate = np.zeros((time.size, 2, 1))
    candidate[:, 0, 0] = X[:, 1] ** 3
    response = respond(found, candidate)[:, 0, 0]
    coefficient = response @ found.model_error[:, 0] / (response @ response)
    # The candidate's curvature between the samples, (omega dt)^2 / 12 with the third harmonic, is all that is left.
    assert abs(coefficient / (-0.05 / 2.56) - 1.0) < max(1e-3, 0.2 * dt**2)
    assert np.corrcoef(response, found.model_error[:, 0])[0, 1] < -0.9999


def test_response_with_missing_samples_and_an_unknown_start():
    dt = 0.03
    time, u, X = record_with_planted_error(dt)
    Y = X.copy()
    Y[1::2, 0] = np.nan  # recorded at half the rate
    Y[100:110] = np.nan
    weights = continuous_weights(np.diag([1e-4, 1e-4]), dt, np.diag([1e-2, 0.0]), np.eye(2) * 1e-2)
    wrong = X[0] + np.array([0.05, -0.04])
    found = estimate_continuous(lacking, lambda x, u, t: x.copy(), time, Y, wrong, weights, u=u)
    candidates = np.zeros((time.size, 2, 3))
    candidates[:, 0, 0] = X[:, 1] ** 3
    initial = np.column_stack([np.zeros(2), np.eye(2)])
    response = respond(found, candidates, initial)
    regressors, target = response.reshape(-1, 3), found.model_error.ravel()
    coefficients = np.linalg.lstsq(regressors, target)[0]
    assert abs(coefficients[0] / (-0.05 / 2.56) - 1.0) < 2e-3
    np.testing.assert_allclose(coefficients[1:], X[0] - wrong, rtol=2e-2)
    assert np.all(found.model_error[102:108] == 0.0)


def test_discrete_response_is_exact_for_a_linear_model():
    rng = np.random.default_rng(9)
    F, H = np.array([[0.9, 0.2], [-0.1, 0.8]]), np.array([[1.0, 0.3]])
    candidate, x = rng.normal(size=(40, 2)), np.array([0.4, -0.2])
    y = [H @ x]
    for j in range(40):
        x = F @ x + 0.7 * candidate[j]
        y.append(H @ x)
    y = np.array(y)
    y[7] = np.nan
    found = estimate_discrete(
        lambda x, u, j: F @ x,
        lambda x, u, j: H @ x,
        y,
        [0.1, 0.1],
        Weights(np.eye(1) * 3.0, np.eye(2) * 0.2, np.eye(2)),
    )
    response = respond(
        found, np.stack([candidate, np.zeros((40, 2))], axis=2), np.column_stack([np.zeros(2), [0.3, -0.3]])
    )
    np.testing.assert_allclose(response @ np.array([0.7, 1.0]), found.model_error, atol=1e-8)


@settings(max_examples=20, deadline=None)
@given(unit=st.tuples(st.floats(0.01, 100.0), st.floats(0.01, 100.0)))
def test_a_change_of_state_units_only_rescales_d(unit):
    dt, scale = 0.1, np.array(unit)
    time, u, X = record_with_planted_error(dt, seconds=4.0)
    R, Q, P0 = np.diag([1e-4, 2e-4]), np.diag([1e-2, 1e-3]), np.eye(2) * 1e-4
    plain = estimate_continuous(
        lacking,
        lambda x, u, t: x.copy(),
        time,
        X,
        X[0],
        continuous_weights(R, dt, Q, P0),
        u=u,
        partials=Partials(state_scale=[1.0, 1.0]),
    )
    scaled = estimate_continuous(
        lambda x, u, t: lacking(x / scale, u, t) * scale,
        lambda x, u, t: x / scale,
        time,
        X,
        X[0] * scale,
        continuous_weights(R, dt, Q * np.outer(scale, scale), P0 * np.outer(scale, scale)),
        u=u,
        partials=Partials(state_scale=scale),
    )
    np.testing.assert_allclose(scaled.model_error / scale, plain.model_error, atol=1e-8)


def test_compiled_functions_give_what_python_functions_give():
    time, u, X = record_with_planted_error(0.1, seconds=4.0)
    X[5, 0] = np.nan
    weights = continuous_weights(np.eye(2) * 1e-4, 0.1, np.diag([1e-2, 1e-3]), np.eye(2) * 1e-4)
    f, h = numba.njit(lacking), numba.njit(lambda x, u, t: x * 1.0)
    plain = estimate_continuous(lacking, lambda x, u, t: x * 1.0, time, X, X[0], weights, u=u)
    compiled = estimate_continuous(f, h, time, X, X[0], weights, u=u)
    np.testing.assert_allclose(compiled.states, plain.states, rtol=1e-12)
    np.testing.assert_allclose(compiled.model_error, plain.model_error, rtol=1e-8, atol=1e-12)
    discrete = [estimate_discrete(*functions, X, X[0], weights, u=u) for functions in ((f, h), (lacking, h.py_func))]
    np.testing.assert_allclose(discrete[0].model_error, discrete[1].model_error, rtol=1e-8, atol=1e-12)


def test_supplied_partial_derivatives_agree_with_central_differences():
    time, u, X = record_with_planted_error(0.1, seconds=4.0)
    weights = continuous_weights(np.eye(2) * 1e-4, 0.1, np.diag([1e-2, 1e-3]), np.eye(2) * 1e-4)
    given_partials = estimate_continuous(
        duffing, lambda x, u, t: x.copy(), time, X, X[0], weights, u=u,
        partials=Partials(
            f_x=lambda x, u, t: np.array([[-0.32 / 2.56, -(1.0 + 0.15 * x[1] ** 2) / 2.56], [1.0, 0.0]]),
            h_x=lambda x, u, t: np.eye(2),
        ),
    )  # fmt: skip
    differences = estimate_continuous(duffing, lambda x, u, t: x.copy(), time, X, X[0], weights, u=u)
    np.testing.assert_allclose(differences.S, given_partials.S, rtol=1e-7, atol=1e-14)


def test_open_loop_step_is_of_fourth_order_with_inputs_that_are_ramps():
    u0, u1 = np.array([0.4]), np.array([1.9])
    exact = solve_ivp(
        lambda t, x: duffing(x, u0 + (u1 - u0) * t / 0.8, t), (0.0, 0.8), [1.0, 0.5], rtol=1e-12, atol=1e-13
    ).y[:, -1]
    errors = []
    for substeps in (2, 4, 8):
        step = model_functions(duffing, lambda x, u, t: x, n=2, p=2, substeps=substeps).step
        errors.append(np.abs(step(np.array([1.0, 0.5]), u0, u1, 0.0, 0.8) - exact).max())
    slopes = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all((slopes > 3.6) & (slopes < 4.6)), slopes


@pytest.mark.slow
@pytest.mark.parametrize("dt", [1e-3, 1e-2, 0.1])
def test_an_hour_long_record_with_weights_twelve_decades_apart(dt):
    N = min(int(3600.0 / dt), 400_000)
    time = np.arange(N) * dt
    y = np.column_stack([np.sin(0.7 * time), 0.7 * np.cos(0.7 * time)])
    weights = Weights(np.diag([1e6, 1e-6]) / dt, np.diag([0.0, 1e6]), np.diag([1e-6, 1e6]))
    found = estimate_continuous(
        numba.njit(lambda x, u, t: np.array([x[1], -0.3 * x[0]])), numba.njit(lambda x, u, t: x * 1.0),
        time, y, y[0], weights,
    )  # fmt: skip
    diagonal = np.diagonal(found.S, axis1=1, axis2=2)
    assert np.all(diagonal > 0.0)
    assert np.all(np.abs(found.S[:, 0, 1]) < np.sqrt(diagonal[:, 0] * diagonal[:, 1]))
    assert np.array_equal(found.S[:, 0, 1], found.S[:, 1, 0])
    # The well measured state is followed as closely as the weights say, the other by its rate, to the very end.
    assert np.abs(found.states[N // 2 :, 0] - y[N // 2 :, 0]).max() < 1e-4
    assert np.abs(found.states[N // 2 :, 1] - y[N // 2 :, 1]).max() < 0.4 * dt + 1e-3


def test_weights_may_change_with_time():
    F, H, b, y, x0 = linear_record()
    N = len(y)
    Q1 = np.array([np.diag([1.0 + k % 3, 0.5]) for k in range(N)])
    Q2_inverse = np.array([np.diag([0.5, 0.1 * (1 + k % 2), 0.3]) for k in range(N)])
    found = run_linear(F, H, b, y, x0, Weights(Q1, Q2_inverse, np.eye(3)))
    x, P = np.array(x0), 2.0 * np.eye(3)
    for j in range(N):
        if j:
            x, P = F[j - 1] @ x + b[j - 1], F[j - 1] @ P @ F[j - 1].T + Q2_inverse[j - 1]
        K = P @ H[j].T @ np.linalg.inv(H[j] @ P @ H[j].T + np.linalg.inv(Q1[j]))
        x, P = x + K @ (y[j] - H[j] @ x), (np.eye(3) - K @ H[j]) @ P
    np.testing.assert_allclose(found.states[-1], x, atol=1e-8)


def test_step_covariance_makes_the_discrete_filter_that_of_the_sampled_continuous_noise():
    F, dt, density = np.array([[0.0, 1.0], [-1.0, -0.3]]), 0.5, np.diag([0.0, 2.0])
    rng, fine = np.random.default_rng(1), 100
    ends = np.zeros((4000, 2))
    for _ in range(fine):
        noise = rng.normal(size=(4000, 2)) * np.sqrt(np.diag(density) * dt / fine)
        ends = ends + ends @ F.T * dt / fine + noise
    np.testing.assert_allclose(np.cov(ends.T), step_covariance(F, density, dt), rtol=0.12, atol=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": [0.0, 0.2, 0.2]}, "time does not increase at sample 2"),
        ({"y": np.zeros((2, 1))}, "y has shape"),
        ({"y": np.array([[0.0], [np.inf], [0.0]])}, "infinite at sample 1"),
        ({"u": np.zeros((3, 1)) * np.nan}, "u is not finite at sample 0"),
        ({"x0": [0.0, np.nan]}, "x0"),
        ({"x0": [0.0, 0.0, 0.0]}, "Q2_inverse has shape"),
    ],
)
def test_wrong_records_are_refused_with_a_sentence(change, message):
    record = {"time": [0.0, 0.1, 0.2], "y": np.zeros((3, 1)), "x0": [0.0, 0.0], "u": np.zeros((3, 1))} | change
    with pytest.raises(UsageError, match=message):
        estimate_continuous(
            lambda x, u, t: -x, lambda x, u, t: x[:1], record["time"], record["y"], record["x0"],
            Weights(np.eye(1), np.eye(2), np.eye(2)), u=record["u"],
        )  # fmt: skip


@pytest.mark.parametrize(
    ("Q1", "Q2_inverse", "message"),
    [
        (np.array([[1.0, 0.5], [0.0, 1.0]]), np.eye(2), "Q1 is not symmetric"),
        (np.eye(2), -np.eye(2), "Q2_inverse is not positive semi-definite"),
        (np.eye(2) * np.nan, np.eye(2), "not finite"),
        (np.ones(2), np.eye(2), "shape"),
    ],
)
def test_wrong_weights_are_refused_with_a_sentence(Q1, Q2_inverse, message):
    with pytest.raises(UsageError, match=message):
        Weights(Q1, Q2_inverse, np.eye(2))


def test_wrong_functions_are_refused_with_a_sentence():
    weights = Weights(np.eye(1), np.eye(2), np.eye(2))
    with pytest.raises(UsageError, match="returned an array of shape"):
        estimate_continuous(lambda x, u, t: x[:1], lambda x, u, t: x[:1], [0.0, 1.0], np.zeros((2, 1)), [0, 0], weights)
    with pytest.raises(UsageError, match="compile all of them or none"):
        estimate_continuous(numba.njit(lacking), lambda x, u, t: x[:1], [0.0], np.zeros((1, 1)), [0, 0], weights)


def test_a_diverging_model_is_an_estimation_error_that_names_the_sample():
    with np.errstate(all="ignore"), pytest.raises(EstimationError, match="sample 1"):
        estimate_continuous(
            lambda x, u, t: x * np.inf, lambda x, u, t: x, [0.0, 1.0], np.ones((2, 1)), [1.0],
            Weights(np.eye(1), np.eye(1), np.eye(1)), partials=Partials(f_x=lambda x, u, t: np.eye(1)),
        )  # fmt: skip
