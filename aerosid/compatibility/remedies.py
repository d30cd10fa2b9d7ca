"""Usual errors of channel maps: the factors and offsets that correct them, in words after "it agrees"."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from aerosid.compatibility.settings import ContradictionSettings
from aerosid.flight_model.constants import GRAVITY
from aerosid.logs.flight_log import ChannelSource
from aerosid.logs.formats.units import UnitProblem, conversion
from aerosid.notation import number

SIGN = (-1.0, "with its sign changed")

SPEEDS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "knots": 0.514444, "ft/s": 0.3048, "mph": 0.44704}
"""Standard: units of airspeed, in m/s."""

_ANGLES = {"degrees": np.pi / 180.0, "radians": 1.0}

_ACCELERATIONS = {"multiples of g": GRAVITY, "m/s^2": 1.0}

_LENGTHS = {"feet": 0.3048, "metres": 1.0}
"""Standard: units of altitude, in m."""

_UNITS = {"rad": _ANGLES, "rad/s": _ANGLES, "m/s^2": _ACCELERATIONS, "m/s": SPEEDS, "m": _LENGTHS}
"""Usual units of a channel, in the glossary's."""

_SAME = 1e-3
"""Numerical: relative difference of two units that are one, by the digits with which they are written."""

OFFSETS = ((-GRAVITY, "with 9.81 m/s^2 subtracted"), (GRAVITY, "with 9.81 m/s^2 added"))
"""Difference of acceleration and specific force."""


def unit_remedies(unit: str, source: ChannelSource | None) -> tuple[tuple[float, str], ...]:
    """Ratios of the units that the values may have to the declared one: factors for the recorded values, and words.

    Ratios that an error of the pitot-static system could be are left out of those of airspeed.

    Parameters
    ----------
    unit : str
        The glossary's unit of the channel.
    source : ChannelSource or None
        Where the channel was read; None where no unit was declared, and any may have been taken for any other.
    """
    units = _UNITS[unit]
    declared = _declared(unit, source)
    pairs = itertools.permutations(units, 2) if declared is None else ((name, declared[0]) for name in units)
    sizes = units if declared is None else {**units, declared[0]: declared[1]}
    least = 1.0 + (ContradictionSettings().largest_scale if units is SPEEDS else _SAME)
    return tuple(
        (ratio, f"if its values are {true} and not {taken}{_factor(ratio) if units is SPEEDS else ''}")
        for true, taken in pairs
        if max(ratio := sizes[true] / sizes[taken], 1.0 / ratio) > least
    )


def sign_and_unit_remedies(unit: str, source: ChannelSource | None) -> tuple[tuple[float, str], ...]:
    """The sign, and the ratios of units: an airspeed has no other sign."""
    signs: Sequence[tuple[float, str]] = () if unit == "m/s" else (SIGN,)
    return *signs, *unit_remedies(unit, source)


def _factor(ratio: float) -> str:
    return f" (a factor of {number(ratio, 4)})"


def _declared(unit: str, source: ChannelSource | None) -> tuple[str, float] | None:
    """The declared unit, by its usual name if it has one, and its size; None where it is unknown or scaled besides."""
    if source is None or abs(source.scale) != 1.0:
        return None
    try:
        size = conversion(source.unit, unit).factor
    except UnitProblem:
        return None
    usual = ((name, other) for name, other in _UNITS[unit].items() if abs(size / other - 1.0) < _SAME)
    return next(usual, (source.unit, size))
