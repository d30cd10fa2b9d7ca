"""Fixed-interval solution against dense minimisers of J, boundary-value solvers and textbook smoothers."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import model_error as oracles
from scipy.integrate import solve_bvp
from scipy.optimize import least_squares

from aerosid.model_error.estimators.fixed_interval import fixed_interval_continuous, fixed_interval_discrete
from aerosid.model_error.estimators.functions import Partials
from aerosid.model_error.estimators.weights import Weights

RNG = np.random.default_rng(7)


def linear_record(N=25, n=3, p=2, missing=True):
    F = np.array([0.9 * np.linalg.qr(RNG.normal(size=(n, n)))[0] + 0.1 * RNG.normal(size=(n, n)) for _ in range(N)])
    H = RNG.normal(size=(N, p, n))
    b, y = RNG.normal(size=(N, n)), RNG.normal(size=(N, p))
    if missing:
        y[4, 0] = y[9] = np.nan
    X = RNG.normal(size=(n, n))
    weights = Weights(np.array([[2.0, 0.3], [0.3, 0.7]]), np.diag([0.5, 0.05, 1.5]), np.eye(n) * 0.4 + 0.1 * X @ X.T)
    return F, H, b, y, RNG.normal(size=n), weights


def solve_linear(F, H, b, y, x0, weights):
    return fixed_interval_discrete(
        lambda x, u, j: F[int(j)] @ x + b[int(j)],
        lambda x, u, j: H[int(j)] @ x,
        y,
        x0,
        weights,
        partials=Partials(f_x=lambda x, u, j: F[int(j)], h_x=lambda x, u, j: H[int(j)]),
    )


def test_discrete_linear_solution_is_the_dense_minimiser_of_J_with_its_covariances():
    F, H, b, y, x0, weights = linear_record()
    found = solve_linear(F, H, b, y, x0, weights)
    x, d, x_covariance, d_covariance = oracles.dense_discrete(
        F, H, b, y, x0, weights.Q1, weights.Q2_inverse, weights.S0
    )
    np.testing.assert_allclose(found.states, x, atol=1e-8)
    np.testing.assert_allclose(found.model_error, d, atol=1e-8)
    np.testing.assert_allclose(found.covariance, x_covariance, atol=1e-8)
    np.testing.assert_allclose(found.model_error_covariance, d_covariance, atol=1e-8)
    assert found.converged


def test_discrete_covariances_are_those_of_a_rauch_tung_striebel_smoother():
    F, H, b, y, x0, weights = linear_record(missing=False)
    found = solve_linear(F, H, b, y, x0, weights)
    x, P, D = oracles.rauch_tung_striebel(
        F, H, b, y, x0, 2.0 * weights.S0, weights.Q2_inverse, np.linalg.inv(weights.Q1)
    )
    np.testing.assert_allclose(found.states, x, atol=1e-8)
    np.testing.assert_allclose(found.covariance, P, atol=1e-8)
    np.testing.assert_allclose(found.model_error_covariance, D, atol=1e-8)


def test_discrete_nonlinear_solution_is_the_dense_minimiser_of_J():
    weights = Weights(np.diag([4.0, 9.0]), np.diag([0.1, 0.02]), np.eye(2) * 0.3)
    y = np.random.default_rng(2).normal(size=(30, 2))
    x0 = np.array([0.3, -0.2])

    def f(x, u, j):
        return np.array(
            [0.5 * x[0] + 0.6 * x[1] - 0.05 * x[0] ** 3 + 0.5 * np.cos(0.3 * j), 0.1 * x[1] + 0.1 * x[0] ** 2]
        )

    def h(x, u, j):
        return np.array([x[0] + 0.1 * x[0] ** 2, x[1]])

    found = fixed_interval_discrete(f, h, y, x0, weights)
    assert found.converged

    # The dense minimiser: all states at once, J as a sum of squares, by a library that knows nothing of recursions.
    roots = [
        np.linalg.cholesky(m) for m in (weights.Q1, np.linalg.inv(weights.Q2_inverse), 0.5 * np.linalg.inv(weights.S0))
    ]

    def squares(flat):
        x = flat.reshape(-1, 2)
        parts = [roots[2].T @ (x[0] - x0)]
        parts += [roots[0].T @ (y[j] - h(x[j], None, j)) for j in range(len(y))]
        parts += [roots[1].T @ (x[j + 1] - f(x[j], None, j)) for j in range(len(y) - 1)]
        return np.concatenate(parts)

    dense = least_squares(squares, y.ravel()).x
    for _ in range(40):  # to rounding, which a general minimiser does not reach: its cost no longer changes
        partials = np.column_stack(
            [(squares(dense + step) - squares(dense - step)) / 2e-5 for step in 1e-5 * np.eye(dense.size)]
        )
        dense = dense - np.linalg.lstsq(partials, squares(dense))[0]
    z = found.states
    np.testing.assert_allclose(z, dense.reshape(-1, 2), atol=1e-8)
    np.testing.assert_allclose(found.model_error, [z[j + 1] - f(z[j], None, j) for j in range(len(y) - 1)], atol=1e-8)


def continuous_record(N=21, W2=0.3):
    F = np.array([[0.0, 1.0, 0.2], [-2.0, -0.4, 0.5], [0.0, 0.3, -1.0]])
    H = np.array([[1.0, 0.0, 0.0], [0.0, 0.5, 1.0]])
    time = np.cumsum(np.full(N, 0.1)) - 0.1
    b, y = np.cumsum(RNG.normal(size=(N, 3)), axis=0), np.cumsum(RNG.normal(size=(N, 2)), axis=0)
    weights = Weights(np.diag([3.0, 20.0]), np.diag([0.5, 2.0, W2]), np.eye(3) * 0.4)
    return F, H, b, time, y, np.array([0.2, -0.1, 0.4]), weights


def solve_continuous(F, H, b, time, y, x0, weights):
    return fixed_interval_continuous(
        lambda x, u, t: F @ x + u, lambda x, u, t: H @ x, time, y, x0, weights, u=b,
        partials=Partials(f_x=lambda x, u, t: F, h_x=lambda x, u, t: H),
    )  # fmt: skip


@pytest.mark.parametrize("W2", [0.3, 0.0])
def test_continuous_linear_solution_is_that_of_the_dense_boundary_value_problem(W2):
    F, H, b, time, y, x0, weights = continuous_record(W2=W2)
    time = time + np.where(np.arange(time.size) % 2, 0.03, 0.0)  # uneven
    found = solve_continuous(F, H, b, time, y, x0, weights)
    x, costate = oracles.dense_boundary_value(F, H, b, time, y, x0, weights.Q1, weights.Q2_inverse, weights.S0)
    np.testing.assert_allclose(found.states, x, atol=1e-8)
    np.testing.assert_allclose(found.costate, costate, atol=1e-8 * np.abs(costate).max())
    np.testing.assert_allclose(found.model_error, 0.5 * costate @ weights.Q2_inverse, atol=1e-8)


def test_continuous_linear_solution_minimises_J_by_brute_force():
    F, H, b, time, y, x0, weights = continuous_record(N=9)
    found = solve_continuous(F, H, b, time, y, x0, weights)
    errors = [
        np.abs(
            oracles.fine_grid_minimiser(F, H, b, time, y, x0, weights.Q1, weights.Q2_inverse, weights.S0, cells)
            - found.states
        ).max()
        for cells in (4, 8)
    ]
    assert errors[1] < 3e-4 * np.abs(found.states).max()
    assert 3.5 < errors[0] / errors[1] < 4.5


def test_continuous_covariances_are_those_of_a_smoother_on_a_fine_grid():
    F, H, b, time, y, x0, weights = continuous_record(N=9)
    found = solve_continuous(F, H, b, time, y, x0, weights)
    errors = []
    for cells in (20, 40):
        x, d = oracles.split_covariance(F, H, time, weights.Q1, weights.Q2_inverse, weights.S0, cells)
        errors.append(
            (np.abs(found.covariance - x).max() / np.abs(x).max(),
             np.abs(found.model_error_covariance - d).max() / np.abs(d).max())
        )  # fmt: skip
    assert max(errors[1]) < 1e-4
    assert np.all(np.array(errors[0]) / np.array(errors[1]) > 3.0)


def test_mean_model_error_of_a_step_is_the_average_of_d_over_it():
    F, H, b, time, y, x0, weights = continuous_record(N=9)
    found = solve_continuous(F, H, b, time, y, x0, weights)
    # The same record on a five times finer grid is the same problem, since y and b are linear between the samples.
    fine = np.linspace(time[0], time[-1], 5 * (len(time) - 1) + 1)
    columns = [np.column_stack([np.interp(fine, time, v[:, i]) for i in range(v.shape[1])]) for v in (b, y)]
    finer = solve_continuous(F, H, columns[0], fine, columns[1], x0, weights)
    np.testing.assert_allclose(finer.states[::5], found.states, atol=1e-9)
    np.testing.assert_allclose(finer.model_error_mean.reshape(-1, 5, 3).mean(axis=1), found.model_error_mean, atol=1e-9)
    np.testing.assert_allclose(finer.covariance[::5], found.covariance, atol=1e-9)


def test_continuous_nonlinear_solution_converges_to_the_boundary_value_problem_at_second_order():
    def f(x, u, t):
        return np.array([(2.5 * np.cos(t) - 0.32 * x[0] - 0.4 * x[1] ** 3) / 2.56, x[0]])

    def signal(t):
        return np.array([np.sin(1.1 * t), 0.5 - np.cos(1.1 * t)])

    Q1, Q2_inverse, S0, x0 = np.diag([2.0, 5.0]), np.diag([0.8, 0.0]), np.eye(2) * 0.5, np.array([0.2, -0.3])

    def rates(t, z):
        out = np.empty_like(z)
        for k in range(t.size):
            x, costate = z[:2, k], z[2:, k]
            F = np.array([[-0.32, -1.2 * x[1] ** 2], [2.56, 0.0]]) / 2.56
            out[:2, k] = f(x, None, t[k]) + 0.5 * Q2_inverse @ costate
            out[2:, k] = -F.T @ costate - 2.0 * Q1 @ (signal(t[k]) - x)
        return out

    errors = []
    grid = np.linspace(0.0, 6.0, 61)
    exact = solve_bvp(
        rates,
        lambda a, b: np.concatenate([a[:2] - x0 - S0 @ a[2:], b[2:]]),
        grid,
        np.vstack([signal(grid), np.zeros((2, 61))]),
        tol=1e-9,
        max_nodes=20000,
    )
    assert exact.success
    for N in (61, 121):
        time = np.linspace(0.0, 6.0, N)
        found = fixed_interval_continuous(
            f, lambda x, u, t: x.copy(), time, signal(time).T, x0, Weights(Q1, Q2_inverse, S0)
        )
        assert found.converged
        errors.append(np.abs(found.states - exact.sol(time)[:2].T).max())
        assert np.abs(found.model_error - exact.sol(time)[2:].T @ Q2_inverse * 0.5).max() < 30 * errors[-1]
    assert errors[1] < 1e-3
    assert 3.4 < errors[0] / errors[1] < 4.6
