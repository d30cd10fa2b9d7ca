"""Restricted re-estimation: derivatives that the record does not show are held at their declared values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import Deviations
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.derivative_table import is_shown
from aerosid.search.attribution import Attribution
from aerosid.search.equation_error_attribution import with_initial_states
from aerosid.search.final_significance import significant
from aerosid.search.finding_rows import findings_of
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
            found = (
                _conditioned(found, values, search)
                if found.regressed
                else significant(_held(found, values, search), search)
            )
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


def _held(found: Attribution, values: Mapping[Entry, float], search: StructureSearch) -> Attribution:
    """The estimate with some entries no longer free."""
    completed = found.completed
    numbers = completed.model.values.copy()
    for entry, value in values.items():
        numbers[completed.model.index(entry)] = value
    places = [n for n, entry in enumerate(completed.free) if entry not in values]
    free = tuple(completed.free[n] for n in places)
    start = replace(completed, model=completed.model.with_values(numbers), free=free)
    restricted = found.estimated_anew(start, search.manoeuvres)
    uncertainty = _only(found.completed_deviations, places)
    beside = found.filter_error
    if beside is not None:
        beside = replace(beside, values=beside.values[places], deviations=beside.deviations[places])
    findings = findings_of(search, restricted, uncertainty)
    return replace(
        found, completed=restricted, completed_deviations=uncertainty, filter_error=beside, findings=findings
    )


def _conditioned(found: Attribution, values: Mapping[Entry, float], search: StructureSearch) -> Attribution:
    """The regression with some entries held, its simulation with initial states of its own."""
    completed, uncertainty = found.completed, found.completed_deviations
    held = [n for n, entry in enumerate(completed.free) if entry in values]
    rest = [n for n, entry in enumerate(completed.free) if entry not in values]
    places = completed.model.indices(completed.free)
    numbers = completed.model.values.copy()
    numbers[places] = restricted(
        completed.model.values[places], uncertainty.covariance, held, [values[completed.free[n]] for n in held]
    )
    model = completed.model.with_values(numbers)
    free = tuple(completed.free[n] for n in rest)
    estimate = with_initial_states(model, free, completed.effects, search.manoeuvres)
    findings = tuple(
        replace(finding, value=model.value(finding.entry)) if finding.entry in free else finding
        for finding in found.findings
    )
    return replace(found, completed=estimate, completed_deviations=_only(uncertainty, rest), findings=findings)


def restricted(
    values: NDArray[np.float64], covariance: NDArray[np.float64], held: Sequence[int], at: Sequence[float]
) -> NDArray[np.float64]:
    """A linear regression's values (K,) with some of them held at others.

    Parameters
    ----------
    values : ndarray, shape (K,)
        Estimated freely.
    covariance : ndarray, shape (K, K)
        Theirs.
    held : sequence of int
        Places of those that are held.
    at : sequence of float
        Where.

    Notes
    -----
    theta_r + P_rh P_hh^-1 (at - theta_h): Seber & Lee, Linear Regression Analysis, section 3.8.
    """
    fixed = list(held)
    away = np.asarray(at) - values[fixed]
    moved = values + covariance[:, fixed] @ np.linalg.lstsq(covariance[np.ix_(fixed, fixed)], away, rcond=None)[0]
    moved[fixed] = at
    return np.asarray(moved)


def _only(uncertainty: Deviations, places: Sequence[int]) -> Deviations:
    """The standard deviations of some of the free entries."""
    chosen = list(places)
    return replace(
        uncertainty,
        corrected=uncertainty.corrected[chosen],
        white=uncertainty.white[chosen],
        published=uncertainty.published[chosen],
        covariance=uncertainty.covariance[np.ix_(chosen, chosen)],
        correlation_max=uncertainty.correlation_max[chosen],
    )


def told_of_breakdown(completion: Completion) -> list[str]:
    """A sentence where the derivatives that are kept could not be estimated around."""
    if not completion.broke_down:
        return []
    return [BREAKDOWN]
