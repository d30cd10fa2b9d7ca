"""Step change of a coefficient: flap, gear, speed brake, ice shedding."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted
from aerosid.effects.kinds import EffectParameter, InputEffect
from aerosid.effects.step_input import offered_on_grid, rise_among, step_input
from aerosid.flight_model.terms import Factor, Term


def offset_column(coefficient: str) -> str:
    """The input column that adds to a coefficient directly."""
    return f"offset_{coefficient}"


def offset_term(coefficient: str) -> Term:
    """The term of that column."""
    return Term((Factor(offset_column(coefficient), "plain", 0.0, 1),))


def step_change(coefficient: str, time: float, interval: float) -> InputEffect:
    """A step of the coefficient by `jump` at an instant near `time` [s]; both are estimated."""
    return step_input(
        "step_change",
        coefficient,
        offset_column(coefficient),
        EffectParameter("jump", "1", trials=(0.0,), lowest=-10.0, highest=10.0, step=1e-3),
        "configuration change at an unknown time",
        time,
        interval,
    )


def _offered(
    flights: tuple[FlightData, ...], _controls: tuple[str, ...], coefficients: tuple[str, ...]
) -> Iterable[Offer]:
    """All coefficients together, since a configuration change affects all of them."""
    if not coefficients:
        return ()
    return offered_on_grid(flights, partial(_all_at_once, coefficients))


def _all_at_once(coefficients: tuple[str, ...], time: float, interval: float) -> tuple[InputEffect, ...]:
    return tuple(step_change(name, time, interval) for name in coefficients)


FAMILY = Family(
    (
        Kind(
            "step_change",
            "coefficient",
            "{where} changes in a step",
            lambda where, numbers, interval: step_change(where, numbers["time"], rise_among(numbers, interval)),
            (Planted("C_m", {"jump": -0.015, "time": 6.0}),),
        ),
    ),
    _offered,
)
