"""Restricted re-estimation: derivatives that the record does not show are fixed at their declared values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtrc, ndtr

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.derivative_table import is_shown
from aerosid.search.attribution import Attribution
from aerosid.search.final_significance import distance_from_none
from aerosid.search.restricted_estimate import restricted_estimate
from aerosid.search.structure_search import StructureSearch

BREAKDOWN = (
    "The re-estimation with insignificant derivatives fixed at their declared values failed: the completed aircraft "
    "holds the other derivatives from the estimate with all of them free, and the errors after are of that estimate."
)


@dataclass(frozen=True)
class Completion:
    """The completed model, as it is written, simulated and linearised.

    Attributes
    ----------
    found : Attribution
        The findings and the estimate with every derivative that is not shown at its declared value. The standard errors
        are those of the estimate where all are free: they count what is not known of the held ones.
    kept : mapping of Entry to float
        What is held, with the estimate that was not shown.
    broke_down : bool
        Whether nothing could be estimated beside the held ones: the other numbers are then those of the free estimate.
    contradicted : tuple of Entry
        What is not shown and not held either: the declared value and a named number contradict each other.
    """

    found: Attribution
    kept: Mapping[Entry, float] = field(default_factory=dict)
    broke_down: bool = False
    contradicted: tuple[Entry, ...] = ()

    @property
    def not_shown(self) -> tuple[Entry, ...]:
        """What the record does not show, held or not."""
        return (*self.kept, *self.contradicted)


def keep_declared(found: Attribution, aircraft: Aircraft, search: StructureSearch, *, excited: bool) -> Completion:
    """The completed model with what the record does not show kept as declared, the rest re-estimated beside it.

    Parameters
    ----------
    found : Attribution
        With all declared derivatives free.
    aircraft : Aircraft
        The declared values.
    search : StructureSearch
        The flights that were fitted, with the settings.
    excited : bool
        Whether the flights say anything at all; otherwise every derivative is kept.

    Notes
    -----
    A table that mixes declared numbers into a joint estimate is no model that was ever compared with the flight: what
    is held moves what it is correlated with. So the errors `after`, the linear model and the file are one model.

    Where a declared value would bring a named number within the deviations that it must keep from none, the flight
    contradicts that value together with the number: the derivative stays as estimated, and is told as not shown. So it
    does where a regression's declared values lie as many of the deviations away that its own structure, with the
    numbers of the named effects, gives them: what stands as an alternative widens the bounds, and is not in the model.
    """
    declared = {(d.coefficient, d.term): d.value for d in aircraft.derivatives}
    kept: dict[Entry, float] = {}
    contradicted = [*_beyond_named_effects(found, declared, search, excited=excited)]
    while hidden := [e for e in _not_shown(found, declared, excited=excited) if e not in contradicted]:
        estimated = {entry: found.completed.model.value(entry) for entry in hidden}
        try:
            restricted = restricted_estimate(found, {entry: declared[entry] for entry in hidden}, search)
        except EstimationError:
            return Completion(found, kept | estimated, broke_down=True, contradicted=tuple(contradicted))
        lost = _no_longer_standing(found, restricted, search)
        if lost:
            contradicted += [entry for entry in hidden if entry[0] in lost] or hidden
            continue
        kept, found = kept | estimated, restricted
    return Completion(found, kept, contradicted=tuple(contradicted))


def _beyond_named_effects(
    found: Attribution, declared: Mapping[Entry, float], search: StructureSearch, *, excited: bool
) -> tuple[Entry, ...]:
    """What is not shown of coefficients whose declared values the records contradict beside the named effects.

    Those of one coefficient together, by chi-square at the odds of the deviations that a named number must keep.
    """
    beside = found.completed_deviations.beside_effects
    if beside is None:
        return ()
    hidden = _not_shown(found, declared, excited=excited)
    model, free = found.completed.model, found.completed.free
    odds = 2.0 * ndtr(-search.settings.final_deviations)
    contradicted: list[Entry] = []
    for coefficient in dict.fromkeys(entry[0] for entry in hidden):
        own = [entry for entry in hidden if entry[0] == coefficient]
        places = [free.index(entry) for entry in own]
        away = np.array([declared[entry] - model.value(entry) for entry in own])
        distance = float(away @ np.linalg.pinv(beside[np.ix_(places, places)], rcond=1e-12, hermitian=True) @ away)
        if chdtrc(len(own), distance) < odds:
            contradicted += own
    return tuple(contradicted)


def _no_longer_standing(found: Attribution, restricted: Attribution, search: StructureSearch) -> set[str]:
    """The coefficients of named terms that stand by one estimate and no longer by another of the same structure."""
    before, after = (
        {part.entry: distance_from_none(part) for part in search.parts(each.completed, each.completed_deviations)}
        for each in (found, restricted)
    )
    asked = search.settings.final_deviations
    return {entry[0] for entry, ratio in after.items() if entry and ratio < asked <= before.get(entry, 0.0)}


def _not_shown(found: Attribution, declared: Mapping[Entry, float], *, excited: bool) -> tuple[Entry, ...]:
    """The free declared derivatives, constants among them, on which the record holds too little information."""
    completed, uncertainty = found.completed, found.completed_deviations

    def shown(n: int, entry: Entry) -> bool:
        value, error = completed.model.value(entry), float(uncertainty.corrected[n])
        return excited and is_shown(value, declared[entry], error, constant=not entry[1].factors)

    return tuple(entry for n, entry in enumerate(completed.free) if entry in declared and not shown(n, entry))


def told_of_breakdown(completion: Completion) -> list[str]:
    """A sentence where the derivatives that are kept could not be estimated around."""
    if not completion.broke_down:
        return []
    return [BREAKDOWN]
