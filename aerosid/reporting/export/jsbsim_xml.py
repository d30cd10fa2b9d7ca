"""The aerodynamic model of an aircraft as JSBSim XML; written without JSBSim and without a flight.

Every constant of the identified model (wing area, chord, U0) is written out, so that the section has the same meaning
in any aircraft; only the state of the flight is read from JSBSim's properties.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from aerosid import __version__
from aerosid.aircraft import Aircraft
from aerosid.errors import AircraftError
from aerosid.flight_model.terms import LIFT, lift_first
from aerosid.reporting.export.jsbsim_functions import (
    References,
    call,
    channel_property,
    function,
    reading,
    term_element,
    total,
    value,
    variable_element,
)
from aerosid.reporting.export.jsbsim_units import FOOT
from aerosid.reporting.export.options import NOT_SHOWN, of_the_recording, origin

_PREFIX = "aero/aerosid/"
_ACTING = "fcs/aerosid/{}-acting"
_ACTUATOR = {"control_lag": "lag", "control_rate_limit": "rate_limit", "control_delay": "delay"}
_AXES = (
    ("X", "C_X", ""),
    ("Y", "C_Y", ""),
    ("Z", "C_Z", ""),
    ("ROLL", "C_l", "span"),
    ("PITCH", "C_m", "mean_chord"),
    ("YAW", "C_n", "span"),
)
"""JSBSim's axis, its coefficient, and the reference length of a moment."""
_IN_PLACE_OF = {
    "C_X": ("DRAG", "X", "AXIAL"),
    "C_Y": ("SIDE", "Y"),
    "C_Z": ("LIFT", "Z", "NORMAL"),
    "C_l": ("ROLL",),
    "C_m": ("PITCH",),
    "C_n": ("YAW",),
}
"""Axes that a coefficient replaces, in each of JSBSim's three systems of axes."""
_NO_BODY_AXES = ("LIFT", "DRAG", "AXIAL", "NORMAL")
_BODY_NAMES = {"SIDE": "Y"}


@dataclass(frozen=True)
class ExportSettings:
    """Data that an aircraft file does not contain on the aircraft that receives the model.

    Attributes
    ----------
    aero_reference : (float, float)
        x forward and z down, m, of JSBSim's point AERORP from the model's centre of gravity. JSBSim applies the forces
        there; their moment about that centre of gravity is subtracted from C_m.
    alpha_range : (float, float) or None
        Tested angles of attack, rad; outside, the terms keep their values at the ends.
    airspeed : float or None
        U0 of V_hat, m/s, where the aircraft file gives no airspeed.
    folded_thrust : float
        Thrust over dynamic pressure and wing area included in the coefficients, for an aircraft with engines.
    properties : mapping of str to (str, float)
        Further channels in terms, or other properties for known ones: the property, and the factor to SI.
    """

    aero_reference: tuple[float, float] = (0.0, 0.0)
    alpha_range: tuple[float, float] | None = None
    airspeed: float | None = None
    folded_thrust: float = 0.0
    properties: Mapping[str, tuple[str, float]] = field(default_factory=dict)


def aerodynamics_xml(aircraft: Aircraft, settings: ExportSettings = ExportSettings()) -> str:
    """The text of the `<aerodynamics>` section: axes X, Z and PITCH, Y, ROLL and YAW, as far as the model has them.

    Parameters
    ----------
    aircraft : Aircraft
        Its derivatives, with their standard deviations as comments.
    settings : ExportSettings
        On the aircraft that receives the model.

    Raises
    ------
    AircraftError
        Where a term needs a channel that JSBSim does not have, U0 of V_hat is missing, or an effect cannot be
        represented.
    """
    return as_text(aerodynamics_element(aircraft, settings))


def aerodynamics_element(aircraft: Aircraft, settings: ExportSettings = ExportSettings()) -> ET.Element:
    """As `aerodynamics_xml`, as an element."""
    _check(aircraft, settings)
    section = ET.Element("aerodynamics")
    section.append(_comment(f"{aircraft.name}, written by aerosid {__version__} from {aircraft.sha256[:16]}"))
    section.append(_comment("Body axes, coefficients in total alpha and deflections (rad) about the centre of gravity"))
    if aircraft.completion is not None:
        section.append(_comment(origin(aircraft)))
    for effect in aircraft.effects:
        if of_the_recording(effect):
            section.append(_comment(f"{effect.kind} {effect.where} belongs to a recording and is left out"))
    for name in sorted(aircraft.variables - set(LIFT)):
        section.append(function(_PREFIX + name, _variable(aircraft, settings, name)))
    section.extend(_coefficient(aircraft, coefficient) for coefficient in lift_first(aircraft.coefficients))
    if "C_L" in aircraft.coefficients:
        section.extend(_from_lift_and_drag())
    _append_axes(section, aircraft, settings)
    return section


