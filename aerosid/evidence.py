"""How much the data speak for a term: score tests before a fit, corrected deviations after it.

The score test asks what a candidate would gain in likelihood, from its sensitivities through the estimator and without
fitting it. The corrected covariance counts that residuals of real flights are coloured: plain Cramer-Rao deviations
are then several times too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.aerodynamics import Entry
from aerosid.longitudinal import OUTPUT_COUNT
from aerosid.manoeuvre import Manoeuvre
from aerosid.refinement import Refinement, whiten
from aerosid.residual_covariance import coloured_covariance_groups


@dataclass(frozen=True)
class Score:
    """What one candidate would bring.

    Attributes
    ----------
    entry : Entry
        The candidate.
    gain : float
        Expected fall of -2 ln L at the present noise levels; chi-square with one degree of freedom where nothing is
        missing and residuals are white.
    value : float
        The value that a single linear step gives it.
    independence : float
        Share of the candidate's effect that the terms already there cannot imitate, 0 to 1.
    """

    entry: Entry
    gain: float
    value: float
    independence: float


LEAST_INDEPENDENCE = 1e-5
"""Below this share a candidate is another name for terms already there: 0.3 % of its effect is its own."""


def score_candidates(
    refinement: Refinement, manoeuvres: Sequence[Manoeuvre], candidates: Sequence[Entry]
) -> tuple[Score, ...]:
    """The candidates with the gain in likelihood that each alone would bring, greatest first.

    Parameters
    ----------
    refinement : Refinement
        The present estimate.
    manoeuvres : sequence of Manoeuvre
        Those of the estimate.
    candidates : sequence of Entry
        Terms that the model does not hold.

    Notes
    -----
    Rao's score test: with the whitened residual r, the present sensitivities A and the candidate's s, the part of s
    that A cannot imitate is t = s - A (A'A)^-1 A's and the gain is (t'r)^2 / t't.
    """
    if not candidates:
        return ()
    columns = (*refinement.free, *candidates)
    model = refinement.model.extended(candidates)
    held = len(refinement.free)
    size = len(columns) + 5 * len(manoeuvres)
    normal, gradient = np.zeros((size, size)), np.zeros(size)
    for part in whiten(refinement, manoeuvres, model=model, columns=columns):
        flat = part.columns.reshape(-1, part.columns.shape[2])
        residual = np.nan_to_num(part.residual).ravel()
        normal += flat.T @ flat
        gradient += flat.T @ residual
    tested = np.arange(held, held + len(candidates))
    present = np.setdiff1d(np.arange(normal.shape[0]), tested)
    present = present[np.diag(normal)[present] > 0.0]
    scale = np.sqrt(np.diag(normal))[present]
    inner = np.linalg.pinv(normal[np.ix_(present, present)] / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    cross = normal[np.ix_(present, tested)] / scale[:, None]
    own = np.diag(normal)[tested]
    left = own - np.einsum("ij,ik,kj->j", cross, inner, cross)
    slope = gradient[tested] - cross.T @ inner @ (gradient[present] / scale)
    scores = []
    for i, entry in enumerate(candidates):
        independence = float(left[i] / own[i]) if own[i] > 0.0 else 0.0
        usable = independence > LEAST_INDEPENDENCE
        gain = float(slope[i] ** 2 / left[i]) if usable else 0.0
        scores.append(Score(entry, gain, float(slope[i] / left[i]) if usable else 0.0, max(independence, 0.0)))
    return tuple(sorted(scores, key=lambda score: -score.gain))


@dataclass(frozen=True)
class Deviations:
    """Standard deviations of an estimate's parameters.

    Attributes
    ----------
    corrected : ndarray, shape (F,)
        Of the free entries, counting the residuals' colour.
    white : ndarray, shape (F,)
        As if the residuals were white: the Cramer-Rao bound.
    covariance : ndarray, shape (F, F)
        Corrected covariance of the free entries.
    correlation_max : ndarray, shape (F,)
        Largest absolute correlation of each entry with any other parameter of the estimate.
    """

    corrected: NDArray[np.float64]
    white: NDArray[np.float64]
    covariance: NDArray[np.float64]
    correlation_max: NDArray[np.float64]


def deviations(refinement: Refinement, manoeuvres: Sequence[Manoeuvre]) -> Deviations:
    """The estimate's standard deviations, plain and corrected for coloured residuals.

    Notes
    -----
    Morelli & Klein, Journal of Aircraft 34 (2), 1997: the autocorrelation of each output's residual takes the place
    of white noise in the covariance of the estimate.
    """
    groups = []
    for part in whiten(refinement, manoeuvres):
        for i in range(OUTPUT_COUNT):
            held = np.isfinite(part.residual[:, i])
            if held.any():
                groups.append((part.columns[held, i, :], part.residual[held, i], 1.0))
    white = refinement.covariance
    informed = np.isfinite(np.diag(white))
    keep = np.flatnonzero(informed)
    corrected = np.full(white.shape, np.inf)
    corrected[np.ix_(keep, keep)] = coloured_covariance_groups([(x[:, keep], r, w) for x, r, w in groups]).corrected
    free = len(refinement.free)
    spread = np.sqrt(np.diag(white))
    relation = np.zeros_like(white)
    relation[np.ix_(keep, keep)] = white[np.ix_(keep, keep)] / np.outer(spread[keep], spread[keep])
    np.fill_diagonal(relation, 0.0)
    return Deviations(
        corrected=np.sqrt(np.diag(corrected))[:free],
        white=spread[:free],
        covariance=corrected[:free, :free],
        correlation_max=np.max(np.abs(relation), axis=1)[:free] if free else np.zeros(0),
    )
