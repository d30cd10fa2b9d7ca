"""The log is immutable, validates its data and can be cut."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from aerosid.errors import LogError
from aerosid.logs.flight_log import FlightLog


def a_log(samples: int = 20) -> FlightLog:
    time = 0.1 * np.arange(samples)
    return FlightLog("flight", time, {"q": time**2, "V": 100.0 + time}, {"q": "rad/s"}, path="flight.csv")


def test_nothing_in_a_log_can_be_changed() -> None:
    values = np.zeros(20)
    log = FlightLog("flight", np.arange(20.0), {"q": values})
    with pytest.raises(ValueError, match="read-only"):
        log["q"][0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        log.time[0] = 1.0
    with pytest.raises(TypeError):
        log.channels["q"] = values  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        log.name = "other"  # type: ignore[misc]
    values[0] = 5.0
    assert log["q"][0] == 0.0


def test_a_channel_that_is_not_there_is_named_with_those_that_are() -> None:
    log = a_log()
    assert "q" in log
    assert "theta" not in log
    with pytest.raises(LogError, match=r"flight\.csv: channel theta is not in the log \(it holds q, V\)"):
        log["theta"]


@given(st.integers(0, 19), st.integers(0, 19))
def test_a_cut_keeps_the_samples_that_are_named(first: int, last: int) -> None:
    log = a_log()
    start, stop = round(0.1 * first, 1), round(0.1 * last, 1)
    if last - first < 1:
        with pytest.raises(LogError, match=r"the log runs from 0 to 1\.9 s"):
            log.between(start, stop)
        return
    cut = log.between(start, stop)
    assert_array_equal(cut.time, log.time[first : last + 1])
    assert_array_equal(cut["q"], log["q"][first : last + 1])
    assert cut.samples == last - first + 1
    assert bool(cut.notes) == (cut.samples < log.samples)


def test_an_open_cut_is_the_log_itself() -> None:
    log = a_log()
    assert log.between(None, None) is log
    assert log.between(1.0, None).time[0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("time", "words"),
    [
        ([0.0, 1.0, 1.0, 2.0], "sample 3"),
        ([0.0, 2.0, 1.0, 3.0], "sample 3"),
        ([0.0, 1.0, np.nan, 3.0], "sample 3"),
        ([np.nan, 1.0, 2.0, 3.0], "strictly increase"),
        ([0.0, 1.0, 2.0, np.inf], "strictly increase"),
        ([0.0], "at least 2"),
    ],
)
def test_a_time_base_that_is_none_is_refused(time: list[float], words: str) -> None:
    with pytest.raises(LogError, match=words):
        FlightLog("flight", np.array(time), {})


def test_channels_of_another_length_are_refused() -> None:
    with pytest.raises(LogError, match="channel q has shape"):
        FlightLog("flight", np.arange(4.0), {"q": np.arange(5.0)})


def test_the_interval_is_the_median() -> None:
    log = FlightLog("flight", np.array([0.0, 0.1, 0.2, 0.3, 5.0]), {})
    assert log.interval == pytest.approx(0.1)
