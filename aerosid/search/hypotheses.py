"""Hypotheses for a set of flights: one for each candidate term and each effect that the catalogue offers."""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.effects import CATALOGUE, FlightData
from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry, controls_of
from aerosid.flight_model.constants import Constants


def term_hypotheses(candidates: Sequence[Entry]) -> tuple[Hypothesis, ...]:
    """One hypothesis for each candidate term."""
    return tuple(Hypothesis("aero_term", entry[0], str(entry[1]), entries=(entry,)) for entry in candidates)


def effect_hypotheses(
    model: AerodynamicModel, manoeuvres: Sequence[Manoeuvre], coefficients: Sequence[str] = ()
) -> tuple[Hypothesis, ...]:
    """One hypothesis for each effect that the catalogue offers.

    Parameters
    ----------
    model : AerodynamicModel
        The declared one; its terms determine which controls act.
    manoeuvres : sequence of Manoeuvre
        The identification flights.
    coefficients : sequence of str
        Those that may have a step change; none: no step changes are offered.
    """
    flights = tuple(_flight_data(manoeuvre, model.constants) for manoeuvre in manoeuvres)
    offers = [
        offer
        for family in CATALOGUE
        if family.offered is not None
        for offer in family.offered(flights, controls_of(model), tuple(coefficients))
    ]
    return tuple(Hypothesis(o.kind, o.where, effects=o.effects, time=o.time) for o in offers)


def _flight_data(manoeuvre: Manoeuvre, constants: Constants) -> FlightData:
    flight = manoeuvre.flight
    places = {name: manoeuvre.row(name) for name in manoeuvre.outputs}
    return FlightData(
        log=manoeuvre.name,
        time=flight.time,
        inputs=dict(zip(manoeuvre.columns, flight.inputs.T, strict=True)),
        measured={name: flight.measured[:, i] for name, i in places.items()},
        noise={name: float(manoeuvre.noise[i]) for name, i in places.items()},
        height=flight.measured[:, places["h"]] - manoeuvre.ground if "h" in places else None,
        constants=constants,
        axes=manoeuvre.axes,
        smooth=manoeuvre.smooth,
    )
