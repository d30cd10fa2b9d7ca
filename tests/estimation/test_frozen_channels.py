"""Channels of one value throughout, and single samples far off: what is not used, and what a note says of them."""

from __future__ import annotations

import numpy as np
import pytest
from problems import LIGHT, SILENT, Problem, with_channels

from aerosid.aircraft.declared_model import declared_model
from aerosid.compatibility import Agreement, check_kinematics
from aerosid.estimation.manoeuvre import prepare
from aerosid.logs.flight_log import FlightLog


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return Problem(elevator="3211", duration=15.0).fly(3)


@pytest.mark.parametrize("channel", ["h", "theta"])
def test_a_frozen_channel_is_not_used_and_a_note_says_so(log: FlightLog, channel: str) -> None:
    columns = declared_model(LIGHT, 100.0).columns
    whole = prepare(log, LIGHT, columns)
    frozen = prepare(with_channels(log, **{channel: np.full(log.time.size, log[channel][0])}), LIGHT, columns)
    assert frozen.outputs == tuple(name for name in whole.outputs if name != channel)
    assert [note for note in frozen.notes if note.startswith(f"{channel}: one value throughout")]
    assert not [note for note in whole.notes if "one value" in note]


def test_an_airspeed_of_one_value_is_used_with_a_note_and_frozen_channels_beside_it_are_not(log: FlightLog) -> None:
    still = {name: np.full(log.time.size, log[name][0]) for name in ("V", "h")}
    prepared = prepare(with_channels(log, **still), LIGHT, declared_model(LIGHT, 100.0).columns)
    assert "V" in prepared.outputs
    assert "h" not in prepared.outputs
    assert [note for note in prepared.notes if note.startswith("V: one value throughout; used")]


def test_in_undisturbed_flight_every_channel_may_hold_still() -> None:
    log = Problem(elevator="none", noise=SILENT).fly(0)
    prepared = prepare(log, LIGHT, declared_model(LIGHT, 100.0).columns)
    assert {"h", "theta"} <= set(prepared.outputs)


def test_a_frozen_altimeter_is_no_turbulence_and_contradicts_nothing(log: FlightLog) -> None:
    found = check_kinematics([with_channels(log, h=np.full(log.time.size, 1500.0))])
    assert found is not None
    assert found.verdict is Agreement.CONSISTENT
    assert "h" not in {row.channel for row in found.channels}


def test_spikes_are_noted_with_their_times(log: FlightLog) -> None:
    columns = declared_model(LIGHT, 100.0).columns
    rate = log["q"].copy()
    rate[[100, 200]] += 1.0
    notes = prepare(with_channels(log, q=rate), LIGHT, columns).notes
    assert [note for note in notes if note.startswith(f"q: spikes, 2 at {log.time[100]:g}, {log.time[200]:g} s")]
    assert not [note for note in prepare(log, LIGHT, columns).notes if "spikes" in note]
