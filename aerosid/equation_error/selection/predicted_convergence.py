"""Convergence of residual colours where there are two optima, by the prediction of records that were not fitted.

Terms and colours that are estimated in turn may converge far from where a search left them: to a slower colour that
takes up the motion with what a deficient structure leaves, or, where a trimmed flight contains little motion, to the
likelier derivatives. The likelihood prefers both. Of a Citation's trim curve C_m predicted a phugoid with R^2 of .78 at
one optimum and of .13 at the other, and the declared and the completed model, the same in C_m, ended at different ones.
"""

from __future__ import annotations

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.colour_convergence import converged
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.related_problems import as_compared, weights_restricted_to
from aerosid.equation_error.selection.cross_validation import fits_of

RISE = 1e-3
"""Numerical: rise of R^2, summed over the coefficients, from which one optimum predicts better than another."""


def converged_as_predicted(found: Estimate) -> Estimate:
    """The estimate with its colours converged: near by, or far away where that predicts unseen records better."""
    return converged(found, lambda far: better_predicting(found, far) is far)


def estimated_with_fewer_parts(problem: RegressionProblem, point: Point, completed: Estimate) -> Estimate:
    """The estimate of a part of the completed structure, begun without colours or with that structure's.

    The one that predicts unseen records better: a deficient structure is given its better estimate.
    """
    begun = estimate(problem, point, weights_restricted_to(completed, problem, point))
    return better_predicting(*map(converged_as_predicted, (estimate(problem, point), begun)))


def better_predicting(found: Estimate, other: Estimate) -> Estimate:
    """The other estimate where it predicts the coefficients of the records that are not fitted better, in sum."""
    compared = as_compared(found.problem)
    pairs = zip(fits_of(compared, found), fits_of(compared, other), strict=True)
    rise = sum(after.r2 - before.r2 for before, after in pairs if not before.fitted)
    return other if rise > RISE else found
