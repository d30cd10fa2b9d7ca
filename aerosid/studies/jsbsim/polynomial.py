"""An aerosid aircraft as a whole JSBSim aircraft: the equations (33)-(36) with thrust, flown by independent code."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from aerosid.aircraft import Aircraft
from aerosid.reporting.export.jsbsim_functions import CHANNEL_PROPERTIES
from aerosid.reporting.export.jsbsim_units import FOOT, POUND_FORCE, POUNDS_PER_SLUG, SLUG
from aerosid.reporting.export.jsbsim_xml import ExportSettings, aerodynamics_element
from aerosid.studies.jsbsim.properties import THRUST


def channel_property(channel: str) -> str:
    """The property that drives an input channel of an aerosid aircraft."""
    return f"aerosid/channel/{channel}"


def polynomial_aerodynamics(aircraft: Aircraft, airspeed: float) -> tuple[ET.Element, tuple[str, ...]]:
    """The `<aerodynamics>` of an aircraft, and the properties that it reads beside JSBSim's own."""
    named = {name for derivative in aircraft.derivatives for name in derivative.term.variables}
    channels = sorted(
        name
        for name in named - {"alpha", "q_hat", "V_hat", "alpha_dot_hat", "C_T", "thrust", "delta_e"}
        if name not in CHANNEL_PROPERTIES or name.startswith("delta_")
    )
    properties: dict[str, tuple[str, float]] = {name: (channel_property(name), 1.0) for name in channels}
    properties["thrust"] = (THRUST, POUND_FORCE)
    settings = ExportSettings(airspeed=airspeed, properties=properties)
    return aerodynamics_element(aircraft, settings), tuple(channel_property(name) for name in channels)


def geometry_and_mass(aircraft: Aircraft) -> list[ET.Element]:
    """`<metrics>` and `<mass_balance>` with the centre of gravity and AERORP at the origin."""
    metrics = ET.Element("metrics")
    # No aircraft file holds a span; a rectangular wing's serves where height over span matters.
    for tag, unit, value in (
        ("wingarea", "FT2", aircraft.wing_area / FOOT**2),
        ("wingspan", "FT", aircraft.wing_area / aircraft.mean_chord / FOOT),
        ("chord", "FT", aircraft.mean_chord / FOOT),
    ):
        ET.SubElement(metrics, tag, unit=unit).text = repr(value)
    _place(ET.SubElement(metrics, "location", name="AERORP", unit="IN"))
    balance = ET.Element("mass_balance")
    I_yy = aircraft.I_yy / SLUG / FOOT**2  # in JSBSim's own unit: its conversion of kg m^2 is 9e-5 low
    for tag, value in (("ixx", I_yy), ("iyy", I_yy), ("izz", I_yy), ("ixy", 0.0), ("ixz", 0.0), ("iyz", 0.0)):
        ET.SubElement(balance, tag, unit="SLUG*FT2").text = repr(value)
    ET.SubElement(balance, "emptywt", unit="LBS").text = repr(aircraft.mass / SLUG * POUNDS_PER_SLUG)
    _place(ET.SubElement(balance, "location", name="CG", unit="IN"))
    return [metrics, balance]


def thrust_line(aircraft: Aircraft) -> tuple[tuple[float, float], float]:
    """Direction (x, z) of the thrust in body axes, and how far [m] below the centre of gravity JSBSim's point lies."""
    along = math.cos(aircraft.thrust_incidence)
    # The moment is T z_arm whatever the incidence; JSBSim's is T cos(incidence) times the height.
    return (along, -math.sin(aircraft.thrust_incidence)), aircraft.thrust_z_arm / along


def _place(location: ET.Element) -> None:
    for axis in "xyz":
        ET.SubElement(location, axis).text = "0.0"
