"""A channel of one value is named; where it is needed and others show that its quantity moved, it is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import aerosid
from aerosid.aircraft.bundled import bundled_folder
from aerosid.compatibility import check_kinematics
from aerosid.errors import LogError
from aerosid.logs.constant_channels import dead_channel
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.physical_values import require_possible_values
from aerosid.logs.quality import Problem, check_log

REQUIRED = ("V", "alpha", "q")


@pytest.fixture(scope="module")
def doublet() -> FlightLog:
    return aerosid.read_log(bundled_folder("flight_data") / "light_transport_doublet.csv")


@pytest.fixture(scope="module")
def navion() -> FlightLog:
    return aerosid.read_log(bundled_folder("flight_data") / "navion_identify.csv")


def frozen(log: FlightLog, name: str) -> FlightLog:
    return replace(log, channels={**log.channels, name: np.full(log.samples, log[name][0])})


@pytest.mark.parametrize("name", REQUIRED)
def test_a_needed_channel_that_others_contradict_is_refused(doublet: FlightLog, name: str) -> None:
    log = frozen(doublet, name)
    (finding,) = (each for each in check_log(log).findings if each.subject == name)
    assert finding.problem is Problem.DEAD
    assert finding.blocking
    with pytest.raises(LogError, match=rf"channel {name} is dead \(.* throughout, while .* a change of .*\); correct"):
        require_possible_values(log, REQUIRED)


@pytest.mark.parametrize("name", ["p", "r"])
def test_a_rate_is_refused_where_the_axes_need_it(navion: FlightLog, name: str) -> None:
    log = frozen(navion, name)
    require_possible_values(log, REQUIRED)
    with pytest.raises(LogError, match=f"channel {name} is dead"):
        require_possible_values(log, (*REQUIRED, "p", "r"))


@pytest.mark.parametrize("name", ["beta", "p", "r", "phi", "theta", "psi", "a_x", "a_y", "a_z", "h"])
def test_every_other_constant_channel_of_motion_is_noted(navion: FlightLog, name: str) -> None:
    (finding,) = (each for each in check_log(frozen(navion, name)).findings if each.subject == name)
    assert finding.problem is Problem.CONSTANT
    assert not finding.blocking


def test_an_airspeed_that_need_not_change_is_noted_and_used(navion: FlightLog) -> None:
    """The sample flight's airspeed moves by a knot, less than coarse instruments resolve."""
    log = frozen(navion, "V")
    assert [f.problem for f in check_log(log).findings if f.subject == "V"] == [Problem.CONSTANT]
    require_possible_values(log, REQUIRED)


def test_a_declared_resolution_allows_for_a_larger_change(doublet: FlightLog) -> None:
    log = frozen(doublet, "V")
    found = dead_channel(log, "V")
    assert found is not None
    assert 2.0 < found.change < float(np.ptp(doublet["V"])) + 0.5
    assert dead_channel(replace(log, resolution={"V": 2.0}), "V") is None


@pytest.mark.parametrize("name", REQUIRED)
def test_a_bias_of_the_others_is_no_motion(name: str) -> None:
    """An undisturbed flight whose accelerometers, gyro and attitude are off."""
    time = 0.02 * np.arange(1000)
    random = np.random.default_rng(2)
    truth = {"V": 60.0, "alpha": 0.05, "q": 0.01, "theta": 0.06, "a_x": 0.55, "a_z": -9.6, "delta_e": 0.0}
    noise = {"V": 0.1, "alpha": 0.001, "q": 0.002, "theta": 0.001, "a_x": 0.02, "a_z": 0.05, "delta_e": 0.001}
    channels = {key: value + noise[key] * random.standard_normal(time.size) for key, value in truth.items()}
    assert dead_channel(frozen(FlightLog("flight", time, channels), name), name) is None


@pytest.mark.parametrize("name", ["a_x", "a_z"])
def test_a_constant_accelerometer_is_compared_with_nothing(doublet: FlightLog, name: str) -> None:
    assert check_kinematics([frozen(doublet, name)]) is None
