"""Open-loop errors: whose noise may be a unit of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from problems import BOTH_SQUARES, LIGHT, Problem

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.model_validation.open_loop_errors import noise_doubts

PLANTED = Problem(undeclared=BOTH_SQUARES)


def flight(log: FlightLog) -> Manoeuvre:
    return prepare(log, LIGHT, declared_model(LIGHT, 100.0).columns)


def smoothed(log: FlightLog) -> FlightLog:
    """The pitch rate without its noise, as a filter after the flight leaves it."""
    phase = np.linspace(0.0, 9.0, log.samples)
    return replace(log, channels={**log.channels, "q": 0.1 * np.sin(phase) * np.exp(-0.1 * phase)})


def test_what_was_filtered_on_one_flight_is_doubted_on_all() -> None:
    first, second = PLANTED.fly(51, "first"), PLANTED.fly(52, "second")
    assert noise_doubts([flight(first), flight(second)]) == {}
    doubts = noise_doubts([flight(smoothed(first)), flight(second)])
    assert set(doubts) == {"q"}
    assert "filtered" in doubts["q"]


def test_a_declared_noise_leaves_no_doubt() -> None:
    told = replace(smoothed(PLANTED.fly(51, "first")), noise={"q": 0.001})
    assert noise_doubts([flight(told)]) == {}
