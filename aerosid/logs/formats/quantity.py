"""A number with its unit as text, `12 deg`, `180 kt`, `5.2 ft`, converted to a wanted unit."""

from __future__ import annotations

import math
import re

from aerosid.logs.formats.units import UnitProblem, conversion

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_LONGEST = 80
"""Format: maximum number of characters of a quantity."""


def read_quantity(text: str, wanted: str) -> float:
    """The number in the wanted unit; a bare number is in that unit already.

    Parameters
    ----------
    text : str
        A number, followed by its unit where that is another one.
    wanted : str
        The unit of the result, such as rad, m/s, kg m^2.

    Raises
    ------
    UnitProblem
        Where there is no finite number, or the unit is unknown or of another dimension.
    """
    matched = _QUANTITY.fullmatch(text) if len(text) <= _LONGEST else None
    if matched is None:
        raise UnitProblem(f"is not a number with a unit; one such as `1.5 {wanted}` was expected")
    value, unit = float(matched[1]), matched[2]
    if unit:
        factor, shift = conversion(unit, wanted)
        value = factor * value + shift
    if not math.isfinite(value):
        raise UnitProblem("is out of range")
    return value
