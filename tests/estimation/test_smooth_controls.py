"""Controls that are smooth between samples: what lines through corrected samples contain, and what is named then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from problems import LIGHT, NOISE, Problem, with_channels, with_thrust
from scipy.signal import butter, lfilter

from aerosid.aircraft.declared_model import declared_model
from aerosid.effects import ActiveEffect, InputEffect, frozen
from aerosid.effects.control import control_delay, control_lag
from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.smooth_controls import bent_controls, smoothly_late, with_smooth_controls
from aerosid.flight_model.simulation import fly, trim
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.signals.delay_and_lag import lagged

Array = NDArray[np.float64]
MODEL = declared_model(LIGHT, 100.0)
ELEVATOR = len(MODEL.columns) - 1
FREE = tuple((d.coefficient, d.term) for d in LIGHT.derivatives)
STEP = 0.0025
QUIET = dict.fromkeys(NOISE, 0.0)
QUICK = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)


def filtered(values: Array, bandwidth: float) -> Array:
    """Behind a recorder's filter, Hz, at the simulation's step."""
    return np.asarray(lfilter(*butter(2, bandwidth, fs=1.0 / STEP), values - values[0]) + values[0])


def recorded(every: int, bandwidth: float, seed: int, lag: float = 0.0) -> FlightLog:
    """A log of every so manieth sample of a simulation at 400 Hz, filtered as the elevator is; it lags behind that."""
    fine = Problem(elevator="3211", duration=20.0, interval=STEP)
    time = fine.time
    surface = fine.deflection if lag == 0.0 else lagged(time, fine.deflection[:, None], lag)[:, 0]
    density, mass = LIGHT.density, LIGHT.mass
    assert density is not None
    level = trim(fine.truth, fine.airspeed, density, mass)
    flown = fly(fine.truth, level, time, surface, density=density, mass=mass, noise=QUIET, seed=0)
    generator = np.random.default_rng(seed)
    channels = {
        name: filtered(values, bandwidth)[::every]
        + NOISE.get(name, 0.0) * generator.standard_normal(time[::every].size)
        for name, values in flown.channels.items()
    }
    noise = NOISE["delta_e"] * generator.standard_normal(time[::every].size)
    elevator = level.delta_e + filtered(fine.deflection, bandwidth)[::every] + noise
    log = FlightLog("flight", time[::every], channels, dict(flown.units))
    return with_thrust(with_channels(log, delta_e=elevator), level.thrust)


def prepared(log: FlightLog) -> Manoeuvre:
    return prepare(log, LIGHT, MODEL.columns)


def fitted(manoeuvre: Manoeuvre) -> Refinement:
    return refine(MODEL, [manoeuvre], FREE, settings=WRONG_STRUCTURE)


def test_only_controls_that_bend_and_neither_step_nor_are_held_are_asked_about() -> None:
    assert bent_controls([prepared(recorded(16, 6.0, 0))]) == ("delta_e",)
    stepped = prepared(Problem(elevator="3211", duration=20.0, interval=0.04).fly())
    assert bent_controls([stepped]) == ()
    assert bent_controls([prepared(recorded(16, 6.0, 0)), stepped]) == ()
    held = prepared(recorded(16, 6.0, 0))
    assert bent_controls([replace(held, flight=held.flight._replace(held=np.array([ELEVATOR])))]) == ()
    slow = np.sin(0.2 * np.pi * np.arange(0.0, 20.0, 0.04))
    gentle = stepped.flight.inputs[: slow.size].copy()
    gentle[:, ELEVATOR] = slow
    flight = stepped.flight._replace(time=stepped.flight.time[: slow.size], inputs=gentle)
    assert bent_controls([replace(stepped, flight=flight)]) == ()


def test_derivatives_of_a_flight_behind_a_recorders_filter_are_unbiased_with_smooth_controls_alone() -> None:
    true = {(d.coefficient, d.term): float(d.value) for d in LIGHT.derivatives}
    distances: dict[bool, list[float]] = {False: [], True: []}
    for seed in (0, 10):
        linear = prepared(recorded(40, 2.0, seed))
        found = fitted(linear)
        smooth = with_smooth_controls([linear], found, bent_controls([linear]))
        assert smooth is not None
        assert smooth[0].smooth == ("delta_e",)
        for is_smooth, each in ((False, found), (True, fitted(smooth[0]))):
            errors = np.sqrt(np.diag(each.covariance))[: len(FREE)]
            off = [abs(each.model.value(entry) - true[entry]) for entry in FREE]
            distances[is_smooth].append(max(o / e for o, e in zip(off, errors, strict=True)))
    assert max(distances[True]) < 4.0
    assert min(distances[False]) > 8.0


def test_controls_that_are_linear_between_samples_remain_so() -> None:
    linear = prepared(Problem(elevator="3211", duration=20.0, interval=0.04).fly(seed=3))
    assert with_smooth_controls([linear], fitted(linear), ("delta_e",)) is None
    assert with_smooth_controls([linear], fitted(linear), ()) is None


def test_a_smooth_control_is_late_as_it_is_between_samples() -> None:
    """Against a sine that is delayed, and one that lags, exactly."""
    time, turn, late = np.arange(0.0, 20.0, 0.1), np.pi, 0.05
    read, delayed = np.sin(turn * time), np.sin(turn * (time - late))
    lagging = np.sin(turn * time - np.arctan(turn * late)) / np.hypot(1.0, turn * late)
    for effect, wanted, bound in ((control_delay, delayed, 6e-4), (control_lag, lagging, 1e-3)):
        smooth, linear = (
            effect("delta_e", is_smooth=is_smooth).transform(time, read, (late,)) for is_smooth in (True, False)
        )
        off, off_linear = (np.abs(found - wanted)[20:-2].max() for found in (smooth, linear))
        assert off < bound
        assert off_linear > 8.0 * off
        assert_allclose(effect("delta_e", is_smooth=True).transform(time, read, (0.0,)), read, atol=1e-12)


def test_declared_effects_are_late_as_smooth_ones_too() -> None:
    time = np.arange(0.0, 20.0, 0.1)
    read = np.sin(np.pi * time)
    late = frozen(ActiveEffect(control_lag("delta_e"), (0.08,)))
    (found,) = smoothly_late([late], ("delta_e",))
    assert isinstance(found.effect, InputEffect)
    wanted = control_lag("delta_e", is_smooth=True).transform(time, read, (0.08,))
    assert found.held == (0.08,)
    assert_allclose(found.effect.transform(time, read, ()), wanted)
    assert smoothly_late([late], ("delta_a",)) == (late,)


@pytest.mark.parametrize(("lag", "bandwidth"), [(0.05, 4.0), pytest.param(0.08, 3.0, marks=pytest.mark.slow)])
def test_a_lag_behind_a_recorders_filter_is_no_shorter_one_with_a_delay(lag: float, bandwidth: float) -> None:
    """With controls linear between samples .05 s was told as a lag of .022 s with a delay of .023 s."""
    logs = [replace(recorded(20, bandwidth, seed, lag=lag), name=f"flight {seed}") for seed in (20, 21)]
    result = close_loop(logs[:1], LIGHT, logs[1:], QUICK)
    (effect,) = result.effects
    assert (effect.kind, effect.where) == ("control_lag", "delta_e")
    assert effect.value == pytest.approx(lag, abs=0.002)
    assert any("smooth between samples" in note for note in result.notes)
