"""The aerodynamic model that an aircraft file declares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.constants import Constants
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
    columns = input_columns([*(term for _, term in entries), *further_terms], aircraft.axes)
    constants = Constants(
        wing_area=aircraft.wing_area,
        mean_chord=aircraft.mean_chord,
        I_yy=aircraft.I_yy,
        thrust_incidence=aircraft.thrust_incidence,
        thrust_z_arm=aircraft.thrust_z_arm,
        airspeed_of_rates=aircraft.airspeed or 0.0,
        airspeed_of_V_hat=aircraft.airspeed or reference_airspeed,
        span=aircraft.span or 0.0,
        I_xx=aircraft.I_xx or 0.0,
        I_zz=aircraft.I_zz or 0.0,
        I_xz=aircraft.I_xz or 0.0,
    )
    values = np.array([d.value for d in aircraft.derivatives])
    return AerodynamicModel(entries, values, columns, constants, aircraft.axes)
