"""Convergence of terms and residual colours, estimated in turn."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aerosid.equation_error.regression.design import residual_weights
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.least_squares import solve

ROUNDS = 20
"""Numerical: times at most that terms and colours are estimated in turn."""

SETTLED = 1e-5
"""Numerical: change of ln L below which that ends."""

COMPARED = 0.02
"""Numerical: loss of ln L beyond which the start is kept; Burg's method only approximates maximum likelihood."""

NEAR = 1.0
"""Numerical: standard errors by which a term may move. Beyond, colours and terms converge elsewhere: to a slower colour
that takes up what a deficient structure leaves, and with it the motion (Citation short period, C_m as declared)."""


def converged(found: Estimate, is_better: Callable[[Estimate], bool] | None = None) -> Estimate:
    """The estimate with its residuals' colours converged at its point, so that the start of a search leaves no trace.

    A search compares structures to a fraction of one in ln L and ends there; a term of little information may still be
    a few tenths of its standard error from its maximum. On 60 s of a Citation without any effect, C_X alpha as declared
    and as completed, the same structure, differed by 8 %.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    is_better : callable, optional
        Whether an estimate that converged elsewhere is to be taken; by default the estimate as found is kept.
    """
    problem, point = found.problem, found.point
    design, weights = problem.design(point), found.solution.weights
    first = last = solve(design, weights)
    for _ in range(ROUNDS):
        weights = residual_weights(design, last.residuals, problem.settings)
        again = solve(design, weights)
        is_settled = abs(again.log_likelihood - last.log_likelihood) < SETTLED
        last = again
        if is_settled:
            break
    error = np.sqrt(np.maximum(np.diag(first.covariance), 1e-300))
    terms = [p for p, unknown in enumerate(design.unknowns) if unknown[0] == "term"]
    moved = (np.abs(last.values - first.values) / error)[terms]
    is_far = bool(np.any(moved > NEAR))
    if last.log_likelihood < first.log_likelihood - COMPARED or (is_far and is_better is None):
        return found
    other = estimate(problem, point, last.weights, steps=2)
    return found if is_far and is_better is not None and not is_better(other) else other
