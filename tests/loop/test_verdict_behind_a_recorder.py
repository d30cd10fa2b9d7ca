"""Verdicts in calm air behind a recorder that colours its channels: its noise is no model error, a fault is one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from problems import LIGHT, NOISE, Problem, with_channels
from scipy.signal import lfilter

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


def coloured(log: FlightLog) -> FlightLog:
    """Every output with noise of its sensor that remembers 0.3 s beside the noise that it has."""
    generator = np.random.default_rng(log.time.size)
    decay = float(np.exp(-float(log.time[1] - log.time[0]) / 0.3))
    channels = dict(log.channels)
    for name in sorted(set(NOISE) - {"delta_e"}):
        white = np.sqrt(1.0 - decay**2) * generator.standard_normal(log.time.size)
        channels[name] = channels[name] + 1.5 * NOISE[name] * lfilter([1.0], [1.0, -decay], white)
    return replace(log, channels=channels)


FAULTY = {Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED, Verdict.INCONSISTENT_DATA}


@pytest.mark.parametrize(
    ("body", "recorded", "verdicts"),
    [
        (0, intact, {Verdict.NOTHING_MISSING}),
        pytest.param(3, intact, {Verdict.NOTHING_MISSING}, marks=pytest.mark.slow),
        (0, coloured, {Verdict.NOTHING_MISSING}),
        (0, saturated, FAULTY),
        pytest.param(0, lambda log: coloured(saturated(log)), FAULTY, marks=pytest.mark.slow),
    ],
    ids=["intact", "another aircraft", "coloured noise", "saturated gyro", "saturated gyro in coloured noise"],
)
def test_noise_of_a_recorder_is_no_model_error(
    body: int, recorded: Callable[[FlightLog], FlightLog], verdicts: set[Verdict]
) -> None:
    logs = [recorded(flown(name, BODIES[body], SEED + 10 * body + n, air=0.0)) for n, name in enumerate(("a", "b"))]
    result = close_loop(logs[:1], aircraft_of(BODIES[body], 0.08, np.random.default_rng(body)), logs[1:], JUDGED)
    assert result.decided_by == "equations"
    assert result.verdict in verdicts
    assert any("every channel" in note for note in result.notes)


def test_a_fault_in_white_noise_hides_no_noise() -> None:
    """A gyro with a dead band of 0.005 rad/s: kinematics are 12 times the noise, and V is not."""

    def dead(log: FlightLog) -> FlightLog:
        q = np.sign(log["q"]) * np.maximum(np.abs(log["q"]) - 0.005, 0.0)
        return with_channels(log, q=q)

    logs = [dead(Problem(elevator="3211", amplitude=a).fly(n, f"log {n}")) for n, a in ((1, 0.05), (2, -0.05))]
    result = close_loop(logs[:1], LIGHT, logs[1:], JUDGED)
    assert result.decided_by == "equations"
    assert result.verdict in (Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED)
    assert not any("every channel" in note for note in result.notes)


@pytest.mark.parametrize(("body", "lag"), [(0, 0.0), pytest.param(4, 0.0, marks=pytest.mark.slow), (0, 0.2)])
def test_in_moving_air_a_residual_counts_that_depends_on_the_controls(body: int, lag: float) -> None:
    """An autopilot's notch, of no kind in the catalogue, between the recorded elevator and the one that acts."""
    logs = [flown(name, BODIES[body], SEED + 50 + n, air=0.6) for n, name in enumerate(("a", "b"))]
    logs = [replace(log, channels={**log.channels, "delta_e": notched(log, lag)}) for log in logs]
    result = close_loop(logs[:1], aircraft_of(BODIES[body], 0.08, np.random.default_rng(0)), logs[1:], JUDGED)
    assert "gust" in {effect.kind for effect in result.effects}
    assert result.verdict is (Verdict.PARTLY_EXPLAINED if lag else Verdict.EXPLAINED)
    assert ("A significant residual remains" in result.summary) is bool(lag)
    (note,) = (note for note in result.notes if "every channel" in note)
    assert ("none does" in note) is not bool(lag)


def notched(log: FlightLog, lag: float) -> NDArray[np.float64]:
    """The recorded elevator less what it was `lag` s before, as if only its changes acted; as recorded without."""
    recorded, samples = log["delta_e"], round(lag / float(log.time[1] - log.time[0]))
    if samples == 0:
        return recorded
    before = np.concatenate([np.full(samples, recorded[0]), recorded[:-samples]])
    return np.asarray(recorded - 0.7 * (before - recorded[0]))
