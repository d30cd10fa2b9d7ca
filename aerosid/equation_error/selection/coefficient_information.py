"""What the coefficient equations say of parameters that they do not estimate: Fisher information and score."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import compared_columns
from aerosid.equation_error.regression.estimate import Estimate, effect_sensitivities, linear_values
from aerosid.equation_error.regression.standard_errors import covariance_of_scores

Array = NDArray[np.float64]


def information_on_effects(
    found: Estimate, free_point: Point, parameters: Sequence[tuple[int, int]], shares: Array
) -> tuple[Array, Array]:
    """Fisher information (n, n) on combinations of effect parameters, and its score (n,), linear unknowns eliminated.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations, the effects fixed.
    free_point : Point
        The same point with the effects free.
    parameters : sequence of (int, int)
        Effect and parameter of each of P free parameters.
    shares : ndarray, shape (P, n)
        Change of every parameter with each combination.
    """
    columns = effect_sensitivities(found.problem, linear_values(found.design, found.solution), free_point, parameters)
    return information_on(found, columns @ shares)


def information_on(found: Estimate, columns: Array) -> tuple[Array, Array]:
    """Fisher information (n, n) on parameters with some columns (R, n), and its score (n,), linear unknowns eliminated.

    It is reduced where the whitened residuals remain correlated, as for every other parameter.
    """
    return information_of(found, compared_columns(found.design, columns, found.solution.weights))


def information_of(found: Estimate, white: Array) -> tuple[Array, Array]:
    """The same of columns (R, n) that are whitened and compared already."""
    own = white - found.solution.slopes @ (found.solution.covariance @ (found.solution.slopes.T @ white))
    information, score = own.T @ own, own.T @ found.solution.whitened
    meat = covariance_of_scores(found.design, own * found.solution.whitened[:, None])
    deflation = 1.0 / np.sqrt(np.maximum(np.diag(meat) / np.maximum(np.diag(information), 1e-300), 1.0))
    return information * np.outer(deflation, deflation), score * deflation**2
