"""Standard deviations corrected for what whitening leaves: correlation in time and between equations.

The covariance of generalised least squares is right where the innovations are white and independent. A gust moves
alpha, C_Z and C_m at once, and an autoregression holds a colour only roughly; so the scores of all equations at one
instant are summed and their covariance over neighbouring instants is estimated (Newey & West, Econometrica 55, 1987;
for flight data Morelli & Klein, Journal of Aircraft 34, 1997). The larger of both variances counts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.design import Design, Solution

Array = NDArray[np.float64]

LAGS = 6
"""Numerical: samples in the band over which scores may be correlated; more widen the deviations by their own
scatter."""


def corrected_covariance(design: Design, solution: Solution) -> Array:
    """Covariance (P, P) of the unknowns, its diagonal no smaller than that of generalised least squares."""
    meat = covariance_of_scores(design, solution.slopes * solution.whitened[:, None])
    bread = solution.covariance
    sandwich = bread @ meat @ bread
    samples = design.target.size
    freedom = samples / max(samples - bread.shape[0], 1)
    variance = freedom * np.maximum(np.diag(bread), np.diag(sandwich))
    scale = np.sqrt(variance / np.maximum(np.diag(bread), 1e-300))
    return np.asarray(bread * np.outer(scale, scale))


def covariance_of_scores(design: Design, scores: Array) -> Array:
    """Covariance (P, P) of the sum of scores (R, P), those of all equations at one instant summed (Newey & West)."""
    meat = np.zeros((scores.shape[1], scores.shape[1]))
    for recording in {recording for recording, _ in design.segments}:
        members = [s for s, (place, _) in enumerate(design.segments) if place == recording]
        length = min(design.rows(s).stop - design.rows(s).start for s in members)
        summed = np.zeros((length, scores.shape[1]))
        for s in members:
            rows = design.rows(s)
            summed += scores[rows][:length]
        meat += summed.T @ summed
        for lag in range(1, LAGS + 1):
            part = summed[lag:].T @ summed[:-lag]
            meat += (1.0 - lag / (LAGS + 1.0)) * (part + part.T)
    return meat