def actuator_xml(aircraft: Aircraft, settings: ExportSettings = ExportSettings()) -> str | None:
    """The text of a `<system>` with the declared lags, delays and rate limits of controls; None without any.

    The aerodynamics then read the actuator's output and not the command.

    Raises
    ------
    AircraftError
        As `aerodynamics_xml`.
    """
    _check(aircraft, settings)
    element = _actuators(aircraft, settings)
    return None if element is None else as_text(element)


def put_into(target: ET.Element, aircraft: Aircraft, settings: ExportSettings = ExportSettings()) -> ET.Element:
    """The `<fdm_config>` of an aircraft with those of its aerodynamic axes replaced that the model has.

    With a longitudinal model side force, rolling and yawing moment are kept, with a lateral one the others; SIDE
    becomes Y, since JSBSim does not mix wind and body axes. Functions outside of axes are kept, since axes may
    read them.

    Raises
    ------
    AircraftError
        As `aerodynamics_xml`; where the target has no aerodynamics, or keeps lift and drag together with a side force
        along the body's axis.
    """
    section = target.find("aerodynamics")
    if section is None or section.find("axis") is None:
        raise AircraftError(
            f"the JSBSim aircraft {target.get('name', '')!r} holds no <aerodynamics> of its own; give one that does."
        )
    replaced = {name for coefficient in aircraft.axes.coefficients for name in _IN_PLACE_OF[coefficient]}
    for axis in section.findall("axis"):
        name = axis.get("name", "").upper()
        if name in replaced:
            section.remove(axis)
        elif name in _NO_BODY_AXES:
            raise AircraftError(
                f"{aircraft.path}: the model has a side force along body y, but the JSBSim aircraft "
                f"{target.get('name', '')!r} keeps its axis {name}, and JSBSim does not mix the two; add C_X, C_Z and "
                "C_m to the model, or give an aircraft with axes X and Z."
            )
        elif name in _BODY_NAMES:
            axis.set("name", _BODY_NAMES[name])
    section.extend(aerodynamics_element(aircraft, settings))
    actuators = _actuators(aircraft, settings)
    if actuators is not None:
        target.insert(list(target).index(section), actuators)
    return target


def as_text(element: ET.Element) -> str:
    """The element as an indented XML file."""
    ET.indent(element)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(element, encoding="unicode") + "\n"


def _check(aircraft: Aircraft, settings: ExportSettings) -> None:
    for effect in aircraft.effects:
        if not of_the_recording(effect) and effect.kind not in _ACTUATOR:
            raise AircraftError(
                f"{aircraft.path}: [[effects]] declares {effect.kind}, which JSBSim XML of this kind cannot carry; "
                "delete the effect, or add its terms to the derivatives."
            )
        if effect.kind in _ACTUATOR and effect.where == "thrust":
            raise AircraftError(
                f"{aircraft.path}: [[effects]] declares {effect.kind} of thrust, which in JSBSim is the engine's; "
                "delete the effect, and give the engine its time."
            )
        if effect.kind in _ACTUATOR and effect.value is None:
            raise AircraftError(f"{aircraft.path}: the effect {effect.kind} of {effect.where} has no value; add one.")
    if settings.alpha_range is not None and not settings.alpha_range[0] < settings.alpha_range[1]:
        low, high = settings.alpha_range
        raise AircraftError(f"the tested range of alpha runs from {low:g} to {high:g} rad; give the lower end first.")


def _references(aircraft: Aircraft, settings: ExportSettings) -> References:
    return References(
        aircraft.wing_area,
        aircraft.mean_chord,
        aircraft.airspeed,
        aircraft.airspeed or settings.airspeed,
        settings.properties,
        aircraft.path,
        aircraft.span,
    )


def _variable(aircraft: Aircraft, settings: ExportSettings, name: str) -> ET.Element:
    """The expression of a variable: alpha within its tested range, controls after their actuators."""
    expression = variable_element(_references(aircraft, settings), name)
    if name == "alpha" and settings.alpha_range is not None:
        low, high = settings.alpha_range
        return call("max", value(low), call("min", value(high), expression))
    if any(effect.kind in _ACTUATOR and effect.where == name for effect in aircraft.effects):
        return reading(_ACTING.format(name))
    return expression


