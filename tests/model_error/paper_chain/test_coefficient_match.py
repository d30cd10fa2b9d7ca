"""How much of the measured coefficients a model explains: all, where it is right about sensors and controls too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import LIFT_AND_DRAG, NOISE, Problem, with_channels
from scipy.signal import lsim

from aerosid.effects import ActiveEffect, Effect
from aerosid.effects.control import control_lag
from aerosid.effects.sensor import sensor_bias, sensor_delay, sensor_lag, sensor_scale
from aerosid.logs.flight_log import FlightLog
from aerosid.model_error.paper_chain.coefficient_match import explained_shares

QUIET = Problem(duration=14.1, elevator="3211", amplitude=0.045, noise=dict.fromkeys(NOISE, 0.0))


def lagging(log: FlightLog, channel: str, constant: float) -> FlightLog:
    """The log with a channel behind a first-order lag."""
    values = log[channel] - log[channel][0]
    _, late, _ = lsim(([1.0 / constant], [1.0, 1.0 / constant]), values, log.time - log.time[0])
    return with_channels(log, **{channel: log[channel][0] + late})


@pytest.mark.parametrize(
    ("channel", "act", "effect", "value"),
    [
        ("alpha", lambda log: lagging(log, "alpha", 0.2), sensor_lag("alpha"), 0.2),
        (
            "alpha",
            lambda log: with_channels(log, alpha=np.interp(log.time - 0.12, log.time, log["alpha"])),
            sensor_delay("alpha"),
            0.12,
        ),
        ("q", lambda log: with_channels(log, q=1.2 * log["q"]), sensor_scale("q"), 1.2),
        ("a_z", lambda log: with_channels(log, a_z=log["a_z"] * 0.9), sensor_scale("a_z"), 0.9),
        ("alpha", lambda log: with_channels(log, alpha=log["alpha"] + 0.02), sensor_bias("alpha", "rad", 1e-3), 0.02),
    ],
)
def test_a_sensor_s_fault_is_not_held_against_the_derivatives(
    channel: str, act: object, effect: Effect, value: float
) -> None:
    assert callable(act)
    log = act(QUIET.fly())
    model, manoeuvre = QUIET.prepared(log)
    rows = explained_shares((model, ()), (model, (ActiveEffect(effect, (value,)),)), manoeuvre)
    assert {row.coefficient for row in rows} == {"C_X", "C_Z", "C_m"}
    # The rest is what differences of a lagged signal and of q make of the elevator's corners.
    assert all(row.r2_after > 0.9995 for row in rows), channel
    if effect.kind != "sensor_bias":
        assert min(row.r2_before for row in rows) < 0.99


def test_a_slow_control_acts_as_the_model_says() -> None:
    slow = replace(QUIET)
    log = slow.fly()
    constant = 0.15
    # The recorded command is what, lagged, gives the flown deflection.
    command = log["delta_e"] + constant * np.gradient(log["delta_e"], log.time)
    log = with_channels(log, delta_e=command)
    model, manoeuvre = slow.prepared(log)
    rows = explained_shares((model, ()), (model, (ActiveEffect(control_lag("delta_e"), (constant,)),)), manoeuvre)
    moment = next(row for row in rows if row.coefficient == "C_m")
    assert moment.r2_before < 0.97
    assert moment.r2_after > 0.99


def test_a_model_in_lift_and_drag_explains_forces_along_the_body_s_axes() -> None:
    problem = replace(QUIET, aircraft=LIFT_AND_DRAG)
    model, manoeuvre = problem.prepared(problem.fly())
    rows = explained_shares((model, ()), (model, ()), manoeuvre)
    assert all(row.r2_after > 0.9999 for row in rows)
