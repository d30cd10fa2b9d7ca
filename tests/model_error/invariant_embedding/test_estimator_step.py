"""The step of the recursion against the matrix exponential, direct integration of (22), and ninety-digit arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import model_error as oracles
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_continuous_are

from aerosid.model_error.estimators.weights import step_covariance
from aerosid.model_error.invariant_embedding.estimator_step import (
    estimator_step,
    gain_step,
    information,
    measurement_update,
    predict_riccati,
)
from aerosid.model_error.invariant_embedding.step_map import transition_step
from aerosid.model_error.invariant_embedding.step_work import solve_in_place, step_work


def step(S, F, W, C, g0, g1, dt):
    n = len(F)
    S_next, e = np.zeros((n, n)), np.zeros(n)
    assert estimator_step(S, F, W, C, g0, g1, dt, S_next, e, step_work(n))
    return S_next, e


def random_step(seed, n=4, p=2):
    rng = np.random.default_rng(seed)
    F, H, X = rng.normal(size=(n, n)), rng.normal(size=(p, n)), rng.normal(size=(n, n))
    W = np.diag(rng.uniform(0.1, 2.0, n))
    W[-1, -1] = 0.0
    return X @ X.T, F, W, 2.0 * H.T @ H * rng.uniform(0.1, 10.0), rng.normal(size=n), rng.normal(size=n)


@pytest.mark.parametrize("dt", [1e-3, 0.01, 0.1, 0.5])
@pytest.mark.parametrize("n", [1, 2, 4, 6])
def test_step_equals_that_of_the_matrix_exponential(n, dt):
    given_step = random_step(n, n, min(n, 3))
    S, e = step(*given_step, dt)
    S_exact, e_exact = oracles.exponential_step(*given_step, dt)
    np.testing.assert_allclose(S, S_exact, atol=1e-12 * np.abs(S_exact).max())
    np.testing.assert_allclose(e, e_exact, atol=1e-12 * np.abs(e_exact).max())


def test_step_equals_direct_integration_of_the_riccati_and_mean_equations():
    S0, F, W, C, g0, g1 = random_step(11)
    n, dt = len(F), 0.3

    def rates(t, z):
        S, e = z[: n * n].reshape(n, n), z[n * n :]
        g = g0 + (g1 - g0) * t / dt
        return np.concatenate([oracles.riccati_rates(F, W, C, S).ravel(), F @ e + S @ (g - C @ e)])

    z = solve_ivp(rates, (0.0, dt), np.concatenate([S0.ravel(), np.zeros(n)]), rtol=1e-11, atol=1e-13).y[:, -1]
    S, e = step(S0, F, W, C, g0, g1, dt)
    np.testing.assert_allclose(S, z[: n * n].reshape(n, n), rtol=1e-8)
    np.testing.assert_allclose(e, z[n * n :], rtol=1e-8)


def stiff_step(ratio):
    F = np.array([[-0.5, -9.0, 1.0, 0.0], [0.1, -1.0, 90.0, -1.0], [0.0, -0.05, -2.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    W = np.diag([ratio, 1.0, ratio, 0.0])
    C = 2.0 * np.diag([1.0, ratio, 1.0, 10.0])
    return F, W, C


def test_stiff_step_holds_where_the_exponential_and_direct_integration_fail():
    F, W, C = stiff_step(1e8)
    dt, S0 = 0.03, np.eye(4)
    eigenvalues = np.linalg.eigvals(np.block([[F, W], [C, -F.T]]))
    assert np.abs(eigenvalues.real).max() * dt > 100.0
    with np.errstate(all="ignore"):
        S_exponential = oracles.exponential_step(S0, F, W, C, np.zeros(4), np.zeros(4), dt)[0]
        S_direct = S0.copy()
        for _ in range(30):  # (22) by Euler steps of 1 ms
            S_direct = S_direct + 1e-3 * oracles.riccati_rates(F, W, C, S_direct)
    S = S0
    for _ in range(20000):
        S = step(S, F, W, C, np.zeros(4), np.zeros(4), dt)[0]
    scale = np.sqrt(np.diag(S))
    stationary = oracles.riccati_rates(F, W, C, S) / np.outer(scale, scale)
    assert np.abs(stationary).max() < 1e-8 * np.abs(eigenvalues).max()
    assert np.linalg.eigvalsh(S / np.outer(scale, scale)).min() > 0.0
    steps = [np.abs(other / np.outer(scale, scale)).max() for other in (S_exponential, S_direct)]
    assert not any(value < 10.0 for value in steps), "the naive ways no longer fail: the case is not stiff"


def test_stationary_step_is_the_algebraic_riccati_solution():
    S, F, W, C, *_ = random_step(5)
    W = W + 0.1 * np.eye(4)
    for _ in range(400):
        S = step(S, F, W, C, np.zeros(4), np.zeros(4), 0.1)[0]
    w, v = np.linalg.eigh(C)
    root = (v * np.sqrt(np.clip(w, 0.0, None))) @ v.T
    np.testing.assert_allclose(S, solve_continuous_are(F.T, root, W, np.eye(4)), rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize(
    ("ratio", "dt", "reach"), [(1e2, 0.1, 6.0), (1e4, 0.03, 20.0), (1e8, 3e-5, 0.7), (1e8, 1e-3, 20.0)]
)
def test_step_of_extreme_weights_agrees_with_ninety_digits(ratio, dt, reach):
    F, W, C = stiff_step(ratio)
    assert np.abs(np.linalg.eigvals(np.block([[F, W], [C, -F.T]]))).max() * dt > reach
    S0 = np.diag([1.0, 0.1, 0.01, 0.01])
    g0, g1 = np.array([1.0, -2.0, 0.3, 0.1]), np.array([0.7, 1.0, 0.2, -0.1])
    S_exact, e_exact = oracles.decimal_step(S0, F, W, C, g0, g1, dt, digits=90)
    S, e = step(S0, F, W, C, g0, g1, dt)
    scale = np.sqrt(np.diag(S_exact))
    np.testing.assert_allclose(S / np.outer(scale, scale), S_exact / np.outer(scale, scale), atol=1e-12)
    np.testing.assert_allclose(e / scale, e_exact / scale, atol=1e-12 * np.abs(e_exact / scale).max())


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    n=st.integers(1, 6),
    log_measure=st.lists(st.floats(-6.0, 6.0), min_size=6, max_size=6),
    log_error=st.lists(st.one_of(st.floats(-6.0, 6.0), st.just(-np.inf)), min_size=6, max_size=6),
    dt=st.floats(1e-3, 0.1),
)
def test_riccati_matrix_stays_symmetric_positive_definite(seed, n, log_measure, log_error, dt):
    rng = np.random.default_rng(seed)
    F = rng.normal(size=(n, n)) * rng.choice([0.1, 1.0, 10.0])
    W, C = np.diag(10.0 ** np.array(log_error[:n])), np.diag(10.0 ** np.array(log_measure[:n]))
    S = np.diag(10.0 ** rng.uniform(-6, 6, n))
    zero = np.zeros(n)
    for _ in range(50):
        S = step(S, F, W, C, zero, zero, dt)[0]
        assert np.array_equal(S, S.T)
        diagonal = np.diag(S)
        assert np.all(np.isfinite(S))
        assert np.all(diagonal > 0.0)
        # Where no equation is in error S loses rank in truth, and below rounding soon.
        floor = 0.0 if np.all(np.diag(W) > 0.0) else -1e-14 * n
        assert np.linalg.eigvalsh(S / np.sqrt(np.outer(diagonal, diagonal))).min() > floor


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), log_units=st.lists(st.floats(-6.0, 6.0), min_size=4, max_size=4))
def test_state_units_only_rescale(seed, log_units):
    S, F, W, C, g0, g1 = random_step(seed)
    S = S + 0.1 * np.eye(4)
    unit = 10.0 ** np.array(log_units)
    plain, e_plain = step(S, F, W, C, g0, g1, 0.05)
    scaled, e_scaled = step(
        S / np.outer(unit, unit), F * unit / unit[:, None], W / np.outer(unit, unit), C * np.outer(unit, unit),
        g0 * unit, g1 * unit, 0.05,
    )  # fmt: skip
    size = np.sqrt(np.diag(plain))
    np.testing.assert_allclose(scaled * np.outer(unit / size, unit / size), plain / np.outer(size, size), atol=1e-10)
    np.testing.assert_allclose(e_scaled * unit / size, e_plain / size, atol=1e-9 * np.abs(e_plain / size).max())


def test_two_half_steps_make_one_step():
    S, F, W, C, g0, g1 = random_step(3)
    F = 0.0 * F  # the open-loop path from a deviation e then stays at e, and its residual stays linear in time
    middle, half = step(S, F, W, C, g0, 0.5 * (g0 + g1), 0.1)
    again, rest = step(middle, F, W, C, 0.5 * (g0 + g1) - C @ half, g1 - C @ half, 0.1)
    whole, e = step(S, F, W, C, g0, g1, 0.2)
    np.testing.assert_allclose(again, whole, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(half + rest, e, rtol=1e-10, atol=1e-13)


def test_gains_reproduce_the_estimator_step_for_any_residual():
    S, F, W, C, g0, g1 = random_step(8)
    n = len(F)
    S_next, M0, M1 = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    assert gain_step(S, F, W, C, 0.07, S_next, M0, M1, step_work(n, n, n))
    plain, e = step(S, F, W, C, g0, g1, 0.07)
    np.testing.assert_allclose(M0 @ g0 + M1 @ g1, e, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(S_next, plain, rtol=1e-12)


def test_transition_and_its_integrals_against_the_matrix_exponential():
    F = np.random.default_rng(2).normal(size=(4, 4)) * 3.0
    F[:, 3] = 0.0  # singular: theta drives nothing
    n, dt = 4, 0.08
    Phi, Gamma0, Gamma1 = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    assert transition_step(F, dt, Phi, Gamma0, Gamma1, step_work(n, n, n))
    c0, c1 = np.array([1.0, -0.5, 2.0, 0.3]), np.array([0.2, 0.4, -1.0, 0.0])
    A = np.zeros((n + 2, n + 2))
    A[:n, :n], A[:n, n], A[:n, n + 1], A[n + 1, n] = F, c0, (c1 - c0) / dt, 1.0
    M = expm(A * dt)
    np.testing.assert_allclose(Phi, M[:n, :n], rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(Gamma0 @ c0 + Gamma1 @ c1, M[:n, n], rtol=1e-12, atol=1e-15)


def test_step_covariance_is_van_loans():
    F = np.random.default_rng(4).normal(size=(3, 3))
    density, dt = np.diag([1.0, 0.0, 3.0]), 0.2
    big = expm(np.block([[-F, density], [np.zeros((3, 3)), F.T]]) * dt)
    np.testing.assert_allclose(step_covariance(F, density, dt), big[3:, 3:].T @ big[:3, 3:], rtol=1e-11, atol=1e-15)


def test_update_and_prediction_are_equations_9_to_12():
    rng = np.random.default_rng(6)
    n, p = 4, 3
    X, F, H, Q1 = rng.normal(size=(n, n)), rng.normal(size=(n, n)), rng.normal(size=(p, n)), np.diag([1.0, 4.0, 0.3])
    S0, W, r = X @ X.T, np.diag([0.3, 0.0, 1.0, 0.1]), rng.normal(size=p)
    P, S, d = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    HQ, C = np.zeros((n, p)), np.zeros((n, n))
    predict_riccati(F, S0, W, P, step_work(n))
    information(H, Q1, np.array([1.0, 0.0, 1.0]), HQ, C)
    g = HQ @ r
    assert measurement_update(P, C, g, S, d, step_work(n))
    np.testing.assert_allclose(P, F @ S0 @ F.T + W, rtol=1e-13)
    held = np.array([0, 2])
    S_exact = np.linalg.inv(np.eye(n) + 2.0 * P @ H[held].T @ Q1[np.ix_(held, held)] @ H[held]) @ P
    np.testing.assert_allclose(S, S_exact, rtol=1e-10)
    np.testing.assert_allclose(d, 2.0 * S_exact @ H[held].T @ Q1[np.ix_(held, held)] @ r[held], rtol=1e-9)


def test_solver_pivots_and_tells_a_singular_system():
    A = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 3.0], [4.0, 1.0, 0.0]])
    b = np.array([[1.0], [2.0], [3.0]])
    aug = np.hstack([A, b])
    assert solve_in_place(aug, 3, 4)
    np.testing.assert_allclose(aug[:, 3:], np.linalg.solve(A, b), rtol=1e-14)
    assert not solve_in_place(np.zeros((2, 3)), 2, 3)


def test_a_step_that_cannot_be_formed_says_so():
    S, F, W, C, g0, g1 = random_step(1)
    F[0, 0] = np.nan
    n = len(F)
    assert not estimator_step(S, F, W, C, g0, g1, 0.1, np.zeros((n, n)), np.zeros(n), step_work(n))
