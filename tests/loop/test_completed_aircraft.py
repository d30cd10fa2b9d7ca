"""The list of effects in a completed aircraft file: declared effects act in the order in which they stand."""

from dataclasses import replace

from aerosid.effects import ActiveEffect, InputEffect
from aerosid.effects.control import control_lag, control_rate_limit
from aerosid.effects.sensor import sensor_bias
from aerosid.loop.completed_aircraft import listed_in_acting_order
from aerosid.search.findings import Finding


def found(active: ActiveEffect) -> Finding:
    return Finding(
        kind=active.effect.kind,
        where=active.effect.where,
        term="",
        entry=None,
        value=active.values[0],
        std_error=0.01,
        unit="s",
        time=None,
        p_value=1e-6,
        gain=40.0,
    )


def test_effects_on_one_control_are_listed_as_they_act_and_others_stay_where_they_are() -> None:
    limit = ActiveEffect(control_rate_limit("delta_e", 1.0, 0.1), (0.2,))
    lag = ActiveEffect(control_lag("delta_e"), (0.1,))
    assert isinstance(lag.effect, InputEffect)
    first = replace(lag, effect=replace(lag.effect, comes_first=True))
    bias = ActiveEffect(sensor_bias("q", "rad/s", 1e-3), (0.01,))
    rows = [found(limit), found(bias), found(lag)]
    assert [row.kind for row in listed_in_acting_order(rows, [bias, limit, lag])] == [row.kind for row in rows]
    assert [row.kind for row in listed_in_acting_order(rows, [bias, limit, first])] == [
        "control_lag",
        "sensor_bias",
        "control_rate_limit",
    ]
