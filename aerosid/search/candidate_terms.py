"""Candidate terms: the aircraft file's own and those of the library that the flights excite."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from aerosid.aircraft import Aircraft
from aerosid.effects.aerodynamic_terms import attitude, compressible, polynomials, splines, unsteady
from aerosid.effects.logged_channels import logged_channels
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.axes import Axes
from aerosid.flight_model.terms import Term
from aerosid.logs.flight_log import FlightLog

TERM_FAMILIES: tuple[Callable[[Sequence[FlightLog], str, Axes], Iterable[Term]], ...] = (
    polynomials,
    unsteady,
    compressible,
    attitude,
    splines,
    logged_channels,
)
"""Each returns the terms of one coefficient that the logs excite; a family is one function and one line here."""


def candidate_entries(aircraft: Aircraft, logs: Sequence[FlightLog]) -> tuple[Entry, ...]:
    """Every candidate in every coefficient that the aircraft file uses, without its declared terms.

    The aircraft's own candidates come first. A term that the file declares as fixed is no candidate either.

    Parameters
    ----------
    aircraft : Aircraft
        The declared aircraft.
    logs : sequence of FlightLog
        All logs on which the model is to act: a term needs its channel on each.
    """
    declared = {(derivative.coefficient, derivative.term) for derivative in aircraft.derivatives}
    own = [(coefficient, term) for coefficient, terms in aircraft.candidates.items() for term in terms]
    library = [
        (coefficient, term)
        for coefficient in aircraft.coefficients
        for family in TERM_FAMILIES
        for term in family(logs, coefficient, aircraft.axes)
    ]
    return tuple(entry for entry in dict.fromkeys([*own, *library]) if entry not in declared)
