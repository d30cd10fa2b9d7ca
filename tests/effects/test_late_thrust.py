"""Thrust behind its record: an engine lag or delay, by scipy's integrator, is named as for any control."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from equations_decided import decided
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.flight import Airframe, simulate
from problems import LIGHT, NOISE, Problem, with_channels
from scipy.signal import lsim

from aerosid.aircraft import DeclaredEffect
from aerosid.effects import KINDS, ActiveEffect, InputEffect
from aerosid.effects.control import control_delay, control_lag
from aerosid.errors import AircraftError
from aerosid.flight_model.simulation import trim
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.reporting.export.jsbsim_xml import aerodynamics_xml

Array = NDArray[np.float64]
FRAME = Airframe(LIGHT.wing_area, LIGHT.mean_chord, LIGHT.I_yy, LIGHT.airspeed, 100.0)
FLIGHT = Problem(duration=16.2, interval=0.06, elevator="3211", amplitude=0.045)


def behind(time: Array, command: Array) -> Array:
    """First order, 0.8 s, of a signal that is linear between samples."""
    return command[0] + lsim(([1.0], [0.8, 1.0]), command - command[0], time)[1]


def delayed(time: Array, command: Array) -> Array:
    return np.interp(time - 0.6, time, command)


@cache
def flown(act: Callable[[Array, Array], Array], seed: int, bent: float = 0.0) -> FlightLog:
    """The throttle steps twice and the thrust is `act` of it; recorded is the throttle.

    `bent`: an undeclared C_m alpha^2.
    """
    time, level = FLIGHT.time, trim(FLIGHT.truth, 100.0, LIGHT.density, LIGHT.mass)
    moved = 0.5 * ((time > 3.0) & (time <= 7.0)) - 0.4 * ((time > 10.0) & (time <= 13.0))
    command = level.thrust * (1.0 + moved)
    inputs = {"rho": LIGHT.density, "mass": LIGHT.mass, "thrust": act(time, command)}
    inputs["delta_e"] = level.delta_e + FLIGHT.deflection
    terms = {(d.coefficient, str(d.term)): d.value for d in LIGHT.derivatives}
    terms["C_m", "alpha^2"] = bent
    u, w = 100.0 * np.cos(level.alpha), 100.0 * np.sin(level.alpha)
    _, outputs = simulate((u, w, 0.0, level.alpha, 1500.0), time, inputs, terms, FRAME)
    generator = np.random.default_rng(seed)
    names = ("V", "alpha", "q", "theta", "a_x", "a_z", "q_dot", "h")
    seen = {
        name: column + NOISE[name] * generator.standard_normal(time.size)
        for name, column in zip(names, outputs.T, strict=True)
        if name in NOISE
    }
    return with_channels(FLIGHT.fly(seed, f"flight {seed}"), **seen, delta_e=inputs["delta_e"], thrust=command)


@pytest.mark.parametrize(
    ("act", "kind", "number"), [(behind, "control_lag", 0.8), (delayed, "control_delay", 0.6)], ids=["lag", "delay"]
)
@pytest.mark.parametrize("method", ["equations", "likelihood"])
def test_thrust_lag_is_named_with_its_time_constant(
    act: Callable[[Array, Array], Array], kind: str, number: float, method: str
) -> None:
    log = flown(act, 1)
    if method == "equations":
        (row,) = decided(LIGHT, [log], []).findings
        name, value, error = row.hypothesis.label, row.value, row.std_error
    else:
        quick = LoopSettings(
            method="likelihood", paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False
        )
        (effect,) = close_loop([log], LIGHT, settings=quick).effects
        name, value, error = (effect.kind, effect.where, effect.term), effect.value, effect.std_error
    assert name == (kind, "thrust", "")
    assert abs(value - number) < max(4.0 * error, 0.02)


def test_thrust_lag_is_tried_too_where_the_residual_is_gross() -> None:
    quick = LoopSettings(
        method="likelihood", paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False
    )
    result = close_loop([flown(behind, 2, bent=-2.5)], LIGHT, settings=quick)
    named = {(effect.kind, effect.where, effect.term): effect.value for effect in result.effects}
    assert set(named) == {("control_lag", "thrust", ""), ("aero_term", "C_m", "alpha^2")}
    assert named["control_lag", "thrust", ""] == pytest.approx(0.8, abs=0.05)


def test_a_thrust_lag_adds_the_difference_of_lagged_and_recorded_thrust() -> None:
    time = 0.05 * np.arange(200)
    record = 5000.0 + 800.0 * np.sin(time)
    for effect, number, wanted in ((control_lag("thrust"), 0.8, behind), (control_delay("thrust"), 0.6, delayed)):
        assert (effect.where, effect.driven_by, effect.where_acts) == ("thrust", "thrust", "thrust_change")
        added = effect.transform(time, record, (number,))
        assert_allclose(record + added, wanted(time, record), atol=1e-6 * 5000.0)
        assert not effect.transform(time, record, (0.0,)).any()


def test_a_file_may_declare_it_and_jsbsim_refuses_it_with_a_sentence() -> None:
    made = KINDS["control_lag"].made("thrust", {"time_constant": 0.8}, 0.05)
    assert isinstance(made, InputEffect)
    assert ActiveEffect(made, (0.8,)).effect.where_acts == "thrust_change"
    late = replace(LIGHT, effects=(DeclaredEffect("control_lag", "thrust", 0.8),))
    with pytest.raises(AircraftError, match="engine"):
        aerodynamics_xml(late)
