"""A completed aircraft file as the declared one: nothing is missing any more, of what it declares nothing is found."""

from __future__ import annotations

import numpy as np
import pytest
from problems import with_channels

from aerosid.aircraft.reading import aircraft_from_text
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SEED = 9_810
"""Of these tests; published tables and trials begin elsewhere."""

SETTINGS = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)
MOMENT, RISE, STEP = 11.0, 3.0, 0.4
"""s, s, m/s^2."""


def with_slow_step(log: FlightLog) -> FlightLog:
    """The log with an axial force that changes over some seconds, as a speed brake's."""
    return with_channels(log, a_x=log["a_x"] + STEP * np.clip((log.time - MOMENT) / RISE + 0.5, 0.0, 1.0))


@pytest.mark.slow
def test_a_slow_step_change_and_gusts_are_declared_as_they_were_found() -> None:
    """The step lost its three seconds, and another one cancelled it; the gusts were reported as missing again."""
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEED))
    log, unseen = (flown(name, body, SEED + n, air=0.3, seconds=24.0) for n, name in enumerate(("one", "two")))
    first = close_loop([with_slow_step(log)], aircraft, [unseen], SETTINGS)
    (step,) = (effect for effect in first.effects if effect.kind != "gust")
    assert len(first.effects) == 2
    assert step.kind in ("step_change", "thrust_change")  # indistinguishable at a constant dynamic pressure
    assert step.parameters["rise"].value == RISE
    assert f"at {step.time:.2f} s over 3 s" in first.summary

    completed = aircraft_from_text(first.completed_aircraft.text, "completed_aircraft.toml", "")
    again = close_loop([with_slow_step(log)], completed, [unseen], SETTINGS)
    assert again.effects == ()
    assert again.verdict is Verdict.NOTHING_MISSING
