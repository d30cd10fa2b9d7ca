"""Recordings that miss the declared motion between their samples, or end before it, and controls that jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import LIGHT, Problem

from aerosid.aircraft.declared_model import declared_model
from aerosid.errors import LogError
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.flying_qualities.carried_deviations import TermCovariance
from aerosid.loop.flying_qualities.linear_analysis import analyse, condition_of, requirement_for
from aerosid.loop.motion_sampling import fastest_oscillation, notes_on_sampling, require_sampled_motion
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict

MODEL = declared_model(LIGHT, 100.0)
FINE = Problem(elevator="3211", duration=9.0, interval=0.01).fly(3)


def every(log: FlightLog, count: int) -> FlightLog:
    return replace(
        log, time=log.time[::count], channels={name: values[::count] for name, values in log.channels.items()}
    )


def prepared(log: FlightLog) -> Manoeuvre:
    return prepare(log, LIGHT, MODEL.columns)


def notes(log: FlightLog, *, leaves: bool = False) -> tuple[str, ...]:
    manoeuvre = prepared(log)
    known = TermCovariance.independent([], [])
    row = analyse("declared", MODEL, condition_of(manoeuvre), known, requirement_for(LIGHT, None, None))
    return notes_on_sampling([row], [manoeuvre], (), leaves=leaves)


def test_the_fastest_oscillation_is_that_of_the_fastest_pair_of_roots() -> None:
    system = np.zeros((4, 4))
    system[:2, :2] = [[-1.0, 4.0], [-4.0, -1.0]]
    system[2:, 2:] = [[-0.01, 0.2], [-0.2, -0.01]]
    found = fastest_oscillation(system, ("u", "w", "q", "theta"))
    assert found is not None
    assert found.period == pytest.approx(2.0 * np.pi / 4.0)
    assert fastest_oscillation(-np.diag([1.0, 2.0, 3.0, 4.0]), ("u", "w", "q", "theta")) is None


def test_a_recording_with_too_few_samples_a_period_is_refused_with_its_interval_and_the_period() -> None:
    # The declared short period lasts 1.50 s here: 3.8 samples at 0.4 s, 5.0 at 0.3 s.
    with pytest.raises(
        LogError, match=r"sampled every 0\.400 s, but the declared short period has a period of 1\.50 s"
    ):
        require_sampled_motion(MODEL, [prepared(every(FINE, 40))])
    require_sampled_motion(MODEL, [prepared(every(FINE, 30))])


def test_a_slow_recording_is_remarked_on_and_a_fast_one_is_not() -> None:
    (note,) = notes(every(FINE, 20))
    assert "sampled every 0.200 s, 7.5 times in the declared short period" in note
    assert notes(every(FINE, 10)) == ()


def test_a_recording_shorter_than_a_period_is_not_excited() -> None:
    log = FINE.between(1.0, 1.4)
    (note,) = notes(log)
    assert "is 0.400 s long, shorter than the declared short period" in note
    found = close_loop([log], LIGHT, settings=LoopSettings(paper_chain=False, next_flight=False))
    assert found.verdict is Verdict.NOT_EXCITED
    assert note in found.notes


def test_a_jump_between_two_samples_is_told_where_a_residual_remains() -> None:
    slow = every(FINE, 3)
    assert notes(slow) == ()
    (note,) = notes(slow, leaves=True)
    assert "delta_e jumps by" in note
    # A pilot moves the stick in a quarter of a second.
    smooth = np.convolve(slow["delta_e"], np.full(9, 1.0 / 9.0), mode="same")
    assert notes(replace(slow, channels={**slow.channels, "delta_e": smooth}), leaves=True) == ()
