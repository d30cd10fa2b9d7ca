"""Tolerances of 14 CFR Part 60: the flights to which they apply, and the quantities compared with them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from problems_report import closed_loop, simulated

from aerosid.aircraft.bundled import bundled_folder
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.model_validation.open_loop_errors import Simulated
from aerosid.reporting.figures.chart import Corridor
from aerosid.reporting.figures.strip_charts import strip_chart
from aerosid.reporting.simulator_tolerances import (
    BRIEF_RESPONSES,
    PHUGOID,
    SHORT_PERIOD,
    brief_responses,
    comparisons,
    free_phugoid,
    oscillation,
    within,
)

SPEED, PERIOD, DAMPING = 90.0, 40.0, 0.06


def damped(time: np.ndarray, period: float, damping: float) -> np.ndarray:
    """exp(-zeta w0 t) cos(w t) with w the damped frequency of the period."""
    rate = 2.0 * math.pi / period
    natural = rate / math.sqrt(1.0 - damping**2)
    return np.exp(-damping * natural * time) * np.cos(rate * time)


def phugoid_flight(period: float = PERIOD, damping: float = DAMPING, model_period: float = PERIOD) -> Simulated:
    """200 s after a pulse of the elevator, the airspeed oscillating; the completed model with a period of its own."""
    time = np.arange(0.0, 200.0, 0.1)
    elevator = np.where((time > 2.0) & (time < 4.0), 0.05, 0.0)
    speed = SPEED + 6.0 * damped(time, period, damping)
    log = FlightLog("phugoid", time, {"V": speed, "delta_e": elevator}, {}, {}, {}, (), "phugoid.csv", "")
    models = [{"V": SPEED + 6.0 * damped(time, p, damping)} for p in (1.3 * period, 1.3 * period, model_period)]
    declared, before, after = models
    return Simulated(log, "validation", {"V": speed}, declared, before, after, after)


@pytest.mark.parametrize("name", ["light_transport_doublet", "light_transport_3211"])
def test_the_sample_flights_are_short_period_manoeuvres(name: str) -> None:
    log = read_log(bundled_folder("flight_data") / f"{name}.csv")
    (stretch,) = brief_responses(log)
    moving = log.time[1:][np.abs(np.diff(log["delta_e"])) > 0.01]
    assert stretch.start == pytest.approx(max(moving[0] - 1.0, log.time[0]), abs=0.3)
    assert stretch.stop == pytest.approx(min(moving[-1] + 5.0, log.time[-1]), abs=0.3)
    assert free_phugoid(log) is None  # at 100 m/s, 14 s are too short for a phugoid


def test_a_long_sweep_a_change_of_speed_and_a_resting_elevator_are_no_short_period() -> None:
    flight = simulated("f", "validation", (1, 1))
    time = flight.log.time

    def changed(**channels: np.ndarray) -> FlightLog:
        return dataclasses.replace(flight.log, channels={**flight.log.channels, **channels})

    assert len(brief_responses(flight.log)) == 1
    assert brief_responses(changed(delta_e=np.where(time > 1.0, 0.02 * np.sin(3.0 * time), 0.0))) != ()  # 13 s of it
    longer = dataclasses.replace(flight.log, time=2.0 * time)
    assert brief_responses(dataclasses.replace(longer, channels=changed(delta_e=np.sin(3.0 * time)).channels)) == ()
    assert brief_responses(changed(delta_e=np.zeros(time.size))) == ()
    assert brief_responses(changed(V=100.0 + 3.0 * time)) == ()
    still = {"theta": np.zeros(time.size), "q": np.full(time.size, 0.01)}
    assert brief_responses(changed(**still)) == ()  # a response below the tolerance proves nothing


def test_two_manoeuvres_on_one_log_and_a_phugoid_between_them_are_found() -> None:
    flight = phugoid_flight()
    time = flight.log.time
    elevator = flight.log["delta_e"] + np.where((time > 180.0) & (time < 181.0), 0.05, 0.0)
    q = 0.1 * np.sin(time) * ((time < 8.0) | (time > 180.0))
    log = dataclasses.replace(flight.log, channels={**flight.log.channels, "delta_e": elevator, "q": q})
    assert [(round(each.start), round(each.stop)) for each in brief_responses(log)] == [(1, 9), (179, 186)]
    assert free_phugoid(log) == pytest.approx((9.2, 180.0), abs=0.3)
    twice = dataclasses.replace(
        flight, log=log, measured={"q": q}, declared={}, before={}, after={"q": q + 0.01}, trimmed={}
    )
    edges = within(twice, "q")
    assert edges is not None
    panel = strip_chart(twice, ["q"], [], {}, {"q": edges}).panels[0]
    drawn = [(float(mark.x[0]), float(mark.x[-1])) for mark in panel.marks if isinstance(mark, Corridor)]
    assert drawn == [pytest.approx((0.9, 9.1), abs=0.3), pytest.approx((179.0, 186.2), abs=0.4)]


@given(st.floats(20.0, 90.0), st.floats(-0.05, 0.25), st.floats(0.5, 2.0))
@example(20.0, -0.04, 0.5)
def test_an_oscillation_is_measured_whatever_the_first_guess(period: float, damping: float, guess: float) -> None:
    time = np.arange(0.0, 3.0 * period, 0.2)
    found = oscillation(time, 3.0 + damped(time, period, damping), guess * period)
    assert found is not None
    assert found.period == pytest.approx(period, rel=1e-4)
    assert found.damping_ratio == pytest.approx(damping, abs=1e-4)
    # 1/time: almost zero at a damping near zero.
    rate = 2.0 * math.pi / period * damping / math.sqrt(1.0 - damping**2)
    assert 1.0 / found.time_to_half == pytest.approx(rate / math.log(2.0), rel=1e-2, abs=1e-3 / period)


def test_noise_is_no_oscillation() -> None:
    time = np.arange(0.0, 120.0, 0.1)
    assert oscillation(time, np.random.default_rng(1).standard_normal(time.size), 40.0) is None


def test_the_phugoid_is_compared_by_period_time_to_half_and_damping() -> None:
    flight = phugoid_flight(model_period=0.95 * PERIOD)
    assert free_phugoid(flight.log) is not None
    result = dataclasses.replace(closed_loop(samples=60), simulated=(flight,))
    rows = {row.quantity.split(" ")[0]: row for row in comparisons(result) if row.source == PHUGOID}
    assert set(rows) == {"period", "time", "damping"}
    assert rows["period"].measured == pytest.approx(PERIOD, rel=1e-3)
    assert rows["period"].tolerance == pytest.approx(0.1 * PERIOD, rel=1e-3)
    assert rows["period"].after == pytest.approx(0.05 * PERIOD, rel=2e-2)
    assert rows["period"].before == pytest.approx(0.30 * PERIOD, rel=2e-2)
    assert rows["damping"].measured == pytest.approx(DAMPING, abs=1e-3)
    assert rows["damping"].tolerance == 0.02
    half = math.log(2.0) * PERIOD * math.sqrt(1.0 - DAMPING**2) / (2.0 * math.pi * DAMPING)
    assert rows["time"].measured == pytest.approx(half, rel=1e-2)


def test_the_short_period_is_compared_within_the_manoeuvre() -> None:
    result = closed_loop()
    rows = [row for row in comparisons(result) if row.source == SHORT_PERIOD]
    assert {(row.log, row.quantity) for row in rows} == {
        (flight.log.name, quantity)
        for flight in result.simulated
        for quantity in ("pitch angle", "pitch rate", "normal acceleration")
    }
    flight = result.simulated[0]
    row = next(row for row in rows if row.log == flight.log.name and row.quantity == "pitch rate")
    assert row.tolerance == pytest.approx(math.radians(2.0))
    inside = (flight.log.time >= 0.0) & (flight.log.time <= 8.0)  # pulses from 1 to 3 s, 5 s after
    assert row.after == np.max(np.abs(flight.measured["q"] - flight.after["q"])[inside])
    assert next(r.tolerance for r in rows if r.quantity == "normal acceleration") == pytest.approx(0.980665)
    (stretch,) = brief_responses(flight.log)
    edges = within(flight, "theta")
    assert edges is not None
    held = np.isfinite(edges[0])
    np.testing.assert_allclose((edges[1] - edges[0])[held], 2.0 * math.radians(1.5))
    assert not held[flight.log.time > stretch.stop].any()
    assert within(flight, "V") is None


def lateral_log(rudder_at: float) -> FlightLog:
    """Aileron doublet at 2 s, rudder doublet at `rudder_at`; a roll and a yaw response to each."""
    time = np.arange(0.0, 30.0, 0.05)

    def doublet(begin: float, size: float) -> np.ndarray:
        return size * (((time >= begin) & (time < begin + 1)) * 1.0 - ((time >= begin + 1) & (time < begin + 2)))

    channels = {
        "delta_a": doublet(2.0, 0.05),
        "delta_r": doublet(rudder_at, 0.05),
        "p": doublet(2.2, 0.2) + doublet(rudder_at + 0.2, 0.05),
        "r": doublet(rudder_at + 0.2, 0.1),
        "phi": 0.1 * np.sin(time),
        "V": np.full(time.size, 60.0),
    }
    return FlightLog("side", time, channels, {}, {}, {}, (), "side.csv", "")


def test_roll_and_rudder_responses_need_the_other_surface_at_rest() -> None:
    roll, rudder = BRIEF_RESPONSES[1:]
    apart = lateral_log(15.0)
    (stretch,) = brief_responses(apart, roll)
    assert (stretch.start, stretch.stop) == pytest.approx((1.0, 9.0), abs=0.3)
    (stretch,) = brief_responses(apart, rudder)
    assert (stretch.start, stretch.stop) == pytest.approx((14.0, 22.0), abs=0.3)
    soon = lateral_log(6.0)
    (stretch,) = brief_responses(soon, roll)
    assert stretch.stop == pytest.approx(6.0, abs=0.3)  # the rudder ends the test
    together = lateral_log(2.5)
    assert brief_responses(together, roll) == ()
    assert brief_responses(together, rudder) == ()


def test_lateral_tolerances_are_those_of_the_table_and_leave_the_short_period_alone() -> None:
    """2.d.2: roll rate 2 deg/s; 2.d.3: bank 2 deg; 2.d.6: yaw rate 2 deg/s."""
    log = lateral_log(15.0)
    measured = {name: log[name] for name in ("p", "r", "phi")}
    wrong = {**measured, "p": measured["p"] + math.radians(2.5), "phi": measured["phi"] + math.radians(1.5)}
    flight = Simulated(log, "validation", measured, wrong, wrong, measured, measured)
    result = dataclasses.replace(closed_loop(), simulated=(flight,))
    rows = {row.quantity: row for row in comparisons(result)}
    assert {name: math.degrees(row.tolerance) for name, row in rows.items()} == pytest.approx(
        {"roll rate": 2.0, "bank angle": 2.0, "yaw rate": 2.0}
    )
    assert rows["roll rate"].before == pytest.approx(math.radians(2.5))
    assert rows["roll rate"].after == 0.0
    assert "2.d.2 and 2.d.3" in rows["bank angle"].source
    assert "2.d.6" in rows["yaw rate"].source
    edges = within(flight, "r")
    assert edges is not None
    held = np.isfinite(edges[0])
    assert log.time[held][[0, -1]] == pytest.approx([14.0, 22.0], abs=0.3)
    assert within(flight, "theta") is None
