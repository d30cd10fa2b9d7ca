"""Leave-one-out prediction: error on flights not used in the fit with each effect removed in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from aerosid.compiled.cores import mapped
from aerosid.errors import EstimationError
from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.open_loop import prediction_errors
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Identity, Part, identity
from aerosid.search.structure_search import StructureSearch

Gains = Mapping[Identity, float | None]

_Errors = Mapping[tuple[int, str], float | None]

WORTH_A_COPY = 0.1
"""Numerical: seconds of work from which a copy of the process is worth its start."""


def prediction_gains(found: Attribution, search: StructureSearch, *unseen: Sequence[Manoeuvre]) -> tuple[Gains, ...]:
    """For each effect, error without it over error with it, on flights that were not fitted; median over channels.

    Parameters
    ----------
    found : Attribution
        The completed model.
    search : StructureSearch
        The flights that were fitted.
    unseen : sequence of Manoeuvre
        Those to predict, group by group; none: no gains.

    Returns
    -------
    tuple of mapping
        The gains on each group.

    Notes
    -----
    The effect is removed, everything else re-estimated on the fitted flights by the estimator that the values are from,
    and the others simulated in open loop from initial states of their own. A step change of a fitted flight does not
    act on another: its gain is the bias of the derivatives that it avoids. None where a simulation leaves its range or
    the estimation without it fails.
    """
    if not any(unseen) or not found.findings:
        return tuple({} for _ in unseen)
    complete = [_errors(found.completed, flights) for flights in unseen]
    parts = search.parts(found.completed, None)

    def gains_of(part: Part) -> list[float | None]:
        try:
            lacking = _re_estimated_without(found, part, search)
            return [
                _gain(errors, _errors(lacking, flights, found.completed))
                for errors, flights in zip(complete, unseen, strict=True)
            ]
        except EstimationError:
            return [None] * len(unseen)

    rows = mapped(gains_of, parts, worth=WORTH_A_COPY)
    return tuple(
        {identity(part): row[group] for part, row in zip(parts, rows, strict=True)} if flights else {}
        for group, flights in enumerate(unseen)
    )


def _re_estimated_without(found: Attribution, part: Part, search: StructureSearch) -> Refinement:
    """The structure without a part, by the estimator of the values, in fewer steps where that is the likelihood.

    By any other, the gain contains what sets the estimators apart: a regression's values become those of the
    turbulence, and records with constants of their own in common ones pull the derivatives towards their trims.
    """
    if found.re_estimator is not None:
        return found.re_estimator(search.reduced_structure(found.completed, [part]))
    near = search.re_estimated_without(found.completed, [part])
    return near if near is search.declared else refine_on(near, search.manoeuvres, WRONG_STRUCTURE)


def _gain(complete: _Errors, lacking: _Errors) -> float | None:
    """Median over flights and channels of the error without an effect over that with it."""
    pairs = [(lacking[key], error) for key, error in complete.items()]
    ratios = [worse / error for worse, error in pairs if worse is not None and error is not None and error > 0.0]
    return float(np.median(ratios)) if ratios else None


def _errors(at: Refinement, flights: Sequence[Manoeuvre], fuller: Refinement | None = None) -> _Errors:
    """Root-mean-square error by flight and channel; `fuller`: the model that an effect was removed from."""
    return {
        (n, channel): error
        for n, flight in enumerate(flights)
        for channel, error in prediction_errors(at, flight, fuller).items()
    }
