"""An aerosid aircraft as a complete JSBSim aircraft: equations (33)-(36) with thrust, simulated by independent code."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import replace

from aerosid.aircraft import Aircraft
from aerosid.aircraft.model import Derivative
from aerosid.flight_model.axes import LATERAL, SIX
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.simulation import BALANCES
from aerosid.flight_model.terms import VARIABLES, parse_term
from aerosid.nomenclature import is_surface
from aerosid.reporting.export.jsbsim_functions import CHANNEL_PROPERTIES
from aerosid.reporting.export.jsbsim_units import FOOT, POUND_FORCE, POUNDS_PER_SLUG, SLUG
from aerosid.reporting.export.jsbsim_xml import ExportSettings, aerodynamics_element
from aerosid.studies.jsbsim.properties import THRUST

CARRYING = {
    "C_X": {"1": -0.05, "alpha": 0.2},
    "C_Z": {"alpha": -5.0, "q_hat": -5.0, "delta_e": -0.4},
    "C_m": {"1": 0.03, "alpha": -1.0, "q_hat": -18.0, "delta_e": -1.5},
}
"""Design: longitudinal model of an aircraft file with lateral coefficients only: a stable light transport's; C_Z "1" is
determined by the weight at `CARRYING_ALPHA`."""
CARRYING_ALPHA = 0.03
"""Design: rad."""


def as_flown(aircraft: Aircraft, airspeed: float, density: float) -> Aircraft:
    """The aircraft, with lift, drag and pitching moment of another where its file has none.

    Parameters
    ----------
    aircraft : Aircraft
    airspeed, density : float
        Of the trim, m/s and kg/m^3.
    """
    if aircraft.axes != LATERAL:
        return aircraft
    weight = aircraft.mass * GRAVITY / (0.5 * density * airspeed**2 * aircraft.wing_area)
    level = {"1": -weight - CARRYING["C_Z"]["alpha"] * CARRYING_ALPHA}
    carrying = tuple(
        Derivative(coefficient, parse_term(term), value)
        for coefficient, terms in CARRYING.items()
        for term, value in (terms | (level if coefficient == "C_Z" else {})).items()
    )
    return replace(aircraft, derivatives=(*aircraft.derivatives, *carrying), axes=SIX)


def driven_by(aircraft: Aircraft) -> tuple[str, ...]:
    """The controls moved in a flight of this aircraft: those that trim its motion and occur in its terms."""
    planes = [balance for balance in BALANCES if balance.moves(aircraft.axes)]
    there = [name for balance in planes for name in balance.unknowns if is_surface(name)]
    return tuple(name for name in there if name in aircraft.variables)


def channel_property(channel: str) -> str:
    """The property that drives an input channel of an aerosid aircraft."""
    return f"aerosid/channel/{channel}"


def polynomial_aerodynamics(aircraft: Aircraft, airspeed: float) -> tuple[ET.Element, tuple[str, ...]]:
    """The `<aerodynamics>` of an aircraft, and the properties that it reads in addition to JSBSim's own."""
    channels = sorted(
        name
        for name in aircraft.variables - {*VARIABLES, "thrust", *driven_by(aircraft)}
        if name not in CHANNEL_PROPERTIES or is_surface(name)
    )
    properties: dict[str, tuple[str, float]] = {name: (channel_property(name), 1.0) for name in channels}
    properties["thrust"] = (THRUST, POUND_FORCE)
    settings = ExportSettings(airspeed=airspeed, properties=properties)
    return aerodynamics_element(aircraft, settings), tuple(channel_property(name) for name in channels)


def geometry_and_mass(aircraft: Aircraft) -> list[ET.Element]:
    """`<metrics>` and `<mass_balance>` with the centre of gravity and AERORP at the origin."""
    metrics = ET.Element("metrics")
    # Without a span in the file, that of a rectangular wing is used where height over span matters.
    span = aircraft.span or aircraft.wing_area / aircraft.mean_chord
    for tag, unit, value in (
        ("wingarea", "FT2", aircraft.wing_area / FOOT**2),
        ("wingspan", "FT", span / FOOT),
        ("chord", "FT", aircraft.mean_chord / FOOT),
    ):
        ET.SubElement(metrics, tag, unit=unit).text = repr(value)
    _place(ET.SubElement(metrics, "location", name="AERORP", unit="IN"))
    balance = ET.Element("mass_balance")
    # In JSBSim's own unit: its conversion from kg m^2 is 9e-5 too low.
    about = {"iyy": aircraft.I_yy, "ixx": aircraft.I_xx or aircraft.I_yy, "izz": aircraft.I_zz or aircraft.I_yy}
    # JSBSim expects the product of inertia with its sign in the tensor.
    for tag, value in ({**about, "ixy": 0.0, "ixz": -(aircraft.I_xz or 0.0) + 0.0, "iyz": 0.0}).items():
        ET.SubElement(balance, tag, unit="SLUG*FT2").text = repr(value / SLUG / FOOT**2)
    ET.SubElement(balance, "emptywt", unit="LBS").text = repr(aircraft.mass / SLUG * POUNDS_PER_SLUG)
    _place(ET.SubElement(balance, "location", name="CG", unit="IN"))
    return [metrics, balance]


def set_inertia(config: ET.Element, name: str, inertia: float) -> None:
    """Replace an inertia [kg m^2] of a configuration, `name` as in the aircraft file."""
    element = config.find(f"mass_balance/{name.lower().replace('_', '')}")
    if element is not None:
        element.text = repr((-inertia if name == "I_xz" else inertia) / SLUG / FOOT**2)


def thrust_line(aircraft: Aircraft) -> tuple[tuple[float, float], float]:
    """Direction (x, z) of the thrust in body axes, and the height [m] of JSBSim's point below the centre of gravity."""
    along = math.cos(aircraft.thrust_incidence)
    # The moment is T z_arm for any incidence; JSBSim's is T cos(incidence) times the height.
    return (along, -math.sin(aircraft.thrust_incidence)), aircraft.thrust_z_arm / along


def _place(location: ET.Element) -> None:
    for axis in "xyz":
        ET.SubElement(location, axis).text = "0.0"
