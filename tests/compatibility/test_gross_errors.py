"""One gross recording error is named as the cause: a late channel, an acceleration in g, two channels exchanged."""

from __future__ import annotations

import numpy as np
import pytest
from contradicted_logs import judged, late
from problems import BOTH_SQUARES, Problem, with_channels

from aerosid.aircraft.bundled import bundled_folder
from aerosid.compatibility import Agreement, check_kinematics, contradicting
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks.sideways_plants import SidePlant
from benchmarks.six_axis_flights import drawn, flown
from benchmarks.turbulent_flights import BODIES
from benchmarks.turbulent_flights import flown as flown_in_turbulence

G = 9.80665

SIX_AXES = 9_101
"""Seed of a flight in all six axes; the limits were found on 9001 and 9002."""


def exchanged(log: FlightLog, one: str, other: str) -> FlightLog:
    return with_channels(log, **{one: log[other], other: log[one]})


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return read_log(bundled_folder("flight_data") / "light_transport_doublet.csv")


@pytest.fixture(scope="module")
def six_axes() -> FlightLog:
    return flown("six axes", drawn(0.0, np.random.default_rng(SIX_AXES)), SidePlant("nothing"), SIX_AXES)


@pytest.mark.parametrize(
    ("channel", "seconds"),
    [
        ("alpha", 1.0),
        pytest.param("a_z", -1.5, marks=pytest.mark.slow),
        pytest.param("alpha", -1.5, marks=pytest.mark.slow),
        pytest.param("theta", -1.5, marks=pytest.mark.slow),
        pytest.param("q", 1.0, marks=pytest.mark.slow),
        pytest.param("q", -1.5, marks=pytest.mark.slow),
        pytest.param("a_z", 2.6, marks=pytest.mark.slow),
    ],
)
def test_a_channel_about_a_second_off_is_named_with_its_time(log: FlightLog, channel: str, seconds: float) -> None:
    """Between whole seconds no remedy was tried, and a second late of alpha was told as turbulence of 7 m/s."""
    (found,) = judged(late(log, channel, seconds))
    assert found.channels == (channel,)
    way = "earlier" if seconds > 0.0 else "later"
    assert f"when moved about {abs(seconds):g} s {way}" in found.remedy


def test_an_acceleration_in_multiples_of_g_is_named(log: FlightLog) -> None:
    """Free scale factors and delays of airspeed bend as far as a_x in g asks."""
    (found,) = judged(with_channels(log, a_x=log["a_x"] / G))
    assert found.channels == ("a_x",)
    assert found.remedy == "if its values are multiples of g and not m/s^2"


@pytest.mark.parametrize("elevator", ["levels", pytest.param("doublet", marks=pytest.mark.slow)])
def test_an_acceleration_in_multiples_of_g_is_named_where_it_leaves_less_than_gusts_do(elevator: str) -> None:
    """A quarter of the variation of the airspeed, which no gust or instrument error leaves so."""
    log = Problem(undeclared=BOTH_SQUARES, elevator=elevator, duration=15.0, amplitude=0.06).fly(9_103)
    assert not judged(log)
    (found,) = judged(with_channels(log, a_x=log["a_x"] / G))
    assert found.channels == ("a_x",)
    assert found.remedy == "if its values are multiples of g and not m/s^2"


@pytest.mark.slow
def test_both_accelerations_in_multiples_of_g_are_named_together(log: FlightLog) -> None:
    (found,) = judged(with_channels(log, a_x=log["a_x"] / G, a_z=log["a_z"] / G))
    assert found.channels == ("a_x", "a_z")
    assert found.sentence.endswith("they agree if their values are multiples of g and not m/s^2.")


@pytest.mark.parametrize("pair", [("a_x", "a_z"), pytest.param(("alpha", "theta"), marks=pytest.mark.slow)])
def test_two_exchanged_channels_are_named_together(log: FlightLog, pair: tuple[str, str]) -> None:
    (found,) = judged(exchanged(log, *pair))
    assert set(found.channels) == set(pair)
    assert found.sentence.endswith("they agree when exchanged with each other.")


