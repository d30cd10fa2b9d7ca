"""Section 3.2: the continuous system (30), (31), its deficient models, and table 2."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.functions import model_functions
from aerosid.model_error.estimators.initial_states import estimate_forward_backward
from aerosid.model_error.estimators.weights import Weights, continuous_weights
from aerosid.studies.paper.discrete_example import Case
from aerosid.studies.paper.polynomial_fit import PolynomialFit, fit_polynomial

Array = NDArray[np.float64]

TRUTH = (-0.125, -0.390625, 0.0, -0.01953125)
"""Published: a1 (X1), a2 (X2), a3 (X2^2), a4 (X2^3): -0.32, -1, 0 and -0.05 over 2.56."""

TERMS = ("X1", "X2", "X2^2", "X2^3")
START = (1.0, 0.5)
"""Published: x(0) [1, 1]; not printed in the paper."""

INTERVAL = 0.1
"""Published: s; not printed in the paper."""

POINTS = 300
"""Published: samples."""


CASES = (
    Case("I", (3,), (2, 3), POINTS),
    Case("II", (1, 3), (1, 2, 3), POINTS),
    Case("III", (0, 1, 3), (0, 1, 2, 3), POINTS),
    Case("IV", (0, 1, 3), (0, 1, 2, 3), 60),
)
"""Case II is that of figure 3; the others by analogy with table 1, since table 2's rows are illegible in the scan."""


def weights(interval: float = INTERVAL, density: float = 1.0) -> Weights:
    """Samples accurate to 1e-3, a model error of this density in (30), none in (31) (X2' = X1 is kinematics)."""
    return continuous_weights(np.eye(2) * 1e-6, interval, np.diag([density, 0.0]), np.eye(2))


def model(kept: tuple[float, float, float, float]) -> Callable[[Array, Array, float], Array]:
    """Rates f of (30), (31) with these coefficients of X1, X2, X2^2 and X2^3."""
    a1, a2, a3, a4 = kept

    def f(x: Array, u: Array, t: float) -> Array:  # noqa: ARG001
        rate = 2.5 / 2.56 * np.cos(t) + a1 * x[0] + a2 * x[1] + a3 * x[1] ** 2 + a4 * x[1] ** 3
        return np.array([rate, x[0]])

    return f


def observe(x: Array, u: Array, t: float) -> Array:  # noqa: ARG001
    """Both states are measured: H = I."""
    return x.copy()


def true_states(time: Array) -> Array:
    """X at the times, (N, 2), by fine Runge-Kutta steps."""
    f = model((TRUTH[0], TRUTH[1], TRUTH[2], TRUTH[3]))
    step = model_functions(f, observe, n=2, p=2, substeps=10).step
    states, none = [np.array(START)], np.empty(0)
    for k in range(time.size - 1):
        states.append(step(states[-1], none, none, float(time[k]), float(time[k + 1] - time[k])))
    return np.array(states)


def candidate_columns(states: Array) -> Array:
    """X1, X2, X2^2 and X2^3 at the states, (N, 4)."""
    return np.column_stack([states[:, 0], states[:, 1], states[:, 1] ** 2, states[:, 1] ** 3])


def solve_case(
    case: Case,
    *,
    interval: float = INTERVAL,
    density: float = 1.0,
    start: tuple[float, float] = START,
    backward_runs: int = 0,
    skipped: int = 0,
    responded: bool = True,
    initial_covariance: float = 1.0,
) -> PolynomialFit:
    """One row of table 2.

    Parameters
    ----------
    case : Case
    interval : float
        s.
    density : float
        Of the model error in (30).
    start : (float, float)
        Initial state given to the estimator.
    backward_runs : int
        Forward-backward iterations.
    skipped : int
        First points excluded from the least squares.
    responded : bool
        Whether candidates pass through the estimator; otherwise d^ of (23) is regressed on the candidates themselves.
    initial_covariance : float
        Prior variance of the initial states.
    """
    time = interval * np.arange(float(case.points))
    measured = true_states(time)
    a1, a2, a3, a4 = (0.0 if i in case.lacking else value for i, value in enumerate(TRUTH))
    f, used = model((a1, a2, a3, a4)), weights(interval, density)
    used = Weights(used.Q1, used.Q2_inverse, 0.5 * initial_covariance * np.eye(2))
    if backward_runs:
        history = estimate_forward_backward(f, observe, time, measured, start, used, iterations=backward_runs)
    else:
        history = estimate_continuous(f, observe, time, measured, start, used)
    values = fit_polynomial(
        history, candidate_columns(history.states), case.estimated, skipped=skipped, responded=responded
    )
    truth: dict[str, float | None] = {
        name: (TRUTH[i] if i in case.estimated else None) for i, name in enumerate(("a1", "a2", "a3", "a4"))
    }
    return PolynomialFit(case.name, tuple(TERMS[i] for i in case.lacking), values, truth, case.points, history)
