"""Generalised least squares at given weights, and alternating with the residuals' colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.regression.design import (
    Design,
    Weights,
    compared,
    coordinates,
    residual_weights,
    uses_no_instruments,
    weights_of_white_noise,
    white_weights,
    whiten,
    whitened_instruments,
)
from aerosid.equation_error.regression.inverse_information import inverse_of_shown
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ComparedColumns:
    """Whitened columns (R, P), projected when they are asked for: most solutions are those of a search's next step."""

    design: Design
    white: Array
    bases: Sequence[Array | None]

    @cached_property
    def columns(self) -> Array:
        """Each segment's columns, projected on its whitened instruments."""
        return compared(self.design, self.white, self.bases)

    def beside(self, projected: Array) -> ComparedColumns:
        """The columns beside further ones (R, K), whitened and projected."""
        return ComparedColumns(self.design, np.column_stack([self.columns, projected]), (None,) * len(self.bases))


@dataclass(frozen=True)
class Solution:
    """Generalised least squares at given weights, and its likelihood.

    `values` (P,) of the unknowns, `covariance` (P, P) with the innovations' sizes, `residuals` (R,), `log_likelihood`
    of all segments, `whitened` (R,) innovations over their sizes; `compared` the whitened columns; `penalty`: reduction
    of ln L by the unknowns' prior, by disagreement with declared values and by the determinant of the motion's density.
    """

    values: Array
    covariance: Array
    residuals: Array
    weights: Weights
    log_likelihood: float
    whitened: Array = field(repr=False)
    compared: ComparedColumns = field(repr=False)
    penalty: float = 0.0

    @property
    def slopes(self) -> Array:
        """The whitened columns (R, P), each segment's projected on its instrumental variables."""
        return self.compared.columns


def solve(design: Design, weights: Weights) -> Solution:
    """Generalised least squares at given weights; unidentifiable unknowns stay zero with infinite deviation."""
    white = whiten(design, design.target_and_columns, weights)
    bases = whitened_instruments(design, weights)
    rows = coordinates(design, white, bases)
    gram, information = design.normal_equations(rows[:, 1:], rows[:, 0])
    if design.declared is not None and design.declared.inform:
        places, precisions = design.declared.places, design.declared.precisions
        gram[places, places] += precisions
        information[places] += precisions * design.declared.values
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scales = np.outer(scale, scale)
    covariance = inverse_of_shown(gram / scales) / scales
    values, log_determinant = covariance @ information, 0.0
    if design.density is not None:
        values, log_determinant = design.density.likeliest(values, covariance)
    innovations = white[:, 0] - white[:, 1:] @ values
    residuals = design.target - design.columns @ values
    penalty = 0.5 * float(np.sum((design.inverse_deviations * values) ** 2)) - log_determinant
    if design.expected is not None:
        penalty += design.expected.disagreement(values)
    if design.declared is not None:
        penalty += design.declared.disagreement(values, covariance)
    return Solution(
        values,
        covariance,
        residuals,
        weights,
        sum(log_likelihoods(design, innovations, weights, bases)) - penalty,
        innovations,
        ComparedColumns(design, white[:, 1:], bases),
        penalty,
    )


def log_likelihoods(
    design: Design, innovations: Array, weights: Weights, bases: Sequence[Array | None] | None = None
) -> list[float]:
    """Ln L of each segment up to a constant, `innovations` (R,) over their sizes, `bases` as of the instruments."""
    bases = whitened_instruments(design, weights) if bases is None else bases
    each = []
    for s, colour in enumerate(weights.colours):
        part, basis = innovations[design.rows(s)], bases[s]
        if basis is None:
            each.append(-0.5 * float(part @ part) - part.size * float(np.log(weights.sizes[s])) - colour.log_start)
        else:
            along = basis.T @ part
            each.append(-0.5 * float(along @ along) - along.size * float(np.log(weights.sizes[s])))
    return each


def uncoloured(design: Design, residuals: Array) -> Solution:
    """Least squares with each segment's size alone: a slow effect before the colour absorbs it."""
    return solve(design, weights_of_white_noise(design, residuals))


def regress(
    design: Design,
    settings: EquationErrorSettings,
    start: Weights | Solution | None = None,
    rounds: int = 3,
) -> Solution:
    """Least squares and the residuals' colours and sizes, alternating.

    `start`: initial noise model, or the design's solution with it where that is known.
    """
    solution = start if isinstance(start, Solution) else solve(design, start or white_weights(design))
    for _ in range(rounds if start else rounds + 3):
        weights = residual_weights(design, solution.residuals, settings)
        found = solve(design, weights)
        if start and found.log_likelihood < solution.log_likelihood and uses_no_instruments(design):
            break  # a colour by Burg's method that is less likely than the one before
        done = abs(found.log_likelihood - solution.log_likelihood) < 0.02
        solution = found
        if done and start:
            break
    return solution