@pytest.mark.parametrize(
    "pair",
    [
        pytest.param(("theta", "phi"), marks=pytest.mark.slow),
        pytest.param(("p", "r"), marks=pytest.mark.slow),
        pytest.param(("a_y", "a_z"), marks=pytest.mark.slow),
        pytest.param(("alpha", "beta"), marks=pytest.mark.slow),
        pytest.param(("p", "q"), marks=pytest.mark.slow),
        pytest.param(("q", "r"), marks=pytest.mark.slow),
    ],
)
def test_channels_exchanged_with_lateral_ones_are_named(six_axes: FlightLog, pair: tuple[str, str]) -> None:
    assert not judged(six_axes)
    (found,) = judged(exchanged(six_axes, *pair))
    assert set(found.channels) == set(pair)
    assert found.remedy == "when exchanged with each other"


@pytest.mark.slow
def test_a_late_channel_in_turbulence_is_named() -> None:
    log = flown_in_turbulence("a", BODIES[1], 9_101, air=0.6, seconds=24.0)
    assert not judged(log)
    (found,) = judged(late(log, "q", 1.2))
    assert found.channels == ("q",)
    assert "s earlier" in found.remedy


@pytest.mark.parametrize(
    ("channel", "seconds"),
    [
        ("theta", 0.5),
        pytest.param("q", 0.5, marks=pytest.mark.slow),
        pytest.param("a_z", 0.5, marks=pytest.mark.slow),
    ],
)
def test_a_delay_that_the_equations_find_is_an_instrument_error(log: FlightLog, channel: str, seconds: float) -> None:
    """A loop corrects it and goes on, as it did."""
    delayed = late(log, channel, seconds)
    agreement = check_kinematics([delayed])
    assert agreement is not None
    assert agreement.verdict is Agreement.CORRECTED
    assert agreement.findings[0].value == pytest.approx(seconds, abs=0.02)
    assert contradicting([delayed]) is None


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "seconds"), [(79008, 0.37), (79006, 0.71)])
def test_an_attitude_and_a_flow_angle_that_are_late_together_are_instrument_errors(seed: int, seconds: float) -> None:
    """Told was a contradiction: the rate alone is early, by one clock, or the attitude is late."""
    body = BODIES[seed % len(BODIES)]
    log = late(late(flown_in_turbulence("a", body, 10 * seed, air=0.2), "theta", seconds), "alpha", seconds)
    (contradiction,) = judged(log)
    assert ("q", pytest.approx(-seconds, abs=0.1)) in contradiction.clocks
    assert contradicting([log]) is None
    agreement = check_kinematics([log])
    assert agreement is not None
    assert {(each.kind, each.where): each.value for each in agreement.findings} == {
        ("sensor_delay", channel): pytest.approx(seconds, abs=0.03) for channel in ("theta", "alpha")
    }


def test_a_delay_that_the_equations_do_not_find_ends_check_and_loop(log: FlightLog) -> None:
    delayed = late(log, "alpha", 0.9)
    for agreement in (check_kinematics([delayed]), contradicting([delayed])):
        assert agreement is not None
        assert agreement.verdict is Agreement.INCONSISTENT
        assert "alpha contradicts" in agreement.sentence
        assert "when moved about 0.9 s earlier" in agreement.sentence


@pytest.mark.parametrize("seconds", [0.4, pytest.param(0.7, marks=pytest.mark.slow)])
def test_a_vane_late_by_half_a_second_is_no_gross_error(log: FlightLog, seconds: float) -> None:
    """Told was a contradiction: from a lag, which is found first, no single step led to the delay."""
    found = check_kinematics([late(log, "alpha", seconds)])
    assert found is not None
    assert found.verdict is Agreement.CORRECTED
    (row,) = found.findings
    assert (row.kind, row.where) == ("sensor_delay", "alpha")
    assert row.value == pytest.approx(seconds, abs=0.002)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_ordinary_instrument_errors_are_no_gross_ones(seed: int) -> None:
    log = Problem(undeclared=BOTH_SQUARES, elevator="3211", duration=15.0, amplitude=0.06).fly(seed)
    for altered in (
        late(log, "alpha", 0.25),
        late(log, "q", -0.2),
        with_channels(log, theta=log["theta"] + 0.02, alpha=1.2 * log["alpha"]),
        with_channels(log, a_x=log["a_x"] + 0.5, a_z=1.1 * log["a_z"], V=1.05 * log["V"]),
    ):
        assert not judged(altered)
