"""A sensor that sits elsewhere than declared: the motion about the centre of gravity shows in what it reads.

A vane x ahead of its declared place sees w - q x; an accelerometer the accelerations of its own place. Klein & Morelli,
Aircraft System Identification, section 10.2 (sensor position corrections).
"""

from __future__ import annotations

from aerosid.effects.family import Family, Kind, Planted
from aerosid.effects.kinds import EffectParameter, PositionEffect

SHOWN_BY_PITCHING = (("alpha", "x"), ("a_z", "x"), ("a_x", "z"))
"""Sensors and the body axes of their positions that a pitching motion shows."""


def sensor_position(channel: str, axis: str) -> PositionEffect:
    """The sensor lies `position` m further along a body axis, x forward or z down, than declared."""
    return PositionEffect(
        "sensor_position",
        channel,
        (EffectParameter("position", "m", trials=(0.0,), lowest=-30.0, highest=30.0, step=1e-2),),
        axis,
        "Klein & Morelli, Aircraft System Identification, section 10.2",
    )


FAMILY = Family(
    (
        Kind(
            "sensor_position",
            "channel",
            "the sensor of {where} sits elsewhere than declared",
            lambda where, _numbers, _interval: sensor_position(where, dict(SHOWN_BY_PITCHING)[where]),
            (Planted("alpha", {"position": 6.0}),),
        ),
    ),
)
"""The equation-error regression asks for it by itself."""
