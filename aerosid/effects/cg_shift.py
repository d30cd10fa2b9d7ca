"""Centre-of-gravity shift: an error of its declared position, or a step in flight.

Forces keep their lines of action. About a centre of gravity that lies x ahead of and z below the declared one, the
moment gains x F_z - z F_x, with F all forces but the weight: C_m gains (x C_Z - z C_X)/c, thrust its part, so that a
shift forward (x > 0) pitches the nose down in lifting flight. A centre of gravity that lies y to the right, as with
unbalanced fuel, adds the rolling moment -y F_z and the yawing moment y F_x. Sensors keep their places in the aircraft:
their positions from the centre of gravity change by -x, -z, so that an accelerometer shows the shift through q_dot.
The moment of inertia is unchanged. Etkin & Reid, Dynamics of Flight, 3rd ed., section 2.3 (moments about another
point); Klein & Morelli, Aircraft System Identification, section 10.1 (accelerometers away from the centre of gravity).

While the derivatives of C_m are free they absorb the moment of a shift that lasts the whole flight; only a small effect
on the accelerometers remains. The shift is a candidate where they are measured; the score test excludes it where it is
collinear with the derivatives. A shift during the flight shows in the moment.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import EffectParameter, InputEffect
from aerosid.effects.step_input import offered_on_grid, rise_among, step_input

SOURCE = "moments about another point, Etkin & Reid, Dynamics of Flight, section 2.3"


def centre_column(axis: str) -> str:
    """The input column that moves the centre of gravity along body x (forward), y (right) or z (down), m."""
    return f"cg_shift_{axis}"


def _shift() -> EffectParameter:
    return EffectParameter("shift", "m", trials=(0.0,), lowest=-5.0, highest=5.0, step=1e-3)


def cg_shift(axis: str) -> InputEffect:
    """The centre of gravity lies `shift` ahead of (axis x), right of (y) or below (z) the declared one throughout."""
    return InputEffect(
        "cg_shift",
        axis,
        (_shift(),),
        lambda _time, values, p: values + p[0],
        lambda _p, _interval: (1.0, 0.0),
        SOURCE,
        column=centre_column(axis),
    )


def cg_shift_step(axis: str, time: float, interval: float) -> InputEffect:
    """The centre of gravity moves by `shift` along an axis at an instant near `time` [s]; both are estimated."""
    return step_input("cg_shift", axis, centre_column(axis), _shift(), SOURCE, time, interval)


SHOWN = (("x", "a_z", ("C_Z", "C_m")), ("z", "a_x", ("C_X", "C_m")), ("y", "a_z", ("C_Z", "C_l")))
"""Body axis, the sensor that shows a lasting shift along it, and the force and the moment that it couples."""

MOVING = ("x", "y")
"""Axes along which it may move in flight."""


def _offered(
    flights: tuple[FlightData, ...], _controls: tuple[str, ...], coefficients: tuple[str, ...]
) -> Iterator[Offer]:
    """A constant shift where accelerometers were recorded; a step wherever step changes are candidates."""
    for axis, sensor, coupled in SHOWN:
        if not set(coupled) <= set(flights[0].axes.coefficients):
            continue
        if any(sensor in flight.measured for flight in flights):
            yield Offer("cg_shift", axis, (at_null(cg_shift(axis)),))
        if coefficients and axis in MOVING:
            yield from offered_on_grid(flights, partial(_moving, axis))


def _moving(axis: str, time: float, interval: float) -> tuple[InputEffect, ...]:
    return (cg_shift_step(axis, time, interval),)


FAMILY = Family(
    (
        Kind(
            "cg_shift",
            "axis",
            "the centre of gravity is displaced along {where}",
            lambda where, numbers, interval: (
                cg_shift_step(where, numbers["time"], rise_among(numbers, interval))
                if "time" in numbers
                else cg_shift(where)
            ),
            (Planted("x", {"shift": 0.06, "time": 4.0}),),
            optional=("time",),
            noun="a shift of the centre of gravity",
            rarity=6.0,
        ),
    ),
    _offered,
)
