"""A small reader of DAVE-ML 2.0: MathML content markup evaluated by the book, and the published content models.

Written from the reference pages of DAVEfunc, and of MathML 2; it shares nothing with the package.
"""

from __future__ import annotations

import math
import operator
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from functools import reduce

DAVEML = "{http://daveml.org/2010/DAVEML}"
MATHML = "{http://www.w3.org/1998/Math/MathML}"

CONTENT = {
    "DAVEfunc": (
        "fileHeader (variableDef )+(breakpointDef )*(griddedTableDef )*(ungriddedTableDef )*(function )*(checkData )?"
    ),
    "fileHeader": (
        "(author )+creationDate (fileVersion )?(description )?(reference )*(modificationRecord )*(provenance )*"
    ),
    "provenance": "(author )+creationDate (documentRef )*(modificationRef )*(description )?",
    "author": "(contactInfo )*",
    "variableDef": (
        "(description )?((provenance |provenanceRef ))?(calculation )?((isInput |isControl |isDisturbance ))?"
        "(isState )?(isStateDeriv )?(isOutput )?(isStdAIAA )?(uncertainty )?"
    ),
    "uncertainty": "(normalPDF |uniformPDF )",
    "normalPDF": "bounds ((correlatesWith |correlation ))*",
    "calculation": "math ",
    "checkData": "((provenance |provenanceRef ))?(staticShot )+",
    "staticShot": "(description )?((provenance |provenanceRef ))?checkInputs (internalValues )?checkOutputs ",
    "checkInputs": "(signal )+",
    "checkOutputs": "(signal )+",
    "signal": "((signalName (signalUnits )?|varID ))signalValue (tol )?",
}
"""Children of each element, in order, as a regular expression over their names with a blank behind each."""

REQUIRED = {
    "author": {"name", "org"},
    "creationDate": {"date"},
    "variableDef": {"name", "varID", "units"},
    "uncertainty": {"effect"},
    "normalPDF": {"numSigmas"},
    "staticShot": {"name"},
    "provenanceRef": {"provID"},
}

_OPERATORS = {
    "plus": math.fsum,
    "times": math.prod,
    "minus": lambda x: -x[0] if len(x) == 1 else x[0] - x[1],
    "divide": lambda x: x[0] / x[1],
    "power": lambda x: x[0] ** x[1],
    "abs": lambda x: abs(x[0]),
    "sin": lambda x: math.sin(x[0]),
    "cos": lambda x: math.cos(x[0]),
    "gt": lambda x: x[0] > x[1],
    "lt": lambda x: x[0] < x[1],
    "and": lambda x: reduce(operator.and_, x),
}


def local(element: ET.Element) -> str:
    return element.tag.rsplit("}", 1)[-1]


def check_structure(root: ET.Element) -> None:
    """Content models, required attributes, one definition of each variable, before whatever is calculated from it."""
    known: set[str] = set()
    for element in root.iter():
        if element.tag.startswith(MATHML):
            continue
        assert element.tag.startswith(DAVEML), element.tag
        children = "".join(f"{local(child)} " for child in element)
        pattern = CONTENT.get(local(element), "")
        assert re.fullmatch(pattern, children), (local(element), children)
        assert set(element.keys()) >= REQUIRED.get(local(element), set()), (local(element), element.keys())
    for variable in root.iter(f"{DAVEML}variableDef"):
        wanted = {(ci.text or "").strip() for ci in variable.iter(f"{MATHML}ci")}
        assert wanted <= known, (variable.get("varID"), wanted - known)
        identity = variable.get("varID") or ""
        assert re.fullmatch(r"[A-Za-z_][\w.-]*", identity)
        assert identity not in known
        known.add(identity)
    provenances = {element.get("provID") for element in root.iter(f"{DAVEML}provenance")}
    assert {element.get("provID") for element in root.iter(f"{DAVEML}provenanceRef")} <= provenances


def evaluate(root: ET.Element, inputs: Mapping[str, float]) -> dict[str, float]:
    """The value of every variable by its varID; `inputs` by varID too."""
    values: dict[str, float] = {}
    for variable in root.iter(f"{DAVEML}variableDef"):
        identity = variable.attrib["varID"]
        calculation = variable.find(f"{DAVEML}calculation/{MATHML}math")
        if variable.find(f"{DAVEML}isInput") is not None:
            value = inputs[identity]
        elif calculation is not None:
            value = _number(calculation[0], values)
        else:
            value = float(variable.attrib["initialValue"])
        if "minValue" in variable.attrib:
            value = max(value, float(variable.attrib["minValue"]))
        if "maxValue" in variable.attrib:
            value = min(value, float(variable.attrib["maxValue"]))
        values[identity] = value
    return values


def failed_checks(root: ET.Element) -> list[tuple[str, str, float, float]]:
    """(case, signal, stated, computed) of every output of a check case that misses its tolerance."""
    names = {v.attrib["name"]: v.attrib["varID"] for v in root.iter(f"{DAVEML}variableDef")}
    units = {v.attrib["name"]: v.attrib["units"] for v in root.iter(f"{DAVEML}variableDef")}
    failed = []
    for shot in root.iter(f"{DAVEML}staticShot"):
        given = {}
        for signal in shot.findall(f"{DAVEML}checkInputs/{DAVEML}signal"):
            name = _text(signal, "signalName")
            assert _text(signal, "signalUnits") == units[name]
            given[names[name]] = float(_text(signal, "signalValue"))
        values = evaluate(root, given)
        for signal in shot.findall(f"{DAVEML}checkOutputs/{DAVEML}signal"):
            name, stated = _text(signal, "signalName"), float(_text(signal, "signalValue"))
            if abs(values[names[name]] - stated) > float(_text(signal, "tol")):
                failed.append((shot.attrib["name"], name, stated, values[names[name]]))
    return failed


def _text(element: ET.Element, tag: str) -> str:
    found = element.find(f"{DAVEML}{tag}")
    assert found is not None
    assert found.text is not None
    return found.text.strip()


def _number(element: ET.Element, values: Mapping[str, float]) -> float:
    name = local(element)
    if name == "cn":
        return float(element.text or "")
    if name == "ci":
        return values[(element.text or "").strip()]
    if name == "piecewise":
        for piece in element.findall(f"{MATHML}piece"):
            value, condition = piece
            if _number(condition, values):
                return _number(value, values)
        (otherwise,) = element.findall(f"{MATHML}otherwise")
        return _number(otherwise[0], values)
    assert name == "apply", name
    function, *operands = element
    return float(_OPERATORS[local(function)]([_number(operand, values) for operand in operands]))
