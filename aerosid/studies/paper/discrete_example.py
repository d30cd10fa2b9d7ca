"""Section 3.1: the discrete system (27), (28), its deficient models, and table 1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.model_error.estimators.discrete import estimate_discrete
from aerosid.model_error.estimators.fixed_interval import fixed_interval_discrete
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.weights import Weights, discrete_weights
from aerosid.studies.paper.polynomial_fit import PolynomialFit, fit_polynomial

Array = NDArray[np.float64]

TRUTH = (0.5, 0.623, 0.0, -0.05)
"""Published: a1 (X1), a2 (X2), a3 (X1^2), a4 (X1^3) of (27)."""

TERMS = ("X1", "X2", "X1^2", "X1^3")
START = (1.0, 0.5)
"""Published: x(0); not printed in the paper."""

POINTS = 100
"""Published: samples."""


@dataclass(frozen=True)
class Case:
    """One row of table 1 or 2: the terms that the model lacks, the terms estimated, and the number of points."""

    name: str
    lacking: tuple[int, ...]
    estimated: tuple[int, ...]
    points: int


CASES = (
    Case("I", (3,), (2, 3), POINTS),
    Case("II", (0, 3), (0, 2, 3), POINTS),
    Case("III", (0, 1, 3), (0, 1, 2, 3), POINTS),
    Case("IV", (0, 1, 3), (0, 1, 2, 3), 6),
)


def weights() -> Weights:
    """Measurements accurate to 1e-3, a model error of the order of the states, prior deviation of states about 1."""
    return discrete_weights(np.eye(2) * 1e-6, np.eye(2), np.eye(2))


def model(kept: tuple[float, float, float, float], squared: bool = False) -> Callable[[Array, Array, float], Array]:
    """Map f of (27), (28) with these coefficients of X1, X2, X1^2 and X1^3.

    Parameters
    ----------
    kept : tuple of float
    squared : bool
        Whether the X2 term of (28) is squared, which is illegible in the scan.
    """
    a1, a2, a3, a4 = kept

    def f(x: Array, u: Array, j: float) -> Array:  # noqa: ARG001
        first = a1 * x[0] + a2 * x[1] + a3 * x[0] ** 2 + a4 * x[0] ** 3 + 2.5 * np.cos(0.3 * j)
        second = 0.1 * (x[1] ** 2 if squared else x[1]) + 0.1 * np.cos(0.3 * j)
        return np.array([first, second])

    return f


def observe(x: Array, u: Array, j: float) -> Array:  # noqa: ARG001
    """Both states are measured: H = I."""
    return x.copy()


def true_states(points: int = POINTS, squared: bool = False) -> Array:
    """X(0) .. X(points - 1) of the true system, (points, 2)."""
    f, states = model((TRUTH[0], TRUTH[1], TRUTH[2], TRUTH[3]), squared), [np.array(START)]
    for j in range(points - 1):
        states.append(f(states[-1], np.empty(0), float(j)))
    return np.array(states)


def deficient(case: Case, squared: bool = False) -> Callable[[Array, Array, float], Array]:
    """Map f of a case: the true model without its missing terms."""
    a1, a2, a3, a4 = (0.0 if i in case.lacking else value for i, value in enumerate(TRUTH))
    return model((a1, a2, a3, a4), squared)


def candidate_columns(states: Array) -> Array:
    """X1, X2, X1^2 and X1^3 at the states, (N, 4)."""
    return np.column_stack([states[:, 0], states[:, 1], states[:, 0] ** 2, states[:, 0] ** 3])


def solve_case(
    case: Case,
    *,
    squared: bool = False,
    start: tuple[float, float] = START,
    skipped: int = 0,
    first_measured: bool = True,
    restart: bool = False,
) -> PolynomialFit:
    """One row of table 1.

    Parameters
    ----------
    case : Case
    squared : bool
        As for `model`; the same for truth and model.
    start : (float, float)
        Initial state given to the estimator.
    skipped : int
        First points excluded from the least squares.
    first_measured : bool
        Whether Y(0) is used; (9) begins with Y(1).
    restart : bool
        Whether the recursion starts from the x(0) of the fixed-interval solution of the same record.
    """
    measured = true_states(case.points, squared)
    if not first_measured:
        measured[0] = np.nan
    f, used = deficient(case, squared), weights()
    x0 = np.array(start)
    if restart:
        x0 = fixed_interval_discrete(f, observe, measured, x0, used).states[0]
    history: ModelErrorHistory = estimate_discrete(f, observe, measured, x0, used)
    # d^(j) belongs to the step j -> j + 1, which begins at x^(j).
    values = fit_polynomial(history, candidate_columns(history.states[:-1]), case.estimated, skipped=skipped)
    truth: dict[str, float | None] = {
        name: (TRUTH[i] if i in case.estimated else None) for i, name in enumerate(("a1", "a2", "a3", "a4"))
    }
    return PolynomialFit(case.name, tuple(TERMS[i] for i in case.lacking), values, truth, case.points, history)
