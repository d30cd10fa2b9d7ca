"""Filter-error estimate with unmodelled forces: error bounds that allow for model error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.fit_settings import BACKGROUND
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on


@dataclass(frozen=True)
class FilterError:
    """An estimate by filter error, with a coloured random force in each coefficient of the size that the flight shows.

    Attributes
    ----------
    values, deviations : ndarray, shape (F,)
        Of the structure's free entries.
    forces : ActiveEffect
        Those forces, with the statistics that were estimated.
    variance : ndarray, shape (m,)
        Noise of the outputs with them, SI squared.
    """

    values: NDArray[np.float64]
    deviations: NDArray[np.float64]
    forces: ActiveEffect
    variance: NDArray[np.float64]


def filter_error(
    completed: Refinement,
    forces: ActiveEffect,
    variance: NDArray[np.float64],
    manoeuvres: Sequence[Manoeuvre],
) -> FilterError | None:
    """Filter-error estimate of an open-loop structure with unmodelled forces; None where the fit fails.

    Parameters
    ----------
    completed : Refinement
        The open-loop estimate, its model error in the residuals.
    forces : ActiveEffect
        Those forces, with start values of their statistics.
    variance : ndarray, shape (m,)
        Noise of the outputs with them, SI squared.
    """
    try:
        fit = refine_on(replace(completed, variance=variance), manoeuvres, BACKGROUND, (*completed.effects, forces))
        uncertainty = deviations(fit, manoeuvres)
    except EstimationError:
        return None
    values = np.array([fit.model.value(entry) for entry in fit.free])
    found = next(active for active in fit.effects if active.effect.kind == forces.effect.kind)
    return FilterError(values, np.maximum(uncertainty.corrected, uncertainty.white), found, fit.variance)


def widened(uncertainty: Deviations, beside: FilterError | None) -> Deviations:
    """The open-loop standard deviations, none smaller than with unmodelled forces.

    A short record hardly shows the low-frequency part of its residuals, so that estimates scatter between manoeuvres by
    more than standard deviations from the residuals' colour alone.
    """
    if beside is None:
        return uncertainty
    return uncertainty.no_smaller_than(beside.deviations)
