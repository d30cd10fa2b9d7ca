"""Conversion of units as written by recorders to the glossary's units."""

from __future__ import annotations

import math
import re
from functools import cache, lru_cache
from typing import TYPE_CHECKING, NamedTuple

from aerosid.logs.formats.table import shown

if TYPE_CHECKING:
    import pint

_LONGEST = 40
"""Format: maximum number of characters of a unit: longer text is refused before it is parsed."""

_FACTOR = re.compile(
    r"(?P<name>1(?!\d)|[^\W\d]+|°[A-Za-z]?|%|-+)"
    r"(?:(?:\s*(?:\^|\*\*)\s*\(?)?(?P<power>(?:(?<![A-Za-z_])[+-])?\d)\)?(?!\d))?"
)
_SEPARATOR = re.compile(r"\s*([*/])\s*|\s+")
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻·×", "0123456789-**")

# Spellings of recorders that pint does not know or misinterprets; lower case matches any case.
_ALIASES = {
    "kt": "knot",
    "kts": "knot",
    "kn": "knot",
    "knots": "knot",
    "°": "degree",
    "degs": "degree",
    "°c": "degC",
    "degc": "degC",
    "°f": "degF",
    "°k": "kelvin",
    "k": "kelvin",
    "%": "percent",
    "pct": "percent",
    "prozent": "percent",
    "-": "dimensionless",
    "--": "dimensionless",
    "---": "dimensionless",
    "none": "dimensionless",
    "1": "dimensionless",
    "sec": "second",
    "msec": "millisecond",
    "usec": "microsecond",
    "mps": "meter/second",
    "fps": "foot/second",
    "fpm": "foot/minute",
    "rps": "radian/second",
    "radps": "radian/second",
    "degps": "degree/second",
    "lb": "pound",
    "lbs": "pound",
    "lbf": "pound_force",
    "gn": "standard_gravity",
    "g_0": "standard_gravity",
    "mbar": "millibar",
    "inhg": "inch_Hg",
}

# Meaning of an upper-case header where the text as written does not fit: M and S would be molar and siemens. Only
# names that no other case turns into another prefix are listed (MPA could be mPa).
_SHOUTED = {
    name.upper(): name for name in ("m", "s", "deg", "rad", "Pa", "hPa", "kPa", "kg", "N", "ft", "Hz", "K", "g")
}


class Conversion(NamedTuple):
    """value in the wanted unit = factor * value + shift."""

    factor: float
    shift: float


class UnitProblem(ValueError):
    """A unit that cannot be read, or has another dimension; the message is a clause without the file's name."""


@lru_cache(maxsize=512)
def conversion(unit: str, wanted: str) -> Conversion:
    """The conversion of numbers in `unit` to `wanted`.

    Parameters
    ----------
    unit : str
        As written in the file or the channel map: products, quotients and powers of unit names.
    wanted : str
        The glossary's unit.

    Raises
    ------
    UnitProblem
        If `unit` is not known or its dimension is another one.

    Notes
    -----
    An angle is treated as a dimension of its own: pint converts per cent to an angle, and a recorder's per cent of
    elevator travel must not become radians. A bare number counts as radians. `g` is standard gravity in an acceleration
    and gram elsewhere. The text is never evaluated: it is split by a pattern and each name is looked up.
    """
    if unit == wanted:
        return Conversion(1.0, 0.0)
    if len(unit) > _LONGEST:
        raise UnitProblem(f"has a unit of {len(unit)} characters, but a unit such as [{wanted}] was expected")
    registry = _registry()
    target = registry.parse_units(_canonical(wanted, registry, gravity=False))
    gravity = target.dimensionality == registry.parse_units("meter/second**2").dimensionality
    source = _matching(unit, target, registry, gravity=gravity)
    if source is None:
        raise UnitProblem(f"has the unit {shown(unit)}, but a unit that converts to [{wanted}] was expected")
    zero = float(registry.Quantity(0.0, source).to(target).magnitude)
    one = float(registry.Quantity(1.0, source).to(target).magnitude)
    factor = one - zero if zero else one
    # An offset is valid for temperatures only; decibels would pass for a dimensionless unit and are not linear.
    if zero and target.dimensionality != registry.parse_units("kelvin").dimensionality:
        raise UnitProblem(
            f"has the logarithmic unit {shown(unit)}, but a unit that converts to [{wanted}] was expected"
        )
    if not (math.isfinite(factor) and factor != 0.0):
        raise UnitProblem(f"has the unit {shown(unit)}, whose conversion to [{wanted}] is out of range")
    return Conversion(factor, zero)


