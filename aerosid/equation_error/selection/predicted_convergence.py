"""Convergence of residual colours where there are two optima, by the prediction of records that were not fitted.

Terms and colours that are estimated in turn may converge far from where a search left them: to a slower colour that
takes up the motion with what a deficient structure leaves, or, where a trimmed flight contains little motion, to the
likelier derivatives. The likelihood prefers both. Of a Citation's trim curve C_m predicted a phugoid with R^2 of .78 at
one optimum and of .13 at the other, and the declared and the completed model, the same in C_m, ended at different ones.
"""

from __future__ import annotations

import math

from aerosid.equation_error.regression.colour_convergence import converged
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.related_problems import as_compared
from aerosid.equation_error.selection.cross_validation import fits_of

RISE = 1e-3
"""Numerical: rise of R^2, summed over the coefficients, from which one optimum predicts better than another."""


def converged_as_predicted(found: Estimate) -> Estimate:
    """The estimate with its colours converged: near by, or far away where that predicts unseen records better."""
    near = converged(found)
    if near is not found:
        return near
    return better_predicting(found, converged(found, math.inf))


def better_predicting(found: Estimate, other: Estimate) -> Estimate:
    """The other estimate where it predicts the coefficients of the records that are not fitted better, in sum."""
    if other is found:
        return found
    compared = as_compared(found.problem)
    pairs = zip(fits_of(compared, found), fits_of(compared, other), strict=True)
    rise = sum(after.r2 - before.r2 for before, after in pairs if not before.fitted)
    return other if rise > RISE else found
