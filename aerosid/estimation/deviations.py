"""Standard deviations of an estimate: plain Cramer-Rao, as published, and corrected for coloured residuals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.fit_settings import RESIDUAL_TESTS
from aerosid.estimation.likelihood import Whitened
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, whiten
from aerosid.signals.residual_covariance import coloured_covariance_groups, published_covariance_groups


@dataclass(frozen=True)
class Deviations:
    """Standard deviations of an estimate's parameters: the free entries (F), and the numbers of the effects (K).

    Attributes
    ----------
    corrected : ndarray, shape (F,)
        Of the free entries, corrected for coloured residuals.
    white : ndarray, shape (F,)
        As if the residuals were white: the Cramer-Rao bound.
    published : ndarray, shape (F,)
        As Morelli & Klein published the correction: too small on short records.
    covariance : ndarray, shape (F, F)
        Corrected covariance of the free entries.
    correlation_max : ndarray, shape (F,)
        Largest absolute correlation of each entry with any other parameter of the estimate.
    effects : ndarray, shape (K,)
        Corrected deviations of the effects' numbers.
    effects_white : ndarray, shape (K,)
        As if the residuals were white.
    beside_effects : ndarray, shape (F, F), optional
        Covariance of the free entries were the effects' numbers known; None where these are estimated anew.
    """

    corrected: NDArray[np.float64]
    white: NDArray[np.float64]
    published: NDArray[np.float64]
    covariance: NDArray[np.float64]
    correlation_max: NDArray[np.float64]
    effects: NDArray[np.float64]
    effects_white: NDArray[np.float64]
    beside_effects: NDArray[np.float64] | None = None

    def of_entries(self, places: Sequence[int]) -> Deviations:
        """Those of some of the free entries, and of all effects."""
        chosen = list(places)
        beside = self.beside_effects
        return replace(
            self,
            corrected=self.corrected[chosen],
            white=self.white[chosen],
            published=self.published[chosen],
            covariance=self.covariance[np.ix_(chosen, chosen)],
            correlation_max=self.correlation_max[chosen],
            beside_effects=None if beside is None else beside[np.ix_(chosen, chosen)],
        )

    @property
    def as_white(self) -> Deviations:
        """Those of white residuals, in the places of the corrected ones."""
        return replace(self, corrected=self.white, effects=self.effects_white)

    def no_smaller_than(self, least: NDArray[np.float64]) -> Deviations:
        """With no standard deviation of a free entry smaller than another witness's (F,), their correlations kept."""
        corrected = np.fmax(self.corrected, least)
        factor = np.ones(corrected.size)
        shown = np.isfinite(corrected) & np.isfinite(self.corrected) & (self.corrected > 0.0)
        factor[shown] = corrected[shown] / self.corrected[shown]
        return replace(self, corrected=corrected, covariance=self.covariance * np.outer(factor, factor))


def deviations(
    refinement: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    *,
    quick: bool = False,
    whitened: Iterable[Whitened] | None = None,
) -> Deviations:
    """The estimate's standard deviations, plain and corrected for coloured residuals.

    Parameters
    ----------
    quick : bool
        Take the published correction, raised by its usual shortfall, in place of the modelled one: for searches.
    whitened : iterable of Whitened, optional
        The estimate's stretches, where they are known.

    Notes
    -----
    Morelli & Klein, Journal of Aircraft 34 (2), 1997: the autocorrelation of each output's residual takes the place
    of white noise in the covariance of the estimate; the modelled correction is that of `residual_covariance`.
    """
    white = refinement.covariance
    # Undetermined parameters have no standard deviation; the others must not fail for them.
    keep = np.flatnonzero(np.isfinite(np.diag(white)) & (np.diag(white) > 0.0))
    corrected = np.full(white.shape, np.inf)
    groups = []
    for part in whiten(refinement, manoeuvres) if whitened is None else whitened:
        for i in range(refinement.variance.size):
            present = np.flatnonzero(np.isfinite(part.residual[:, i]))
            if present.size:
                groups.append((part.columns[present[:, None], i, keep], part.residual[present, i], 1.0))
    try:
        if quick:
            part_published = published_covariance_groups(groups)
            part_corrected = RESIDUAL_TESTS.quick_shortfall**2 * part_published
        else:
            found = coloured_covariance_groups(groups)
            part_published, part_corrected = found.published, found.corrected
    except ValueError:
        part_published = part_corrected = np.full((keep.size, keep.size), np.inf)
    corrected[np.ix_(keep, keep)] = part_corrected
    published = np.full(white.shape[0], np.inf)
    published[keep] = np.sqrt(np.maximum(np.diag(part_published), 0.0))
    # Autocovariances of a short record need not be positive definite; no deviation is below the white one then.
    floor = np.diag(white)
    variance = np.where(np.diag(corrected) > 0.0, np.diag(corrected), floor)
    free = len(refinement.free)
    first = free + sum(state.size for state in refinement.states)
    deviation = np.sqrt(np.diag(white))
    relation = np.zeros_like(white)
    relation[np.ix_(keep, keep)] = white[np.ix_(keep, keep)] / np.outer(deviation[keep], deviation[keep])
    np.fill_diagonal(relation, 0.0)
    return Deviations(
        corrected=np.sqrt(variance)[:free],
        white=deviation[:free],
        published=published[:free],
        covariance=corrected[:free, :free],
        correlation_max=np.max(np.abs(relation), axis=1)[:free] if free else np.zeros(0),
        effects=np.sqrt(variance)[first:],
        effects_white=deviation[first:],
    )