def _coefficient(aircraft: Aircraft, coefficient: str) -> ET.Element:
    declared = [entry for entry in aircraft.derivatives if entry.coefficient == coefficient]
    # A comment before each term, and two zeros: JSBSim's sum needs at least two addends.
    addends = [value(0.0), value(0.0)]
    for entry in declared:
        spread = "" if entry.sigma is None else f", standard deviation {entry.sigma:.6g}"
        kept = "" if entry.shown else f", {NOT_SHOWN}"
        addends.append(_comment(f"{coefficient} {entry.term}{spread}{kept}"))
        addends.append(term_element(entry.value, entry.term, lambda name: reading(_PREFIX + name)))
    return function(_PREFIX + coefficient, call("sum", *addends))


def _from_lift_and_drag() -> list[ET.Element]:
    """C_X = C_L sin(alpha) - C_D cos(alpha) and C_Z = -C_L cos(alpha) - C_D sin(alpha), at the true alpha."""

    def turned(coefficient: str, turn: str, sign: float) -> ET.Element:
        return call("product", value(sign), reading(_PREFIX + coefficient), call(turn, reading("aero/alpha-rad")))

    return [
        function(_PREFIX + "C_X", call("sum", turned("C_L", "sin", 1.0), turned("C_D", "cos", -1.0))),
        function(_PREFIX + "C_Z", call("sum", turned("C_L", "cos", -1.0), turned("C_D", "sin", -1.0))),
    ]


def _append_axes(section: ET.Element, aircraft: Aircraft, settings: ExportSettings) -> None:
    """The model's axes: dynamic pressure times area (and chord or span) times coefficient."""
    (x_b, z_b), area = settings.aero_reference, aircraft.wing_area / FOOT**2
    folded, incidence = settings.folded_thrust, aircraft.thrust_incidence
    thrust = {
        "C_X": folded * math.cos(incidence),
        "C_Z": -folded * math.sin(incidence),
        "C_m": folded * aircraft.thrust_z_arm / aircraft.mean_chord,
    }
    # The forces that JSBSim applies at AERORP turn the aircraft: by -z_b F_y, z_b F_x - x_b F_z and x_b F_y.
    turned = {"C_l": ((z_b, "C_Y"),), "C_m": ((-z_b, "C_X"), (x_b, "C_Z")), "C_n": ((-x_b, "C_Y"),)}

    def alone(coefficient: str) -> ET.Element:
        own, held = reading(_PREFIX + coefficient), thrust.get(coefficient, 0.0)
        return total(own, value(-held)) if held else own

    for axis, coefficient, by in _AXES:
        if coefficient not in aircraft.axes.coefficients:
            continue
        length = float(getattr(aircraft, by)) if by else FOOT
        addends = [alone(coefficient)]
        if x_b or z_b:
            addends += [call("product", value(arm / length), alone(f)) for arm, f in turned.get(coefficient, ())]
        scale = area * length / FOOT if by else area
        force = call("product", reading("aero/qbar-psf"), value(scale), total(*addends))
        ET.SubElement(section, "axis", name=axis).append(function(_PREFIX + axis.lower(), force))


def _actuators(aircraft: Aircraft, settings: ExportSettings) -> ET.Element | None:
    controls = dict.fromkeys(effect.where for effect in aircraft.effects if effect.kind in _ACTUATOR)
    if not controls:
        return None
    system = ET.Element("system", name="aerosid actuators")
    channel = ET.SubElement(system, "channel", name="aerosid actuators")
    for control in controls:
        numbers = {effect.kind: effect.value for effect in aircraft.effects if effect.where == control}
        component = ET.SubElement(channel, "actuator", name=_ACTING.format(control))
        ET.SubElement(component, "input").text = channel_property(_references(aircraft, settings), control)[0]
        for kind, tag in _ACTUATOR.items():
            if numbers.get(kind):
                number = float(numbers[kind] or 0.0)
                # JSBSim's lag is the corner frequency in rad/s.
                ET.SubElement(component, tag).text = repr(1.0 / number if tag == "lag" else number)
        ET.SubElement(component, "output").text = _ACTING.format(control)
    return system


def _comment(text: str) -> ET.Element:
    """A comment; characters forbidden in XML comments are removed from the text."""
    printable = re.sub(r"[^\t\x20-\ud7ff\ue000-\ufffd]", " ", text)
    comment: Any = ET.Comment(f" {re.sub('-(?=-)', '- ', printable)} ")
    return cast(ET.Element, comment)
