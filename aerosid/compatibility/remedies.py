"""Usual errors of channel maps: the factors and offsets that correct them, in words after "it agrees"."""

from __future__ import annotations

import itertools

import numpy as np

from aerosid.compatibility.settings import ContradictionSettings
from aerosid.flight_model.constants import GRAVITY
from aerosid.notation import number

SIGN = (-1.0, "with its sign changed")
_ANGLE = (
    SIGN,
    (np.pi / 180.0, "if its values are degrees and not radians"),
    (180.0 / np.pi, "if its values are radians and not degrees"),
)
_ACCELERATION = (
    SIGN,
    (GRAVITY, "if its values are multiples of g and not m/s^2"),
    (1.0 / GRAVITY, "if its values are m/s^2 and not multiples of g"),
)
SPEEDS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "knots": 0.514444, "ft/s": 0.3048, "mph": 0.44704}
"""Standard: units of airspeed, in m/s."""


def _airspeed_units(largest_scale: float) -> tuple[tuple[float, str], ...]:
    """Ratios of two units of airspeed, except those that an error of the pitot-static system could be."""
    pairs = itertools.permutations(SPEEDS, 2)
    return tuple(
        (ratio, f"if its values are {true} and not {declared} (a factor of {number(ratio, 4)})")
        for true, declared in pairs
        if max(ratio := SPEEDS[true] / SPEEDS[declared], 1.0 / ratio) > 1.0 + largest_scale
    )


AIRSPEED = _airspeed_units(ContradictionSettings().largest_scale)
"""Usual errors of airspeed: factors to be applied to the recorded values, and words."""

HEIGHT = (
    (0.3048, "if its values are feet and not metres"),
    (1.0 / 0.3048, "if its values are metres and not feet"),
)
"""Usual errors of altitude: factors to be applied to the recorded values, and words."""

FACTORS = {
    "rad": _ANGLE,
    "rad/s": _ANGLE,
    "m/s^2": _ACCELERATION,
    "m/s": AIRSPEED,
    "m": (SIGN, *HEIGHT),
}
"""Usual errors of channel maps, by unit: factors to be applied to the recorded values."""

OFFSETS = ((-GRAVITY, "with 9.81 m/s^2 subtracted"), (GRAVITY, "with 9.81 m/s^2 added"))
"""Difference of acceleration and specific force."""
