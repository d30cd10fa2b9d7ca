"""Aircraft of the installed JSBSim, as variants built at run time: without engines and lateral axes, controls driven.

Many of the files are under the GPL: they are read from the installed JSBSim and never copied.
"""

from __future__ import annotations

import importlib.util
import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from aerosid.errors import UsageError

_LATERAL_AXES = ("SIDE", "Y", "ROLL", "YAW")
_READ_IN = ("property", "p", "independentVar")

CONDITIONS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "DHC6": (67.0, 1500.0),
        "L410": (80.0, 1500.0),
        "OV10": (90.0, 1500.0),
        "c310": (72.0, 1500.0),
        "fokker50": (105.0, 3000.0),
        "t6texan2": (90.0, 1500.0),
        "737": (170.0, 6000.0),
    }
)
"""Airspeed [m/s] and altitude [m] of level cruise of the aircraft used most."""


@dataclass(frozen=True)
class StockParts:
    """Parts of an aircraft of JSBSim used in a variant.

    Attributes
    ----------
    name, title : str
        Name of the folder, and title in the file.
    elements : tuple of Element
        `<metrics>`, `<mass_balance>` and, where there are tanks, `<propulsion>` without engines.
    aerodynamics : Element
        Without lateral axes, unless these were requested.
    reads : tuple of str
        The properties read by the aerodynamics.
    elevator_limit, flap_limit, aileron_limit, rudder_limit : float
        Greatest deflections, rad, and of the flap, deg.
    point_masses : int
        Number of point masses in the mass balance.
    """

    name: str
    title: str
    elements: tuple[ET.Element, ...]
    aerodynamics: ET.Element
    reads: tuple[str, ...]
    elevator_limit: float
    flap_limit: float
    aileron_limit: float
    rudder_limit: float
    point_masses: int


def stock_folder() -> Path | None:
    """Folder of the installed JSBSim's aircraft; None where there is none."""
    found = importlib.util.find_spec("jsbsim")
    if found is None or not found.submodule_search_locations:
        return None
    folder = Path(found.submodule_search_locations[0]) / "aircraft"
    return folder if folder.is_dir() else None


def stock_aircraft() -> tuple[str, ...]:
    """Names of the installed JSBSim's aircraft, sorted."""
    folder = stock_folder()
    if folder is None:
        return ()
    return tuple(sorted(entry.name for entry in folder.iterdir() if (entry / f"{entry.name}.xml").is_file()))


def stock_parts(name: str, sideways: bool = False) -> StockParts:
    """The parts of the aircraft in a folder of that name, including its lateral axes where it is to fly in all of them.

    Raises
    ------
    UsageError
        Where JSBSim has no such aircraft, or the aircraft has no mass or no aerodynamics to fly.
    """
    folder = stock_folder()
    if folder is None or name not in stock_aircraft():
        raise UsageError(
            f"{name!r} is neither an aircraft file, nor a bundled aircraft, nor one of the installed JSBSim; known "
            f"there, for example: {', '.join(CONDITIONS)}."
        )
    source = folder / name / f"{name}.xml"
    root = _parsed(source)
    aerodynamics = root.find("aerodynamics")
    if aerodynamics is not None and aerodynamics.get("file"):
        aerodynamics = _parsed(_beside(source, str(aerodynamics.get("file"))))
    metrics, balance = root.find("metrics"), root.find("mass_balance")
    if aerodynamics is None or metrics is None or balance is None or aerodynamics.find("axis") is None:
        raise UsageError(f"JSBSim's aircraft {name} holds no mass or no aerodynamics that could be flown; try another.")
    for axis in aerodynamics.findall("axis"):
        if axis.get("name", "").upper() in _LATERAL_AXES and not sideways:
            aerodynamics.remove(axis)
    elements = [metrics, balance]
    propulsion = root.find("propulsion")
    if propulsion is not None and propulsion.find("tank") is not None:
        for engine in propulsion.findall("engine"):
            propulsion.remove(engine)
        elements.append(propulsion)
    for element in elements:
        # Symmetric: a mass listed on one side only would roll an aircraft without lateral aerodynamics.
        for y in element.iter("y"):
            y.text = "0.0"
    return StockParts(
        name=name,
        title=root.get("name") or name,
        elements=tuple(elements),
        aerodynamics=aerodynamics,
        reads=_reads(aerodynamics),
        elevator_limit=_travel(root, "fcs/elevator-pos-rad", math.radians(25.0)),
        flap_limit=_travel(root, "fcs/flap-pos-deg", 30.0),
        aileron_limit=_travel(root, "fcs/left-aileron-pos-rad", math.radians(20.0)),
        rudder_limit=_travel(root, "fcs/rudder-pos-rad", math.radians(20.0)),
        point_masses=len(balance.findall("pointmass")),
    )


def _beside(source: Path, name: str) -> Path:
    """Path by which JSBSim finds a file named in an aircraft."""
    places = [source.parent / folder / f"{name}{suffix}" for folder in (".", "Systems") for suffix in ("", ".xml")]
    return next((place for place in places if place.is_file()), places[0])


def _parsed(source: Path) -> ET.Element:
    try:
        return ET.parse(source).getroot()
    except (OSError, ET.ParseError) as error:
        found = error.strerror if isinstance(error, OSError) else error
        raise UsageError(f"{source.name} of the installed JSBSim cannot be read ({found}); try another.") from None


def _reads(aerodynamics: ET.Element) -> tuple[str, ...]:
    defined = {function.get("name") for function in aerodynamics.iter("function")}
    named = {
        element.text.strip().lstrip("-")
        for tag in _READ_IN
        for element in aerodynamics.iter(tag)
        if element.text and element.text.strip()
    }
    return tuple(sorted(named - defined))


def _travel(root: ET.Element, output: str, otherwise: float) -> float:
    """The greatest output of a control's component."""
    reach = 0.0
    for component in root.iter():
        if any((element.text or "").strip() == output for element in component.findall("output")):
            for tag in ("range/min", "range/max", "traverse/setting/position"):
                reach = max([reach, *(abs(_number(found.text)) for found in component.findall(tag))])
    return reach or otherwise


def _number(text: str | None) -> float:
    try:
        return float(text or "")
    except ValueError:
        return 0.0
