"""The library of terms that are screened on every flight."""

from __future__ import annotations

from aerosid.aerodynamics import Entry
from aerosid.aircraft import Aircraft
from aerosid.flight_log import FlightLog
from aerosid.terms import Term, parse_term

LIBRARY = (
    "1",
    "alpha",
    "q_hat",
    "delta_e",
    "V_hat",
    "alpha^2",
    "alpha^3",
    "alpha^4",
    "delta_e^2",
    "delta_e^3",
    "V_hat^2",
    "q_hat^2",
    "alpha*q_hat",
    "alpha*delta_e",
    "alpha*V_hat",
    "q_hat*delta_e",
    "q_hat*V_hat",
    "delta_e*V_hat",
    "alpha^2*q_hat",
    "alpha^2*delta_e",
)
"""Powers of alpha to the fourth, lower ones of the slower variables, and their cross terms."""


def library_terms(log: FlightLog) -> tuple[Term, ...]:
    """The terms of `LIBRARY` whose channels the log holds."""
    terms = (parse_term(text) for text in LIBRARY)
    return tuple(term for term in terms if all(name in log for name in term.variables if name.startswith("delta_")))


def candidate_entries(aircraft: Aircraft, log: FlightLog) -> tuple[Entry, ...]:
    """Every candidate in every coefficient that the aircraft file uses, without what it declares already.

    The aircraft's own candidates come first. A term that the file declares as fixed is no candidate either.
    """
    declared = {(derivative.coefficient, derivative.term) for derivative in aircraft.derivatives}
    own = [(coefficient, term) for coefficient, terms in aircraft.candidates.items() for term in terms]
    library = [(coefficient, term) for coefficient in aircraft.coefficients for term in library_terms(log)]
    return tuple(entry for entry in dict.fromkeys([*own, *library]) if entry not in declared)
