"""Verdicts in calm air behind a recorder that colours its channels: its noise is no model error, a fault is one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

JUDGED = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)
SEED = 89_000
"""Of these flights; the limits were chosen on others."""


def intact(log: FlightLog) -> FlightLog:
    return log


def saturated(log: FlightLog) -> FlightLog:
    """A rate gyro at its stop in the largest motions, which no effect of the catalogue describes."""
    largest = 1.5 * float(np.std(log["q"]))
    return replace(log, channels={**log.channels, "q": np.clip(log["q"], -largest, largest)})


@pytest.mark.parametrize(
    ("recorded", "verdicts"),
    [
        (intact, {Verdict.NOTHING_MISSING}),
        (saturated, {Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED, Verdict.INCONSISTENT_DATA}),
    ],
)
@pytest.mark.parametrize("body", [0, 3])
def test_noise_of_a_recorder_is_no_model_error(
    body: int, recorded: Callable[[FlightLog], FlightLog], verdicts: set[Verdict]
) -> None:
    logs = [recorded(flown(name, BODIES[body], SEED + 10 * body + n, air=0.0)) for n, name in enumerate(("a", "b"))]
    result = close_loop(logs[:1], aircraft_of(BODIES[body], 0.08, np.random.default_rng(body)), logs[1:], JUDGED)
    assert result.decided_by == "equations"
    assert result.verdict in verdicts
