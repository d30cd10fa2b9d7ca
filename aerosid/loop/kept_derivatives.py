"""Restricted re-estimation: derivatives that the record does not show are fixed at their declared values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.derivative_table import is_shown
from aerosid.search.attribution import Attribution
from aerosid.search.restricted_estimate import restricted_estimate
from aerosid.search.structure_search import StructureSearch

BREAKDOWN = (
    "Beside the declared values of what is not shown the others could not be estimated anew: the completed aircraft "
    "holds the others as they are where all are free, and the errors after are those of that estimate."
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
    """

    found: Attribution
    kept: Mapping[Entry, float] = field(default_factory=dict)
    broke_down: bool = False


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
    """
    declared = {(d.coefficient, d.term): d.value for d in aircraft.derivatives}
    kept: dict[Entry, float] = {}
    while hidden := _not_shown(found, declared, excited=excited):
        kept |= {entry: found.completed.model.value(entry) for entry in hidden}
        values = {entry: declared[entry] for entry in hidden}
        try:
            found = restricted_estimate(found, values, search)
        except EstimationError:
            return Completion(found, kept, broke_down=True)
    return Completion(found, kept)


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
