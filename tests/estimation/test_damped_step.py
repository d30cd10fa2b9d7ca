"""The compiled damped step: against dense algebra, and against the concentrated likelihood that it maximises."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.optimize import minimize

from aerosid.estimation.damped_step import Quadratic, damped_newton_step, predicted_decrease

Array = NDArray[np.float64]
FLOOR = np.full(8, 1e-12)
MEASURED = np.array([0, 1, 2, 4, 5])
ALL = np.ones(6, dtype=bool)


def problem(seed: int = 1, count: int = 6) -> tuple[Quadratic, list[tuple[Array, Array]]]:
    """Whitened residuals and sensitivities of some outputs, and their likelihood to second order."""
    rng = np.random.default_rng(seed)
    normals, gradients = np.zeros((8, count, count)), np.zeros((8, count))
    squares, counts, rows = np.zeros(8), np.zeros(8), []
    truth = rng.standard_normal(count)
    for i in MEASURED:
        samples = 40 + 10 * int(i)
        columns = rng.standard_normal((samples, count)) * np.geomspace(1.0, 30.0, count)
        residual = columns @ truth * 0.1 * (i + 1) + rng.standard_normal(samples) * (0.5 + 0.3 * i)
        normals[i], gradients[i] = columns.T @ columns, residual @ columns
        squares[i], counts[i] = residual @ residual, samples
        rows.append((columns, residual))
    variance = np.geomspace(1e-4, 1e2, 8)
    return Quadratic(normals, gradients, squares, counts, variance, np.zeros((count, count)), np.zeros(count)), rows


def concentrated(rows: list[tuple[Array, Array]], step: Array) -> float:
    """-2 ln L after a step, noise variances at their maximum, but for a constant."""
    return sum(float(r.size * np.log(np.mean((r - x @ step) ** 2))) for x, r in rows)


def test_a_held_step_without_damping_solves_the_normal_equations_of_the_active_parameters() -> None:
    quadratic, rows = problem()
    active = np.array([True, True, False, True, True, True])
    step, variance, size, before_step, at_final_variance, after_step = damped_newton_step(
        quadratic, active, 0.0, FLOOR, True, 20, 1.0, 0.01
    )
    stacked, residual = np.vstack([x for x, _ in rows]), np.concatenate([r for _, r in rows])
    wanted = np.linalg.lstsq(stacked[:, active], residual)[0]
    assert_allclose(step[active], wanted, rtol=1e-9)
    assert step[2] == 0.0
    assert_allclose(variance, quadratic.variance, rtol=0.0)
    assert size == pytest.approx(np.max(np.abs(wanted) * np.linalg.norm(stacked[:, active], axis=0)), rel=1e-9)
    assert (before_step, at_final_variance) == (0.0, 0.0)
    fall = np.sum((residual - stacked @ step) ** 2) - np.sum(residual**2)
    assert after_step == pytest.approx(fall, rel=1e-9)


def test_damping_and_prior_enter_as_in_the_textbook() -> None:
    quadratic, _ = problem()
    prior = np.diag(np.arange(1.0, 7.0) ** 4)
    quadratic = quadratic._replace(prior_normal=prior, prior_gradient=np.linspace(-50.0, 50.0, 6))
    step, *_ = damped_newton_step(quadratic, ALL, 0.3, FLOOR, True, 1, 1.0, 0.01)
    normal = quadratic.normals.sum(axis=0) + prior
    damped = normal + 0.3 * np.diag(np.diag(normal))
    assert_allclose(
        step, np.linalg.solve(damped, quadratic.gradients.sum(axis=0) + quadratic.prior_gradient), rtol=1e-9
    )


def test_rounds_converge_to_the_joint_maximum_of_parameters_and_variances() -> None:
    quadratic, rows = problem()
    step, variance, _, before_step, _, after_step = damped_newton_step(
        quadratic, ALL, 0.0, FLOOR, False, 200, 1.0, 1e-13
    )
    scale = 1.0 / np.linalg.norm(np.vstack([x for x, _ in rows]), axis=0)
    best = minimize(lambda z: concentrated(rows, z * scale), step / scale * 0.9, method="BFGS", options={"gtol": 1e-7})
    assert_allclose(step, best.x * scale, rtol=1e-5)
    left = [np.mean((r - x @ step) ** 2) for x, r in rows]
    assert_allclose(variance[MEASURED], quadratic.variance[MEASURED] * left, rtol=1e-9)
    assert_allclose(variance[[3, 6, 7]], quadratic.variance[[3, 6, 7]], rtol=0.0)
    # The variances before are the maximum-likelihood ones of the residuals; the decrease is the difference.
    samples = np.array([r.size for _, r in rows])
    residual = np.array([np.mean(r**2) for _, r in rows])
    assert before_step == pytest.approx(np.sum(samples * (1.0 - residual + np.log(residual))), rel=1e-9)
    assert after_step - before_step == pytest.approx(
        concentrated(rows, step) - concentrated(rows, np.zeros(6)), rel=1e-9
    )


def test_the_predicted_decrease_is_that_of_the_concentrated_likelihood() -> None:
    quadratic, rows = problem(2)
    weights = [1.0 / np.mean(r**2) for _, r in rows]
    normal = sum(w * x.T @ x for (x, _), w in zip(rows, weights, strict=True))
    step = np.linalg.solve(normal, sum(w * r @ x for (x, r), w in zip(rows, weights, strict=True)))
    wanted = concentrated(rows, np.zeros(6)) - concentrated(rows, step)
    fall = sum(r.size * (np.mean(r**2) - 1.0 - np.log(np.mean(r**2))) for _, r in rows)
    found = predicted_decrease(quadratic, ALL, FLOOR)
    # Counted from the variances of the point, at which -2 ln L is not yet the least.
    assert found - fall == pytest.approx(wanted, rel=1e-6)


def test_no_variance_falls_below_its_floor() -> None:
    quadratic, _ = problem()
    floor = np.where(np.arange(8) == 1, 10.0 * quadratic.variance * quadratic.squares[1], FLOOR)
    _, variance, *_ = damped_newton_step(quadratic, ALL, 0.0, floor, False, 20, 1.0, 0.01)
    assert variance[1] == floor[1]
    assert variance[2] > floor[2]


def test_an_information_with_nan_gives_no_step() -> None:
    quadratic, _ = problem()
    quadratic.normals[1, 2, 2] = np.inf
    step, _, size, _, _, after_step = damped_newton_step(quadratic, ALL, 1e-3, FLOOR, False, 20, 1.0, 0.01)
    assert np.isnan(step).all()
    assert np.isnan(size)
    assert np.isnan(after_step)
