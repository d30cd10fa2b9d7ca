"""Sensor position errors: the rotation about the centre of gravity enters the sensor's reading.

A vane x ahead of its declared position measures w - q x, one of sideslip beta + (x r - z p)/V, a pitot tube z below
V + q z, an accelerometer the acceleration at its own position. Klein & Morelli, Aircraft System Identification, section
10.2 (sensor position corrections).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import UNIT, EffectParameter, PositionEffect
from aerosid.effects.limits import OFFERED
from aerosid.flight_model.axes import ACCELEROMETERS, LATERAL, SIX

SHOWN_BY_PITCHING = (("alpha", "x"), ("a_z", "x"), ("a_x", "z"), ("V", "z"))
"""Sensors and the body axes of their positions that a pitching motion shows."""

SHOWN_BY_TURNING = (("beta", ("x", "z", "xz")), ("a_y", ("x", "z", "xz", "y")))
"""Sensors and the body axes of their positions that rolling and yawing motion shows, alone and together."""

SHOWN_BY_ROLLING = (("alpha", ("y", "x")), ("a_z", ("y", "x", "xy")), ("a_x", ("y", "z")))
"""The same of the sensors of pitching motion, where all motion is integrated: a wing's vane reads alpha + p y/V."""


AHEAD = "x"
"""Body axis along which pitching shows the position of a vane, and of the accelerometers in one unit."""

READ_AS_UNIT = {"a_z": 1.0, "alpha": -1.0}
"""Standard: direction of the unit for that in which pitching shows a sensor off its place; a vane behind reads as a
unit ahead."""

OF_UNIT = ("xz", "z", "y")
"""Body axes of the position of all accelerometers in one unit, where all motion is integrated. Pitching alone
does not tell the unit from a late vane beside a pitot tube: of the Twin Otter it was named in place of both, and C_X of
the flight that was not fitted had R^2 .90 in place of .94. There it is only compared with a position that was found."""

SAME_PLACE = 1e-6
"""Numerical: m, by which two declared positions may differ and still be one."""


def farthest_place(channel: str, mean_chord: float, length: float | None = None) -> float:
    """Largest distance of a channel's sensor from the centre of gravity, m.

    Parameters
    ----------
    channel : str
        A vane may be on a boom; an accelerometer, or a unit of them, is inside.
    mean_chord : float
        m.
    length : float, optional
        Of the aircraft, m; by default a multiple of its chord.
    """
    fraction = OFFERED.reach_inside if channel in (*ACCELEROMETERS, UNIT) else OFFERED.reach
    return fraction * (length or OFFERED.length_in_chords * mean_chord)


def sensor_position(channel: str, axis: str) -> PositionEffect:
    """The sensor lies `position` m further along a body axis, x forward or z down, than declared."""
    return _position_effect(channel, axis, ("position",))


def sensor_place(channel: str, axes: str) -> PositionEffect:
    """The sensor lies further along some body axes, letters of x forward, y right and z down, one parameter each, m."""
    return _position_effect(channel, axes, tuple(axes))


def _position_effect(channel: str, axes: str, names: tuple[str, ...]) -> PositionEffect:
    return PositionEffect(
        "sensor_position",
        channel,
        tuple(
            EffectParameter(name, "m", trials=(0.0,), lowest=-OFFERED.furthest, highest=OFFERED.furthest, step=1e-2)
            for name in names
        ),
        axes,
        "Klein & Morelli, Aircraft System Identification, section 10.2",
    )


def _made(where: str, numbers: Mapping[str, float], _interval: float) -> PositionEffect:
    """Along the axes that are given; a parameter without one lies along the axis that pitching shows."""
    axes = "".join(axis for axis in "xyz" if axis in numbers)
    return sensor_place(where, axes) if axes else sensor_position(where, dict(SHOWN_BY_PITCHING).get(where, "x"))


def _offered(
    flights: tuple[FlightData, ...], _controls: tuple[str, ...], _coefficients: tuple[str, ...]
) -> Iterator[Offer]:
    """Positions shown by the integrated motion: by rolling and yawing where there is any, else by pitching."""
    integrated = set(flights[0].axes.integrated)
    if {"p", "r"} <= integrated:
        shown = (*SHOWN_BY_TURNING, *(SHOWN_BY_ROLLING if "q" in integrated else ()))
        places = [(channel, sensor_place(channel, axes)) for channel, ways in shown for axes in ways]
    else:
        places = [(channel, sensor_position(channel, axis)) for channel, axis in SHOWN_BY_PITCHING]
    for channel, place in places:
        if any(channel in flight.measured for flight in flights):
            yield Offer("sensor_position", channel, (at_null(place),))
    turns = {"p", "q", "r"} <= integrated
    if turns and any(sum(channel in flight.measured for channel in ACCELEROMETERS) > 1 for flight in flights):
        for axes in OF_UNIT:
            yield Offer("sensor_position", UNIT, (at_null(sensor_place(UNIT, axes)),))


def are_beside_each_other(ahead: Mapping[str, float]) -> bool:
    """Whether the accelerometers that pitching shows are both measured, and declared at one distance ahead.

    Parameters
    ----------
    ahead : mapping of str to float
        Position along x of the sensor of each measured channel, m.
    """
    return {"a_x", "a_z"} <= ahead.keys() and math.isclose(ahead["a_x"], ahead["a_z"], abs_tol=SAME_PLACE)


FAMILY = Family(
    (
        Kind(
            "sensor_position",
            "channel",
            "the sensor position of {where} is in error",
            _made,
            (
                Planted("alpha", {"position": 6.0}),
                Planted("beta", {"x": 5.0, "z": -0.4}, axes=LATERAL),
                Planted(UNIT, {"x": 1.5, "z": 0.4}, axes=SIX),
            ),
            optional=("position", "x", "y", "z"),
            rarity=6.0,
            rare_places=(UNIT,),
        ),
    ),
    _offered,
)
