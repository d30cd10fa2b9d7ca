"""Tables 3 and 4 of Parameswaran & Raol 1994 from a flight of JSBSim with undeclared alpha^2 terms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from aerosid.aircraft import load_aircraft
from aerosid.flight_model.simulation import doublet
from aerosid.studies.jsbsim.control_inputs import Manoeuvre
from aerosid.studies.jsbsim.flight import fly_jsbsim
from aerosid.studies.jsbsim.injected import InjectedEffect
from aerosid.studies.jsbsim.plan import FlightPlan
from aerosid.studies.paper.flight_example import AIRSPEED, ALPHA2, AMPLITUDE, INTERVAL, STATES, Flight, reference_flight
from aerosid.studies.paper.table3 import Correlation, make_table3
from aerosid.studies.paper.table4 import NoiseLevel, make_table4


@dataclass(frozen=True)
class PaperFlight:
    """Both tables, and the differences of JSBSim's states from our own integration of (33)-(36).

    Attributes
    ----------
    agreement : dict of str to float
        Greatest difference divided by the peak-to-peak value, by state.
    table3 : tuple of Correlation
    table4 : tuple of NoiseLevel
    """

    agreement: dict[str, float]
    table3: tuple[Correlation, ...]
    table4: tuple[NoiseLevel, ...]


def flown_by_jsbsim() -> Flight:
    """The reproduction's flight with JSBSim's elevator and states: declared aircraft, both alpha^2 terms injected."""
    reference = reference_flight()
    deviation = doublet(reference.time, 34 * INTERVAL, 34 * INTERVAL, AMPLITUDE)
    effects = tuple(
        InjectedEffect("aero_term", (value,), coefficient, "alpha^2")
        for coefficient, value in zip(("C_X", "C_m"), ALPHA2, strict=True)
    )
    plan = FlightPlan(
        load_aircraft("light_transport"),
        Manoeuvre(reference.time, {"delta_e": deviation}, "doublet"),
        AIRSPEED,
        effects=effects,
        noise=0.0,
    )
    states = fly_jsbsim(plan).states
    return replace(
        reference, elevator=np.array(states["delta_e"]), states=np.column_stack([states[name] for name in STATES])
    )


def check_paper(seeds: int, tick: Callable[[int], None]) -> PaperFlight:
    """The tables from JSBSim's flight.

    Parameters
    ----------
    seeds : int
        Noise seeds per signal-to-noise ratio of table 4.
    tick : callable
        Called after each record.
    """
    flight, reference = flown_by_jsbsim(), reference_flight()
    spread = np.ptp(reference.states, axis=0)
    apart = np.abs(flight.states - reference.states).max(axis=0) / spread
    return PaperFlight(
        dict(zip(STATES, map(float, apart), strict=True)),
        make_table3(flight),
        make_table4(seeds, lambda: tick(1), flight),
    )
