"""Filter-error estimate beside unmodelled forces: bounds that count what the model lacks."""

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
    """An estimate by filter error: each coefficient off by a random force with a memory, as much as the flight shows.

    Attributes
    ----------
    values, deviations : ndarray, shape (F,)
        Of the structure's free entries.
    forces : ActiveEffect
        Those forces, with the statistics that were estimated.
    variance : ndarray, shape (8,)
        Noise of the outputs beside them, SI squared.
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
    """The structure of an open-loop estimate among forces of any shape; None where the search breaks down.

    Parameters
    ----------
    completed : Refinement
        The estimate in open loop, what it lacks left in its residuals.
    forces : ActiveEffect
        Those forces, with the statistics where their search begins.
    variance : ndarray, shape (m,)
        Noise of the outputs beside them, SI squared.
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
    """The deviations in open loop, none smaller than among forces of any shape.

    Residuals of a short record hardly show what is slow in them, so that deviations from their colour alone differ
    between manoeuvres by more than they say.
    """
    if beside is None:
        return uncertainty
    corrected = np.fmax(uncertainty.corrected, beside.deviations)
    factor = np.ones(corrected.size)
    shown = np.isfinite(corrected) & np.isfinite(uncertainty.corrected) & (uncertainty.corrected > 0.0)
    factor[shown] = corrected[shown] / uncertainty.corrected[shown]
    return replace(uncertainty, corrected=corrected, covariance=uncertainty.covariance * np.outer(factor, factor))
