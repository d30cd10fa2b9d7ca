"""The model as DAVE-ML 2.0: variables, MathML, uncertainty, provenance and check cases.

The check cases are computed from the terms and not from the MathML, so that evaluating the file checks both the reader
and the writer.

References
----------
ANSI/AIAA S-119-2011, Flight Dynamics Model Exchange Standard; DAVE-ML 2.0 reference, DAVEfunc.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from aerosid import __version__
from aerosid.aircraft import Aircraft
from aerosid.errors import AircraftError, UsageError
from aerosid.flight_model.axes import COEFFICIENTS, LATERAL, LONGITUDINAL, SIX
from aerosid.flight_model.terms import LIFT, lift_first
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.export.check_cases import CheckCase, check_cases
from aerosid.reporting.export.mathml import apply, identifier, maths, number, term_maths
from aerosid.reporting.export.options import (
    NOT_SHOWN,
    Exported,
    ExportOptions,
    left_out,
    named,
    of_the_recording,
    origin,
)

NAMESPACE = "http://daveml.org/2010/DAVEML"
DOCTYPE = (
    '<!DOCTYPE DAVEfunc PUBLIC "-//AIAA//DTD for Flight Dynamic Models - Functions 2.0//EN" '
    '"http://www.daveml.org/DTDs/2p0/DAVEfunc.dtd">'
)
PROVENANCE = "aircraft_file"

_STANDARD_NAMES = {
    "alpha": "angleOfAttack",
    "beta": "angleOfSideslip",
    "V": "trueAirspeed",
    "p": "bodyAngularRate_Roll",
    "q": "bodyAngularRate_Pitch",
    "r": "bodyAngularRate_Yaw",
    "mach": "mach",
    "delta_e": "elevatorDeflection",
    "delta_a": "aileronDeflection",
    "delta_r": "rudderDeflection",
    "C_X": "aeroBodyForceCoefficient_X",
    "C_Y": "aeroBodyForceCoefficient_Y",
    "C_Z": "aeroBodyForceCoefficient_Z",
    "C_l": "aeroBodyMomentCoefficient_Roll",
    "C_m": "aeroBodyMomentCoefficient_Pitch",
    "C_n": "aeroBodyMomentCoefficient_Yaw",
    "C_L": "totalCoefficientOfLift",
    "C_D": "totalCoefficientOfDrag",
}
"""Names of the standard; other channels keep the name of the glossary."""

_RESERVED = frozenset({"alpha_dot", "alpha_tested", "U0", "SWING", "CBAR", "BSPAN", *COEFFICIENTS})
"""Identifiers that are not available for channels."""

_SIGNS = {
    "C_X": "+FWD",
    "C_Y": "+RIGHT",
    "C_Z": "+DOWN",
    "C_l": "+RWD",
    "C_m": "+ANU",
    "C_n": "+ANR",
    "C_L": "+UP",
    "C_D": "+AFT",
    "beta": "+ANL",
    "p": "+RWD",
    "q": "+ANU",
    "r": "+ANR",
    "delta_e": "+TED",
    "delta_r": "+TEL",
}

_RATES = {
    "p_hat": ("p", "BSPAN"),
    "q_hat": ("q", "CBAR"),
    "r_hat": ("r", "BSPAN"),
    "alpha_dot_hat": ("alpha_dot", "CBAR"),
}
"""Nondimensional rate -> the rate and the identifier of its reference length."""
_LENGTHS = {"CBAR": "c", "BSPAN": "b"}


def daveml_text(aircraft: Aircraft, options: ExportOptions) -> Exported:
    """The file: coefficients of body axes about the centre of gravity from alpha, q, V and the controls, SI.

    Raises
    ------
    AircraftError
        Where a declared effect is dynamic, which a static function cannot represent, or U0 of V_hat is missing.
    UsageError
        Where the date is invalid, the range of alpha is empty, or an option is one of JSBSim.
    """
    options.only("davem", "alpha_range", "airspeed")
    _check(aircraft, options)
    root = ET.Element("DAVEfunc", xmlns=NAMESPACE)
    root.append(_header(aircraft, options.date))
    root.extend(_definitions(aircraft, options))
    checks = ET.SubElement(root, "checkData")
    for case in check_cases(aircraft, required_inputs(aircraft), options.alpha_range, options.airspeed):
        checks.append(_static_shot(case))
    ET.indent(root)
    body = ET.tostring(root, encoding="unicode")
    return Exported(f'<?xml version="1.0" encoding="UTF-8"?>\n{DOCTYPE}\n{body}\n', left_out(aircraft))


def _check(aircraft: Aircraft, options: ExportOptions) -> None:
    for effect in aircraft.effects:
        if not of_the_recording(effect):
            raise AircraftError(
                f"{aircraft.path}: [[effects]] declares {named(effect)}, which is dynamic and cannot be written as a "
                "static function of DAVE-ML; delete the effect, or export with --format jsbsim."
            )
    if not re.fullmatch(r"\d{4}-\d{2}-\d{2}", options.date):
        raise UsageError(f"--date is {options.date!r}, expected YYYY-MM-DD; correct it.")
    if options.alpha_range is not None and not options.alpha_range[0] < options.alpha_range[1]:
        low, high = options.alpha_range
        raise UsageError(
            f"--alpha-range runs from {math.degrees(low):g} to {math.degrees(high):g} deg; give the lower end first."
        )
    names = aircraft.variables
    if clash := sorted(names & _RESERVED - set(LIFT)):
        raise AircraftError(
            f"{aircraft.path}: a term names the channel {clash[0]}, which is another quantity in the exported file; "
            "rename the channel."
        )
    if "V_hat" in names and aircraft.airspeed is None and options.airspeed is None:
        raise AircraftError(
            f"{aircraft.path}: a term holds V_hat, but no airspeed U0 is given; add reference.airspeed [m/s], or give "
            "--airspeed."
        )


def _header(aircraft: Aircraft, date: str) -> ET.Element:
    header = ET.Element("fileHeader", name=xml_text(aircraft.name))
    _author(header)
    ET.SubElement(header, "creationDate", date=date)
    _leaf(header, "fileVersion", aircraft.sha256[:16])
    _leaf(
        header,
        "description",
        f"{_MODELS[aircraft.axes.name]} aerodynamic model in body axes about the centre of gravity; angles in radians, "
        f"SI units. Forces are coefficient times dynamic pressure times referenceWingArea, {_moments(aircraft)}.",
    )
    provenance = ET.SubElement(header, "provenance", provID=PROVENANCE)
    _author(provenance)
    ET.SubElement(provenance, "creationDate", date=date)
    file = f"Aircraft file {Path(aircraft.path).name}, SHA-256 {aircraft.sha256}."
    made = f" {origin(aircraft)}." if aircraft.completion else ""
    _leaf(provenance, "description", f"{file}{made} Source: {aircraft.source or 'not stated'}")
    return header


_MODELS = {LONGITUDINAL.name: "Longitudinal", LATERAL.name: "Lateral-directional", SIX.name: "Six-axis"}


def _moments(aircraft: Aircraft) -> str:
    """Definitions of the dimensional moments."""
    if aircraft.axes == LONGITUDINAL:
        return "the moment also times referenceWingChord"
    span = "those about x and z also times referenceWingSpan"
    return span + (", that about y also times referenceWingChord" if "C_m" in aircraft.coefficients else "")


def _author(parent: ET.Element) -> None:
    ET.SubElement(parent, "author", name=f"aerosid {__version__}", org="not stated")


def _definitions(aircraft: Aircraft, options: ExportOptions) -> list[ET.Element]:
    """Every variable before those calculated from it."""
    used = aircraft.variables
    limited = options.alpha_range is not None and "alpha" in used
    definitions = [_input(name) for name in required_inputs(aircraft)]
    definitions += [
        _constant("referenceWingArea", "SWING", "m2", aircraft.wing_area, standard=True, output=True),
        _constant("referenceWingChord", "CBAR", "m", aircraft.mean_chord, standard=True, output=True),
    ]
    if aircraft.span is not None:
        definitions.append(_constant("referenceWingSpan", "BSPAN", "m", aircraft.span, standard=True, output=True))
    definitions += _derived(aircraft, options, used)
    if limited and options.alpha_range is not None:
        low, high = options.alpha_range
        tested = _variable("angle of attack within the tested range", "alpha_tested", "rad")
        tested.set("minValue", repr(low))
        tested.set("maxValue", repr(high))
        _calculation(tested, identifier("alpha"))
        definitions.append(tested)
    names = _derivative_names(aircraft)
    definitions += [_derivative(aircraft, place, name) for place, name in enumerate(names)]
    for coefficient in lift_first(aircraft.coefficients):
        addends = [
            term_maths(names[place], entry.term, {"alpha": "alpha_tested"} if limited else {})
            for place, entry in enumerate(aircraft.derivatives)
            if entry.coefficient == coefficient
        ]
        definitions.append(_output(coefficient, apply("plus", *addends) if len(addends) > 1 else _sum_of(addends)))
    if "C_L" in aircraft.coefficients:
        definitions += _from_lift_and_drag()
    return definitions


def required_inputs(aircraft: Aircraft) -> tuple[str, ...]:
    """The input channels of the model, in glossary order, others after them."""
    used = aircraft.variables
    wanted = {name for name in used if name not in (*_RATES, "V_hat", "C_T", *LIFT)}
    if "C_L" in aircraft.coefficients:
        wanted.add("alpha")
    wanted |= {rate for name, (rate, _) in _RATES.items() if name in used}
    if "C_T" in used:
        wanted |= {"V", "rho", "thrust"}
    if "V_hat" in used or (aircraft.airspeed is None and _RATES.keys() & used):
        wanted.add("V")
    known = [name for name in CHANNELS if name in wanted]
    return (*known, *sorted(wanted - set(known)))


def _input(name: str) -> ET.Element:
    channel = CHANNELS.get(name)
    unit = "rad_s" if name == "alpha_dot" else _unit(channel.unit if channel else "1")
    variable = _variable(_STANDARD_NAMES.get(name, name), name, unit, name)
    if channel is not None:
        _leaf(variable, "description", f"{channel.name}, positive: {channel.positive}")
    ET.SubElement(variable, "isInput")
    if name in _STANDARD_NAMES:
        ET.SubElement(variable, "isStdAIAA")
    return variable


def _derived(aircraft: Aircraft, options: ExportOptions, used: frozenset[str]) -> list[ET.Element]:
    """Reference airspeed and the non-dimensional variables in the terms."""
    definitions = []
    rate_speed, reference = "V", aircraft.airspeed or options.airspeed
    if aircraft.airspeed is not None:
        rate_speed = "U0"
    if (aircraft.airspeed is not None and _RATES.keys() & used) or "V_hat" in used:
        definitions.append(_constant("referenceAirspeed", "U0", "m_s", float(reference or 0.0)))
    for name, (rate, length) in _RATES.items():
        if name in used:
            variable = _variable(f"{rate} {_LENGTHS[length]}/(2 U0)", name, "nd")
            above = apply("times", identifier(rate), identifier(length))
            _calculation(variable, apply("divide", above, apply("times", number(2.0), identifier(rate_speed))))
            definitions.append(variable)
    if "V_hat" in used:
        variable = _variable("V/U0 - 1", "V_hat", "nd")
        _calculation(variable, apply("minus", apply("divide", identifier("V"), identifier("U0")), number(1.0)))
        definitions.append(variable)
    if "C_T" in used:
        variable = _variable("thrust/(dynamic pressure * wing area)", "C_T", "nd")
        square = apply("power", identifier("V"), number(2.0))
        pressure = apply("times", number(0.5), identifier("rho"), square, identifier("SWING"))
        _calculation(variable, apply("divide", identifier("thrust"), pressure))
        definitions.append(variable)
    return definitions


def _derivative_names(aircraft: Aircraft) -> tuple[str, ...]:
    """An XML name for each derivative: `C_m_alpha_2`, numbered where two would be equal."""
    taken = {*required_inputs(aircraft), *_RESERVED, *aircraft.variables}
    names = []
    for entry in aircraft.derivatives:
        plain = re.sub(r"\W+", "_", f"{entry.coefficient}_{entry.term}").strip("_")
        name, count = plain, 1
        while name in taken:
            count += 1
            name = f"{plain}_{count}"
        taken.add(name)
        names.append(name)
    return tuple(names)


def _derivative(aircraft: Aircraft, place: int, name: str) -> ET.Element:
    """A constant with its standard deviation."""
    entry = aircraft.derivatives[place]
    variable = _variable(f"{entry.coefficient} of {entry.term}", name, "nd")
    variable.set("initialValue", repr(entry.value))
    if not entry.shown:
        _leaf(variable, "description", NOT_SHOWN)
    ET.SubElement(variable, "provenanceRef", provID=PROVENANCE)
    if entry.sigma is not None:
        uncertainty = ET.SubElement(variable, "uncertainty", effect="additive")
        normal = ET.SubElement(uncertainty, "normalPDF", numSigmas="1")
        _leaf(normal, "bounds", repr(entry.sigma))
    return variable


def _from_lift_and_drag() -> list[ET.Element]:
    """C_X = C_L sin(alpha) - C_D cos(alpha), C_Z = -C_L cos(alpha) - C_D sin(alpha)."""

    def turned(coefficient: str, function: str) -> ET.Element:
        return apply("times", identifier(coefficient), apply(function, identifier("alpha")))

    return [
        _output("C_X", apply("minus", turned("C_L", "sin"), turned("C_D", "cos"))),
        _output("C_Z", apply("minus", apply("plus", turned("C_L", "cos"), turned("C_D", "sin")))),
    ]


def _sum_of(addends: Sequence[ET.Element]) -> ET.Element:
    return addends[0] if addends else number(0.0)


def _output(coefficient: str, expression: ET.Element) -> ET.Element:
    variable = _variable(_STANDARD_NAMES[coefficient], coefficient, "nd", coefficient)
    _calculation(variable, expression)
    ET.SubElement(variable, "isOutput")
    ET.SubElement(variable, "isStdAIAA")
    return variable


def _constant(
    name: str, identity: str, unit: str, value: float, standard: bool = False, output: bool = False
) -> ET.Element:
    variable = _variable(name, identity, unit)
    variable.set("initialValue", repr(value))
    if output:
        ET.SubElement(variable, "isOutput")
    if standard:
        ET.SubElement(variable, "isStdAIAA")
    return variable


def _variable(name: str, identity: str, unit: str, sign_of: str = "") -> ET.Element:
    attributes = {"name": name, "varID": identity, "units": unit}
    if sign_of in _SIGNS:
        attributes["sign"] = _SIGNS[sign_of]
    return ET.Element("variableDef", attributes)


def _calculation(variable: ET.Element, expression: ET.Element) -> None:
    ET.SubElement(variable, "calculation").append(maths(expression))


def _static_shot(case: CheckCase) -> ET.Element:
    shot = ET.Element("staticShot", name=case.name)
    inputs = ET.SubElement(shot, "checkInputs")
    for name, value in case.inputs.items():
        channel = CHANNELS.get(name)
        unit = "rad_s" if name == "alpha_dot" else _unit(channel.unit if channel else "1")
        _signal(inputs, _STANDARD_NAMES.get(name, name), unit, value)
    outputs = ET.SubElement(shot, "checkOutputs")
    for name, unit, value in case.references:
        _signal(outputs, name, unit, value, 1e-9 * abs(value))
    for name, value in case.outputs.items():
        _signal(outputs, _STANDARD_NAMES[name], "nd", value, 1e-9)
    return shot


def _signal(parent: ET.Element, name: str, unit: str, value: float, tolerance: float | None = None) -> None:
    signal = ET.SubElement(parent, "signal")
    _leaf(signal, "signalName", name)
    _leaf(signal, "signalUnits", unit)
    _leaf(signal, "signalValue", repr(value))
    if tolerance is not None:
        _leaf(signal, "tol", repr(tolerance))


def _unit(unit: str) -> str:
    """The unit as the standard writes it: m/s is m_s, kg/m^3 is kg_m3."""
    return "nd" if unit == "1" else unit.replace("/", "_").replace("^", "")


def _leaf(parent: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(parent, tag).text = xml_text(text)


def xml_text(text: str) -> str:
    """Text without the characters that XML forbids."""
    return re.sub(r"[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", " ", text)
