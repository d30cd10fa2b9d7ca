"""A hole in a measured channel that the equations bridge is told; a channel slower than the log has none."""

from __future__ import annotations

import numpy as np
from problems import LIGHT, Problem, with_channels

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.loop.equation_error_notes import notes_on_bridged_holes
from aerosid.loop.identification import identify
from aerosid.loop.settings import LoopSettings

PROBLEM = Problem(elevator="3211", duration=15.0)


def lacking(channel: str, missing: np.ndarray) -> Manoeuvre:
    log = PROBLEM.fly(5)
    log = with_channels(log, **{channel: np.where(missing, np.nan, log[channel])})
    return prepare(log, LIGHT, declared_model(LIGHT, 100.0).columns)


def test_a_hole_is_told_with_its_channel_and_instants() -> None:
    time = PROBLEM.time
    (note,) = notes_on_bridged_holes([lacking("q", (time > 3.0) & (time < 3.9))])
    assert note.startswith("flight: q has a hole from 3.00 to 3.90 s")


def test_a_hole_that_kinematics_bridge_is_told_without_a_warning() -> None:
    time = PROBLEM.time
    (note,) = notes_on_bridged_holes([lacking("alpha", (time > 3.0) & (time < 3.9))])
    assert note.startswith("flight: alpha has a hole from 3.00 to 3.90 s")
    assert note.endswith("by the motion that gyros and accelerometers measured meanwhile.")


def test_single_missing_samples_and_channels_slower_than_the_log_are_no_holes() -> None:
    count = PROBLEM.time.size
    assert notes_on_bridged_holes([lacking("q", np.arange(count) % 50 == 7)]) == ()
    assert notes_on_bridged_holes([lacking("h", np.arange(count) % 10 != 0)]) == ()


def test_the_equations_tell_of_the_hole_of_the_flight_that_they_fit() -> None:
    log, time = PROBLEM.fly(5), PROBLEM.time
    holed = with_channels(log, q=np.where((time > 3.0) & (time < 3.9), np.nan, log["q"]))
    found = identify([holed], LIGHT, [], LoopSettings(method="equations"))
    assert [note for note in found.notes if "q has a hole" in note]