@cache
def _registry() -> pint.UnitRegistry[float]:
    """The unit registry, created once and only for a log not in SI units: it takes a third of a second."""
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def _matching(unit: str, target: pint.Unit, registry: pint.UnitRegistry[float], *, gravity: bool) -> pint.Unit | None:
    """The unit as written, or as the meaning of an upper-case header, where it has the target's dimension."""
    meant = re.sub(r"[A-Za-z]+", lambda name: _SHOUTED.get(name[0].upper(), name[0]), unit)
    problem: UnitProblem | None = None
    for text in dict.fromkeys((unit, meant)):
        try:
            written = _canonical(text, registry, gravity=gravity)
        except UnitProblem as error:
            problem = problem or error
            continue
        source = registry.parse_units(written)
        if source.dimensionality == target.dimensionality and _same_angle(source, target, written, registry):
            return source
        problem = None
    if problem is not None:
        raise problem
    return None


def _canonical(unit: str, registry: pint.UnitRegistry[float], *, gravity: bool) -> str:
    """The unit in pint's spelling; raises UnitProblem where it is not a unit."""
    text = unit.strip().translate(_SUPERSCRIPTS)
    if not text:
        raise UnitProblem("has an empty unit, but a unit such as [deg], or [1] where there is none, was expected")
    position, sign, factors = 0, 1, []
    while position < len(text):
        match = _FACTOR.match(text, position)
        if match is None or not match["name"]:
            raise UnitProblem(f"has the unit {shown(unit)}, which is not known")
        power = sign * int(match["power"] or 1)
        if power == 0:
            raise UnitProblem(f"has the unit {shown(unit)}, which is not known")
        name = _pint_name(match["name"], unit, registry, gravity=gravity)
        factors.append(name if power == 1 else f"({name})**({power})")
        separator = _SEPARATOR.match(text, match.end())
        if separator is None and match.end() < len(text):
            raise UnitProblem(f"has the unit {shown(unit)}, which is not known")
        position = separator.end() if separator else len(text)
        sign = -1 if separator and separator[1] == "/" else 1
        if separator and position >= len(text):
            raise UnitProblem(f"has the unit {shown(unit)}, which is not known")
    return " * ".join(factors)


def _pint_name(name: str, unit: str, registry: pint.UnitRegistry[float], *, gravity: bool) -> str:
    name = name.strip()
    if gravity and name in ("g", "G"):
        return "standard_gravity"
    for candidate in (_ALIASES.get(name), name, _ALIASES.get(name.lower()), name.lower()):
        if candidate is not None and (candidate in _ALIASES.values() or registry.parse_unit_name(candidate)):
            return candidate
    raise UnitProblem(f"has the unit {shown(unit)}, which is not known")


def _same_angle(source: pint.Unit, target: pint.Unit, written: str, registry: pint.UnitRegistry[float]) -> bool:
    """Whether both contain angles to the same power, or the source is a bare number (per second) for radians."""
    powers = [dict(registry.get_root_units(unit)[1]._units).get("radian", 0) for unit in (source, target)]
    if powers[0] == powers[1]:
        return True
    bare = {"dimensionless", "s", "second"}
    return powers[0] == 0 and set(re.findall(r"[a-zA-Z_]+", written)) <= bare
