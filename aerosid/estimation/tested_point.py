"""The likelihood at an estimate with its derivatives in hypotheses that are tested there, one apart from the other.

A catalogue of hypotheses has twenty times the parameters of the estimate. Their products with each other are never
asked for, but within a hypothesis, and are neither computed nor held: the rows of the estimate's own parameters and the
products inside each hypothesis are all that is kept of the information.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.likelihood import Likelihood, Trial, Whitened
from aerosid.estimation.likelihood_point import Point

KEPT = 4_000_000
"""Numerical: size of an estimate's own sensitivities up to which they are kept, 32 MB; those of a longer record are
computed again where they are wanted."""


@dataclass(frozen=True)
class TestedPoint:
    """The likelihood in P parameters of an estimate and in those of hypotheses, M in all.

    `point` the likelihood in the estimate's parameters alone, `own` (P,) their places, in rising order. `rows`
    (m, P, M) of each output's information, `gradients` (m, M). `pairs` (K, 2) of parameters of one hypothesis, each
    with itself and with those after it, in rising order; `products` (m, K) their information. `whitened` the residuals
    and the sensitivities to the estimate's parameters, of one log in one stretch; None of more.
    """

    __test__ = False  # its name is not that of a class of tests

    point: Point
    own: NDArray[np.int64]
    rows: NDArray[np.float64]
    gradients: NDArray[np.float64]
    pairs: NDArray[np.int64]
    products: NDArray[np.float64]
    whitened: Whitened | None = None

    @property
    def information(self) -> NDArray[np.float64]:
        """Of the data, all outputs together (M, M); zero between hypotheses."""
        count = self.gradients.shape[1]
        whole = np.zeros((count, count))
        rows = self.rows.sum(axis=0)
        whole[self.own], whole[:, self.own] = rows, rows.T
        first, second = self.pairs.T
        whole[first, second] = whole[second, first] = self.products.sum(axis=0)
        return whole

    def with_parameters(self, places: Sequence[int]) -> Point:
        """The likelihood in the estimate's parameters and in these (k,) of one hypothesis, in the order here."""
        inside = np.union1d(self.own, np.array(places, dtype=np.int64))
        kept = np.searchsorted(inside, self.own)
        outputs, count = self.rows.shape[0], inside.size
        normals = np.zeros((outputs, count, count))
        rows = self.rows[:, :, inside]
        normals[:, kept], normals[:, :, kept] = rows, rows.transpose(0, 2, 1)
        wanted = np.flatnonzero(np.isin(self.pairs, places).all(axis=1))
        first, second = np.searchsorted(inside, self.pairs[wanted]).T
        normals[:, first, second] = normals[:, second, first] = self.products[:, wanted]
        return replace(
            self.point,
            normals=normals,
            gradients=np.ascontiguousarray(self.gradients[:, inside]),
            prior_normal=np.zeros((count, count)),
            prior_gradient=np.zeros(count),
        )

    def among(self, places: NDArray[np.int64], count: int) -> TestedPoint:
        """The same among `count` parameters, these being at `places` (M,), in rising order."""
        rows = np.zeros((*self.rows.shape[:2], count))
        gradients = np.zeros((self.gradients.shape[0], count))
        rows[:, :, places], gradients[:, places] = self.rows, self.gradients
        return replace(self, own=places[self.own], rows=rows, gradients=gradients, pairs=places[self.pairs])

    def beside(self, other: TestedPoint) -> TestedPoint:
        """With the hypotheses of another one at the same estimate, both `among` the same parameters."""
        pairs, first = np.unique(np.concatenate([self.pairs, other.pairs]), axis=0, return_index=True)
        return replace(
            self,
            rows=np.where(self.rows != 0.0, self.rows, other.rows),
            gradients=np.where(self.gradients != 0.0, self.gradients, other.gradients),
            pairs=pairs,
            products=np.concatenate([self.products, other.products], axis=1)[:, first],
        )


def tested_point(
    likelihood: Likelihood, trial: Trial, own: NDArray[np.int64], groups: Sequence[Sequence[int]]
) -> TestedPoint:
    """The likelihood at a trial, with derivatives in what it tests.

    Parameters
    ----------
    likelihood : Likelihood
        Its free terms are those of the estimate and of the hypotheses; what is known a priori is left out.
    trial : Trial
        The estimate, and the effects of the hypotheses.
    own : (P,) int
        Places of the estimate's parameters, in rising order.
    groups : sequence of sequence of int
        Places of each hypothesis' parameters, which are all others.

    Raises
    ------
    OutOfRangeError
        Where the simulation leaves the model's range.
    """
    within = {pair for group in groups for pair in combinations_with_replacement(sorted(group), 2)}
    pairs = np.array(sorted(within), dtype=np.int64).reshape(-1, 2)
    count, outputs = likelihood.parameter_count((*trial.effects, *trial.tested)), likelihood.output_count
    # The residual comes first, before the columns of parameters, as in a block.
    kept = np.concatenate([[0], 1 + own])
    rows, products = np.zeros((outputs, kept.size, 1 + count)), np.zeros((outputs, len(pairs)))
    counts, log_sum = np.zeros(outputs), 0.0
    whitened: Whitened | None = None
    for part in likelihood.whitened(trial):
        held = np.count_nonzero(part.held, axis=0)
        joint = np.concatenate([[0], 1 + likelihood.places(part.log, count)])
        here = np.full(1 + count, -1)
        here[joint] = np.arange(joint.size)
        present = np.flatnonzero(here[kept] >= 0)
        first, second = here[1 + pairs].T
        for i in np.flatnonzero(held):
            block = np.ascontiguousarray(part.block[:, i])
            rows[i, present[:, None], joint] += block[:, here[kept[present]]].T @ block
            products[i] += np.einsum("np,np->p", block[:, first], block[:, second])
        counts += held
        log_sum += part.log_sum
        is_all = len(likelihood.manoeuvres) == 1 and part.held.shape[0] == likelihood.manoeuvres[0].flight.time.size
        if is_all and part.held.size * own.size <= KEPT:
            residual = np.where(part.held, part.block[:, :, 0], np.nan)
            whitened = Whitened(part.log, residual, part.block[:, :, 1 + own], part.predicted, part.log_sum)
    squares = rows[:, 0, 0].copy()
    point = Point(
        values=np.array(trial.values),
        states=tuple(np.array(state) for state in trial.states),
        effects=tuple(trial.effects),
        variance=trial.variance,
        cost=log_sum + float(squares.sum()),
        normals=np.ascontiguousarray(rows[:, 1:, kept[1:]]),
        gradients=np.ascontiguousarray(rows[:, 0, kept[1:]]),
        squares=squares,
        counts=counts,
        prior_normal=np.zeros((own.size, own.size)),
        prior_gradient=np.zeros(own.size),
    )
    return TestedPoint(point, own, rows[:, 1:, 1:], rows[:, 0, 1:].copy(), pairs, products, whitened)
