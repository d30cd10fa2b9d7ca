"""Convergence of terms and residual colours, estimated in turn."""

from __future__ import annotations

from aerosid.equation_error.regression.design import residual_weights, solve
from aerosid.equation_error.regression.estimate import Estimate, estimate

ROUNDS = 20
"""Numerical: times at most that terms and colours are estimated in turn."""

SETTLED = 1e-5
"""Numerical: change of ln L below which that ends."""

COMPARED = 0.02
"""Numerical: loss of ln L beyond which the start is kept; Burg's method only approximates maximum likelihood."""


def converged(found: Estimate) -> Estimate:
    """The estimate with its residuals' colours converged at its point, so that the start of a search leaves no trace.

    A search compares structures to a fraction of one in ln L and ends there; a term of little information may still be
    a few tenths of its standard error from its maximum. On 60 s of a Citation without any effect, C_X alpha as declared
    and as completed, the same structure, differed by 8 %.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
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
    if last.log_likelihood < first.log_likelihood - COMPARED:
        return found
    return estimate(problem, point, last.weights, steps=2)
