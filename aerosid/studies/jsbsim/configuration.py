"""What every JSBSim configuration of ours shares: a flat planet, a driven elevator, thrust as a force at one point.

No engines, no lateral axes, no output or input sockets, no flight control of the aircraft's own.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

from aerosid.flight_model.constants import GRAVITY
from aerosid.studies.jsbsim.properties import DEVIATION, ELEVATOR, FLAP, GEAR

PLANET_RADIUS = 6.378e9
"""m: a thousand times the Earth's, so that neither curvature nor the fall of gravity with height is left."""


def planet_xml() -> str:
    """The text of a planet that is flat, stands still and pulls with g everywhere."""
    planet = ET.Element("planet", name="flat")
    for tag, unit, value in (
        ("semimajor_axis", "M", PLANET_RADIUS),
        ("semiminor_axis", "M", PLANET_RADIUS),
        ("rotation_rate", "RAD/SEC", 0.0),
        ("GM", "M3/SEC2", GRAVITY * PLANET_RADIUS**2),
        ("J2", None, 0.0),
    ):
        element = ET.SubElement(planet, tag, {} if unit is None else {"unit": unit})
        element.text = repr(value)
    return ET.tostring(planet, encoding="unicode")


def driven_controls(
    elevator_limit: float, flap_limit: float, further: Iterable[str], actuator: ET.Element | None = None
) -> ET.Element:
    """The `<flight_control>` that moves elevator, flap and gear as our properties say.

    Parameters
    ----------
    elevator_limit, flap_limit : float
        Travel [rad] and [deg] that the normalised positions refer to.
    further : iterable of str
        Properties that the aerodynamics read and nothing else defines: they stay at zero.
    actuator : Element, optional
        Stands between the commanded deviation from trim and the elevator.
    """
    control = ET.Element("flight_control", name="aerosid")
    # Gear up, flap in: what flies.
    for name in (ELEVATOR, DEVIATION, FLAP, GEAR, *further):
        ET.SubElement(control, "property", value="0.0").text = name
    channel = ET.SubElement(control, "channel", name="aerosid")
    deviation = DEVIATION
    if actuator is not None:
        channel.append(actuator)
        deviation = str(actuator.get("name"))
    elevator = ET.SubElement(channel, "summer", name="fcs/aerosid/elevator")
    for source in (ELEVATOR, deviation):
        ET.SubElement(elevator, "input").text = source
    ET.SubElement(elevator, "output").text = "fcs/elevator-pos-rad"
    for name, read, gain, written in (
        ("elevator-norm", "fcs/aerosid/elevator", 1.0 / elevator_limit, "fcs/elevator-pos-norm"),
        ("flap", FLAP, flap_limit, "fcs/flap-pos-deg"),
        ("flap-norm", FLAP, 1.0, "fcs/flap-pos-norm"),
        ("gear", GEAR, 1.0, "gear/gear-pos-norm"),
    ):
        component = ET.SubElement(channel, "pure_gain", name=f"fcs/aerosid/{name}")
        ET.SubElement(component, "input").text = read
        ET.SubElement(component, "gain").text = repr(gain)
        ET.SubElement(component, "output").text = written
    return control


def thrust_force(direction: tuple[float, float]) -> ET.Element:
    """The `<force>` named thrust along (x, z) in body axes; its place is set once the centre of gravity is known."""
    force = ET.Element("force", name="thrust", frame="BODY")
    location = ET.SubElement(force, "location", unit="IN")
    along = ET.SubElement(force, "direction")
    for axis, value in (("x", direction[0]), ("y", 0.0), ("z", direction[1])):
        ET.SubElement(location, axis).text = "0.0"
        ET.SubElement(along, axis).text = repr(value)
    return force
