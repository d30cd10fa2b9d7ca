"""Centre-of-gravity shift: it lies elsewhere than declared, or moves in flight.

Forces keep their lines of action. About a centre of gravity that lies x ahead of and z below the declared one, the
moment gains x F_z - z F_x, with F all forces but the weight: C_m gains (x C_Z - z C_X)/c, thrust its share, so that a
shift forward (x > 0) pitches the nose down in lifting flight. One that lies y to the right, as fuel makes it that is
not balanced, rolls by -y F_z and yaws by y F_x. Sensors keep their places in the aircraft: their
positions from the centre of gravity change by -x, -z, which is how an accelerometer sees the shift through q_dot.
The moment of inertia is left as it is. Etkin & Reid, Dynamics of Flight, 3rd ed., section 2.3 (moments about another
point); Klein & Morelli, Aircraft System Identification, section 10.1 (accelerometers away from the centre of gravity).

While the derivatives of C_m are free they take up the moment of a shift that lasts the whole flight; what is left of it
is small and belongs to the accelerometers. It is offered where that is measured; the score test leaves it out where
nothing of it is its own. A shift during the flight shows itself in the moment.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from aerosid.effects.family import Family, Flown, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import EffectParameter, InputEffect
from aerosid.effects.sudden import offered_on_a_grid, sudden

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


def sudden_cg_shift(axis: str, time: float, interval: float) -> InputEffect:
    """The centre of gravity moves by `shift` along an axis at a moment near `time` [s]; both are estimated."""
    return sudden("cg_shift", axis, centre_column(axis), _shift(), SOURCE, time, interval)


SHOWN = (("x", "a_z", ("C_Z", "C_m")), ("z", "a_x", ("C_X", "C_m")), ("y", "a_z", ("C_Z", "C_l")))
"""Body axis, the sensor that shows a lasting shift along it, and the force and the moment that it couples."""

MOVING = ("x", "y")
"""Axes along which it may move in flight."""


def _offered(flights: tuple[Flown, ...], _controls: tuple[str, ...], coefficients: tuple[str, ...]) -> Iterator[Offer]:
    """A lasting shift where accelerometers were read; a sudden one wherever anything may be sudden."""
    for axis, sensor, coupled in SHOWN:
        if not set(coupled) <= set(flights[0].axes.coefficients):
            continue
        if any(sensor in flown.measured for flown in flights):
            yield Offer("cg_shift", axis, (at_null(cg_shift(axis)),))
        if coefficients and axis in MOVING:
            yield from offered_on_a_grid(flights, partial(_moving, axis))


def _moving(axis: str, time: float, interval: float) -> tuple[InputEffect, ...]:
    return (sudden_cg_shift(axis, time, interval),)


FAMILY = Family(
    (
        Kind(
            "cg_shift",
            "axis",
            "the centre of gravity lies elsewhere along {where}",
            lambda where, numbers, interval: (
                sudden_cg_shift(where, numbers["time"], interval) if "time" in numbers else cg_shift(where)
            ),
            (Planted("x", {"shift": 0.06, "time": 4.0}),),
            optional=("time",),
            noun="a shift of the centre of gravity",
            rarity=6.0,
        ),
    ),
    _offered,
)
