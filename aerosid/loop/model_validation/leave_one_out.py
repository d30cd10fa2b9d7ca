"""Leave-one-out prediction: error on flights not used in the fit with each effect removed in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from aerosid.errors import EstimationError
from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.open_loop import on_log, respond
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, Part
from aerosid.search.structure_search import StructureSearch

Gains = Mapping[tuple[str, str, str, float | None], float | None]


def identity(row: Finding | Part) -> tuple[str, str, str, float | None]:
    """Kind, place, term and time: the key that identifies a finding with its part."""
    kind, where, term = row.label if isinstance(row, Part) else (row.kind, row.where, row.term)
    return kind, where, term, row.time


def prediction_gains(found: Attribution, search: StructureSearch, flights: Sequence[Manoeuvre]) -> Gains:
    """For each effect, error without it over error with it, on flights that were not fitted; median over channels.

    Parameters
    ----------
    found : Attribution
        The completed model.
    search : StructureSearch
        The flights that were fitted.
    flights : sequence of Manoeuvre
        Those to predict; none: no gains.

    Notes
    -----
    The effect is removed, everything else re-estimated on the fitted flights, and the others simulated in open loop
    from initial states of their own. A step change of a fitted flight does not act on another: its gain is the bias of
    the derivatives that it avoids. None where a simulation leaves its range or the estimation without it fails.
    """
    if not flights or not found.findings:
        return {}
    complete = _errors(found.completed, flights)
    gains: dict[tuple[str, str, str, float | None], float | None] = {}
    for part in search.parts(found.completed, None):
        try:
            lacking = refine_on(search.reduced_structure(found.completed, [part]), search.manoeuvres, WRONG_STRUCTURE)
            without = _errors(lacking, flights)
        except EstimationError:
            gains[identity(part)] = None
            continue
        pairs = [(without[key], error) for key, error in complete.items()]
        ratios = [worse / error for worse, error in pairs if worse is not None and error is not None and error > 0.0]
        gains[identity(part)] = float(np.median(ratios)) if ratios else None
    return gains


def _errors(at: Refinement, flights: Sequence[Manoeuvre]) -> dict[tuple[int, str], float | None]:
    """Root-mean-square error by flight and channel."""
    return {
        (n, channel): error
        for n, flight in enumerate(flights)
        for channel, error in respond(at.model, flight, at.variance, effects=on_log(at, flight)).rms.items()
    }
