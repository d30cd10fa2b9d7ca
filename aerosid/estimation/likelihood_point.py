"""The likelihood at one point: cost, gradient, information, noise variances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, NoiseEffect
from aerosid.estimation import damped_step
from aerosid.estimation.damped_step import Quadratic


@dataclass(frozen=True)
class Point:
    """A set of parameters with the likelihood and its derivatives.

    `values` (T,) of all terms; `states` the initial ones; `effects` with parameters; `variance` (m,) of the output
    noise; `cost` -2 ln L but for a constant. Each output's part at that variance: `normals` (m, M, M) and `gradients`
    (m, M) of the Gauss-Newton step, `squares` (m,) sum of the whitened residuals' squares, `counts` (m,) how many.
    `prior_normal` and `prior_gradient`: of the a-priori information.
    """

    values: NDArray[np.float64]
    states: tuple[NDArray[np.float64], ...]
    effects: tuple[ActiveEffect, ...]
    variance: NDArray[np.float64]
    cost: float
    normals: NDArray[np.float64]
    gradients: NDArray[np.float64]
    squares: NDArray[np.float64]
    counts: NDArray[np.float64]
    prior_normal: NDArray[np.float64]
    prior_gradient: NDArray[np.float64]

    @property
    def quadratic(self) -> Quadratic:
        """The likelihood to second order, as compiled code takes it."""
        arrays = (self.normals, self.gradients, self.squares, self.counts, self.variance)
        return Quadratic(*map(np.ascontiguousarray, (*arrays, self.prior_normal, self.prior_gradient)))

    @property
    def is_disturbed(self) -> bool:
        """Whether gusts or unmodelled forces act, which share the residuals with the outputs' noise."""
        return any(isinstance(active.effect, NoiseEffect) for active in self.effects)

    @property
    def information(self) -> NDArray[np.float64]:
        """Fisher information (M, M), including the a-priori information."""
        return np.asarray(self.normals.sum(axis=0) + self.prior_normal)

    def maximum_likelihood_variance(self, floor: NDArray[np.float64]) -> NDArray[np.float64]:
        """Maximum-likelihood noise variances (m,) of these residuals, at least `floor`."""
        return damped_step.maximum_likelihood_variance(self.quadratic, self.squares, floor)

    def cost_at(self, variance: NDArray[np.float64]) -> float:
        """-2 ln L at other noise variances (m,).

        Exact where the inputs are free of noise; else accurate for small changes, as their part changes little.
        """
        return self.cost + damped_step.change_of_cost(self.quadratic, variance)

    def squares_after(self, step: NDArray[np.float64]) -> NDArray[np.float64]:
        """`squares` (m,) after a step in the parameters (M,), to second order."""
        return damped_step.squares_after(self.quadratic, step)

    def shifted(
        self,
        values: NDArray[np.float64],
        states: Sequence[NDArray[np.float64]],
        effects: Sequence[ActiveEffect],
        variance: NDArray[np.float64],
        fall: float,
    ) -> Point:
        """The point after a step within the linearisation; `fall`: decrease of -2 ln L, noise at `variance` (m,)."""
        ratio = self.variance / variance
        return replace(
            self,
            values=values,
            states=tuple(states),
            effects=tuple(effects),
            variance=variance,
            cost=self.cost_at(variance) - fall,
            normals=ratio[:, None, None] * self.normals,
            gradients=ratio[:, None] * self.gradients,
            squares=ratio * self.squares,
        )
