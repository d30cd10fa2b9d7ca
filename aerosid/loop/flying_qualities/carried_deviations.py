"""First-order propagation of covariance: deviations of what is computed from a model's values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.aerodynamics import Entry

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TermCovariance:
    """Covariance of a model's values.

    Attributes
    ----------
    entries : tuple of Entry
        The uncertain ones, F of them.
    covariance : ndarray, shape (F, F)
        Infinite where a record tells nothing.
    """

    entries: tuple[Entry, ...]
    covariance: FloatArray

    @staticmethod
    def independent(entries: Sequence[Entry], deviations: Sequence[float]) -> TermCovariance:
        """From standard deviations alone, as an aircraft file gives them."""
        return TermCovariance(tuple(entries), np.diag(np.square(np.array(deviations, dtype=np.float64))))


def central_slopes(lower: Sequence[float | None], upper: Sequence[float | None], steps: FloatArray) -> FloatArray:
    """Central differences (F,); NaN where the number ceases to exist within a step."""
    below = np.array([np.nan if value is None else value for value in lower])
    above = np.array([np.nan if value is None else value for value in upper])
    return np.asarray((above - below) / (2.0 * steps))


def carried_deviation(slopes: FloatArray, covariance: FloatArray) -> float | None:
    """sqrt(g' C g); None where it is unknown."""
    if not slopes.size or not np.isfinite(slopes).all():
        return None
    # A value of which nothing is known does no harm where nothing depends on it, to the accuracy of the trims.
    acts = np.abs(slopes) > 1e-6 * np.max(np.abs(slopes))
    acting = np.flatnonzero(acts | np.isfinite(np.diag(covariance)))
    part = covariance[np.ix_(acting, acting)]
    if not np.isfinite(part).all():
        return None
    variance = float(slopes[acting] @ part @ slopes[acting])
    # The corrected covariance of a short record need not be positive definite: a deviation of zero would be a lie.
    return float(np.sqrt(variance)) if variance > 0.0 else None


def carried_band(
    below: Sequence[FloatArray], above: Sequence[FloatArray], steps: FloatArray, covariance: FloatArray
) -> FloatArray:
    """Standard deviation (N,) of a time history from its neighbours a step (F,) below and above in each value."""
    slopes = np.array([(a - b) for a, b in zip(above, below, strict=True)]) / (2.0 * steps[:, None])
    return np.asarray(np.sqrt(np.maximum(np.einsum("in,ij,jn->n", slopes, covariance, slopes), 0.0)))
