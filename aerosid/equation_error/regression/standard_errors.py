"""Standard errors corrected for residual correlation in time and between equations, and for few events.

The covariance of generalised least squares is valid where the innovations are white and independent. A gust affects
alpha, C_Z and C_m at once, and an autoregression models a colour only roughly. The information on a derivative lies in
a few steps of a control, where the residual is largest too: the covariance of summed scores (Newey & West, Econometrica
55, 1987; for flight data Morelli & Klein, Journal of Aircraft 34, 1997) is then too small, for the fit follows those
events. So contiguous blocks of all equations together are deleted one after the other and the changes of the parameters
squared and summed: the delete-a-block jackknife (Kuensch, Annals of Statistics 17, 1989), of clustered residuals the
form CR3 (Bell & McCaffrey, Survey Methodology 28, 2002). Where equations are compared by instrumental variables rows
cannot be deleted, and the summed scores are taken. The larger of both variances counts.

CR3 is too large where one block alone determines a parameter: appropriate for one that only one event shows, too strict
for one that another record replicates. For those the bias-reduced form CR2 (the same authors) is used, whose mean is
the variance wherever the weights are right.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.points import Unknown
from aerosid.equation_error.regression.design import Design
from aerosid.equation_error.regression.least_squares import Solution
from aerosid.equation_error.settings import DEVIATIONS

Array = NDArray[np.float64]


CR3, CR2 = 1.0, 0.5
"""Published: powers of one less its leverage by which a block's residual is divided, of CR3 and CR2."""


def corrected_covariance(design: Design, solution: Solution, confirmed: Collection[Unknown] = ()) -> Array:
    """Covariance (P, P) of the unknowns, its diagonal no smaller than that of generalised least squares.

    `confirmed`: the unknowns replicated by a record outside this regression.
    """
    bread = solution.covariance
    samples = design.target.size
    freedom = samples / max(samples - bread.shape[0], 1)
    plain = freedom * np.diag(bread)
    if any(instruments is not None for instruments in design.instruments):
        meat = covariance_of_scores(design, solution.slopes * solution.whitened[:, None])
        other = freedom * np.diag(bread @ meat @ bread)
    else:
        other = np.sum(block_deletion_changes(design, solution) ** 2, axis=0)
        shown = [design.unknowns.index(unknown) for unknown in confirmed]
        if shown:
            reduced = block_deletion_changes(design, solution, CR2)
            other[shown] = np.sum(reduced[:, shown] ** 2, axis=0)
    scale = np.sqrt(np.maximum(plain, other) / np.maximum(np.diag(bread), 1e-300))
    return np.asarray(bread * np.outer(scale, scale))


def block_deletion_changes(design: Design, solution: Solution, power: float = CR3) -> Array:
    """Changes of the parameters when each block of a record is deleted, (B, P).

    With the slopes S_b and innovations e_b of a block and the covariance C of the parameters, C S_b' (1 - S_b C
    S_b')^-1 e_b: no regression is repeated. `power`: exponent in place of that -1, for the bias-reduced form.
    """
    bread, changes = solution.covariance, []
    for deleted in rows_of_blocks(design):
        slopes = solution.slopes[deleted]
        leverages, directions = np.linalg.eigh(slopes @ bread @ slopes.T)
        rest = 1.0 - np.clip(leverages, 0.0, DEVIATIONS.most_followed)
        rotated = directions.T @ solution.whitened[deleted] / rest**power
        changes.append(bread @ (slopes.T @ (directions @ rotated)))
    return np.array(changes)


def rows_of_blocks(design: Design) -> Iterator[NDArray[np.int64]]:
    """The rows of each block of each record, of all its equations together."""
    for recording in sorted({recording for recording, _ in design.segments}):
        members = [design.rows(s) for s, (index, _) in enumerate(design.segments) if index == recording]
        length = min(rows.stop - rows.start for rows in members)
        count = max(length // max(min(DEVIATIONS.lags + 1, length // DEVIATIONS.fewest_blocks), 1), 1)
        edges = np.linspace(0, length, count + 1).astype(np.int64)
        for first, stop in pairwise(edges.tolist()):
            yield np.concatenate([np.arange(rows.start + first, rows.start + stop) for rows in members])


def covariance_of_scores(design: Design, scores: Array) -> Array:
    """Covariance (P, P) of the sum of scores (R, P), those of all equations at one instant summed (Newey & West)."""
    meat = np.zeros((scores.shape[1], scores.shape[1]))
    for recording in {recording for recording, _ in design.segments}:
        members = [s for s, (index, _) in enumerate(design.segments) if index == recording]
        length = min(design.rows(s).stop - design.rows(s).start for s in members)
        summed = np.zeros((length, scores.shape[1]))
        for s in members:
            rows = design.rows(s)
            summed += scores[rows][:length]
        meat += summed.T @ summed
        for lag in range(1, DEVIATIONS.lags + 1):
            part = summed[lag:].T @ summed[:-lag]
            meat += (1.0 - lag / (DEVIATIONS.lags + 1.0)) * (part + part.T)
    return meat
