"""JSBSim configuration: a flat planet, driven surfaces, thrust as a force at one point.

Without engines, lateral axes, output or input sockets, and the aircraft's own flight control.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from aerosid.flight_model.constants import GRAVITY
from aerosid.studies.jsbsim.properties import AT_TRIM, DEVIATIONS, FLAP, GEAR, SURFACES

PLANET_RADIUS = 6.378e9
"""Design: m: a thousand times the Earth's, which removes curvature and the decrease of gravity with height."""


NO_ACTUATORS: Mapping[str, ET.Element] = MappingProxyType({})
"""Surfaces that follow their commands without dynamics."""


def planet_xml() -> str:
    """The text of a planet without curvature and rotation, with gravity g everywhere."""
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
    elevator_limit: float,
    flap_limit: float,
    further: Iterable[str],
    actuators: Mapping[str, ET.Element] = NO_ACTUATORS,
    side_limits: tuple[float, float] = (1.0, 1.0),
) -> ET.Element:
    """The `<flight_control>` that positions elevator, aileron, rudder, flap and gear by our properties.

    Parameters
    ----------
    elevator_limit, flap_limit : float
        Travel [rad] and [deg] that the normalised positions refer to.
    further : iterable of str
        Properties that are read by the aerodynamics and defined by nothing else: they are constantly zero.
    actuators : mapping of str to Element, optional
        By control, the actuator between the commanded deviation from trim and the surface.
    side_limits : (float, float), optional
        Travel [rad] of aileron and rudder that the normalised positions refer to.
    """
    control = ET.Element("flight_control", name="aerosid")
    # Gear up, flap retracted: the flown configuration.
    for name in (*AT_TRIM.values(), *DEVIATIONS.values(), FLAP, GEAR, *further):
        ET.SubElement(control, "property", value="0.0").text = name
    channel = ET.SubElement(control, "channel", name="aerosid")
    for surface, positions in SURFACES.items():
        deviation = DEVIATIONS[surface]
        if surface in actuators:
            channel.append(actuators[surface])
            deviation = str(actuators[surface].get("name"))
        for number, (written, gain) in enumerate(positions):
            summer = ET.SubElement(channel, "summer", name=f"fcs/aerosid/{surface}-{number}")
            for source in (AT_TRIM[surface], deviation):
                ET.SubElement(summer, "input").text = source if gain > 0.0 else f"-{source}"
            ET.SubElement(summer, "output").text = written
    for name, read, gain, written in (
        ("elevator-norm", "fcs/aerosid/delta_e-0", 1.0 / elevator_limit, "fcs/elevator-pos-norm"),
        ("right-aileron-norm", "fcs/aerosid/delta_a-0", 1.0 / side_limits[0], "fcs/right-aileron-pos-norm"),
        ("left-aileron-norm", "fcs/aerosid/delta_a-1", 1.0 / side_limits[0], "fcs/left-aileron-pos-norm"),
        ("rudder-norm", "fcs/aerosid/delta_r-0", 1.0 / side_limits[1], "fcs/rudder-pos-norm"),
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
    """The `<force>` named thrust along (x, z) in body axes; its location is set once the centre of gravity is known."""
    force = ET.Element("force", name="thrust", frame="BODY")
    location = ET.SubElement(force, "location", unit="IN")
    along = ET.SubElement(force, "direction")
    for axis, value in (("x", direction[0]), ("y", 0.0), ("z", direction[1])):
        ET.SubElement(location, axis).text = "0.0"
        ET.SubElement(along, axis).text = repr(value)
    return force
