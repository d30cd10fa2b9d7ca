"""The aerodynamic model that an aircraft file declares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.longitudinal import Constants
from aerosid.flight_model.terms import Term, input_columns


def declared_model(
    aircraft: Aircraft, reference_airspeed: float, further_terms: Sequence[Term] = ()
) -> AerodynamicModel:
    """The model that the aircraft file declares.

    Parameters
    ----------
    aircraft : Aircraft
        The declared aircraft.
    reference_airspeed : float
        U0 of V_hat [m/s] where the file gives none.
    further_terms : sequence of Term
        Terms that may be added later: their input channels get a column now.
    """
    entries = tuple((derivative.coefficient, derivative.term) for derivative in aircraft.derivatives)
    columns = input_columns([*(term for _, term in entries), *further_terms])
    constants = Constants(
        wing_area=aircraft.wing_area,
        mean_chord=aircraft.mean_chord,
        I_yy=aircraft.I_yy,
        thrust_incidence=aircraft.thrust_incidence,
        thrust_z_arm=aircraft.thrust_z_arm,
        airspeed_of_rates=aircraft.airspeed or 0.0,
        airspeed_of_V_hat=aircraft.airspeed or reference_airspeed,
    )
    return AerodynamicModel(entries, np.array([d.value for d in aircraft.derivatives]), columns, constants)
