"""Thrust errors: a scale factor error of the engine model, or a change that no channel records.

Thrust T acts with F_x = T cos(incidence), F_z = -T sin(incidence) and the pitching moment T z_arm, and in terms with
C_T. An error of its factor or its arm alone, without the rest, is a term: C_X C_T, C_m C_T.

Thrust that builds up with a lag or time delay behind a recorded throttle or an engine model is treated as any control.

Engines of unequal thrust, or one that stops, move the line of thrust sideways: an arm y to the left of the centre of
gravity adds the yawing moment N = T y. Throughout a flight that is the term C_n C_T = y/b, from an instant on a step of
C_n that decreases as q_bar grows; at nearly constant airspeed the two are indistinguishable: the commoner is reported
with the arm as its alternative.
Source: Jategaonkar, Flight Vehicle System Identification, 2nd ed., AIAA 2015 (engine model with a scale factor).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aerosid.effects.control import THRUST_COLUMN, control_delay, control_lag
from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import EffectParameter, InputEffect
from aerosid.effects.limits import OFFERED
from aerosid.effects.step_input import offered_on_grid, rise_among, step_input
from aerosid.flight_model.axes import LATERAL
from aerosid.flight_model.terms import Term, parse_term

SOURCE = "Jategaonkar, Flight Vehicle System Identification, 2nd ed."
ARM_COLUMN = "thrust_arm"
"""Lateral arm of the thrust, m to the left of the centre of gravity."""


def thrust_scale() -> InputEffect:
    """The thrust that acts is `scale` times the recorded one."""
    return InputEffect(
        "thrust_scale",
        "thrust",
        (EffectParameter("scale", "1", trials=(1.0,), lowest=-2.0, highest=5.0, step=1e-3, null=1.0),),
        lambda _time, recorded, p: (p[0] - 1.0) * recorded,
        lambda _p, _interval: (1.0, 0.0),
        SOURCE,
        column=THRUST_COLUMN,
        driven_by="thrust",
    )


def thrust_change(time: float, interval: float) -> InputEffect:
    """A step of thrust by `change` at an instant near `time` [s]; both are estimated."""
    change = EffectParameter("change", "N", trials=(0.0,), lowest=-1e7, highest=1e7, step=1.0)
    return step_input("thrust_change", "thrust", THRUST_COLUMN, change, SOURCE, time, interval)


def arm_term() -> Term:
    """The term of C_n of a thrust arm to the left; its coefficient is one over the span."""
    return parse_term(f"C_T*{ARM_COLUMN}")


def _arm() -> EffectParameter:
    return EffectParameter("arm", "m", trials=(0.0,), lowest=-30.0, highest=30.0, step=1e-3)


def thrust_asymmetry() -> InputEffect:
    """The thrust acts `arm` m left of the centre of gravity throughout."""
    return InputEffect(
        "thrust_asymmetry",
        "thrust",
        (_arm(),),
        lambda _time, values, p: values + p[0],
        lambda _p, _interval: (1.0, 0.0),
        SOURCE,
        column=ARM_COLUMN,
    )


def thrust_asymmetry_step(time: float, interval: float) -> InputEffect:
    """The thrust acts `arm` m left of the centre of gravity from an instant near `time` [s] on; both are estimated."""
    return step_input("thrust_asymmetry", "thrust", ARM_COLUMN, _arm(), SOURCE, time, interval)


def _offered(
    flights: tuple[FlightData, ...], _controls: tuple[str, ...], coefficients: tuple[str, ...]
) -> Iterator[Offer]:
    if "C_X" not in flights[0].axes.coefficients:
        return  # forces along x are not modelled
    thrusts = [flight.inputs["thrust"] for flight in flights]
    mean = max(float(np.mean(np.abs(thrust))) for thrust in thrusts)
    variation = float(np.ptp(np.concatenate(thrusts)))
    if variation > OFFERED.least_thrust * mean > 0.0:
        yield Offer("thrust_scale", "thrust", (at_null(thrust_scale()),))
        for effect in (control_lag("thrust"), control_delay("thrust")):
            yield Offer(effect.kind, "thrust", (at_null(effect),))
    if coefficients:
        yield from offered_on_grid(flights, lambda time, interval: (thrust_change(time, interval),))


FAMILY = Family(
    (
        Kind(
            "thrust_scale",
            "input",
            "thrust is not the recorded one (acting / recorded)",
            lambda _where, _numbers, _interval: thrust_scale(),
            (Planted("thrust", {"scale": 0.8}, thrust_swing=0.4),),
            rarity=6.0,
        ),
        Kind(
            "thrust_change",
            "input",
            "thrust changes in a step",
            lambda _where, numbers, interval: thrust_change(numbers["time"], rise_among(numbers, interval)),
            (Planted("thrust", {"change": -3000.0, "time": 6.0}),),
            rarity=6.0,
        ),
        Kind(
            "thrust_asymmetry",
            "input",
            "thrust acts to the left of the centre of gravity",
            lambda _where, numbers, interval: (
                thrust_asymmetry_step(numbers["time"], rise_among(numbers, interval))
                if "time" in numbers
                else thrust_asymmetry()
            ),
            (Planted("thrust", {"arm": 0.3, "time": 6.0}, axes=LATERAL),),
            optional=("time",),
            rarity=6.0,
        ),
    ),
    _offered,
)
