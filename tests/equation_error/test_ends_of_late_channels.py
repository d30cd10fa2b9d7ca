"""A late channel says nothing of a record's last moments, and begins with what was before it."""

from dataclasses import replace
from functools import cache

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import identified, questioned
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from aerosid.effects import ActiveEffect
from aerosid.effects.sensor import sensor_delay, sensor_scale
from aerosid.equation_error.equations.kinematic import predicted_records, reconstruct
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.equations.sensors import corrected
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.logs.flight_log import FlightLog
from benchmarks import six_axis_flights
from benchmarks.sideways_plants import SidePlant

Array = NDArray[np.float64]

SETTINGS = EquationErrorSettings()
SIX = commuter.aircraft({**commuter.PITCH, **commuter.SIDE})
LATE = 0.3
"""s."""

FIRST, LAST = 2.0, 14.2
"""Of the stretch that is recorded, s: the aircraft yaws at both ends."""


@cache
def whole() -> FlightLog:
    """The flight without noise or errors."""
    return commuter.Lateral(noise=0.0, interval=0.02).log()


def late(channel: str, delay: float, scale: float = 1.0) -> tuple[Recording, list[ActiveEffect], Array]:
    """A stretch in which a channel is late, its errors, and what is true of the channel, (N,)."""
    log = whole()
    shifted = CubicSpline(log.time, log[channel])(log.time - delay)
    recorded = replace(log, channels={**log.channels, channel: scale * shifted}).between(FIRST, LAST)
    (recording,) = read_recordings([questioned(SIX, recorded)[1]], [], SETTINGS)
    errors = [ActiveEffect(sensor_scale(channel), (scale,)), ActiveEffect(sensor_delay(channel), (delay,))]
    return recording, errors, np.interp(recording.time, log.time, log[channel])


def path_of(recording: Recording) -> dict[str, Array]:
    return dict(reconstruct(recording, (), recording.channels, SETTINGS).path)


@pytest.mark.parametrize("scale", [1.0, 1.2])
@pytest.mark.parametrize("delay", [LATE, -LATE, 0.111])
@pytest.mark.parametrize("channel", ["beta", "alpha", "phi"])
def test_a_late_channel_follows_the_path_where_it_says_nothing(channel: str, delay: float, scale: float) -> None:
    """Held there, it is off by what the aircraft moves within the delay."""
    recording, errors, true = late(channel, delay, scale)
    found = corrected(recording, errors, lambda: path_of(recording))[channel]
    held = corrected(recording, errors, dict)[channel]
    unsaid = (recording.time + delay > recording.time[-1]) | (recording.time + delay < recording.time[0])
    np.testing.assert_array_equal(found[~unsaid], held[~unsaid])
    off, moved = np.abs(found - true)[unsaid].max(), np.abs(held - true)[unsaid].max()
    assert off < max(0.25 * moved, 3e-4)


def test_a_channel_without_a_path_is_held() -> None:
    recording, errors, _ = late("q", LATE)
    found = corrected(recording, errors, lambda: path_of(recording))["q"]
    assert np.ptp(found[recording.time + LATE > recording.time[-1]]) == 0.0


def test_the_correction_varies_smoothly_with_the_delay() -> None:
    """A likelihood that jumps where the delay passes a sample stops a search there."""
    recording, errors, _ = late("beta", LATE)
    path = path_of(recording)

    def at(delay: float) -> Array:
        moved = [errors[0], replace(errors[1], values=(delay,))]
        return corrected(recording, moved, lambda: path)["beta"]

    step = 1e-5
    changes = [np.abs(at(LATE + n * step) - at(LATE + (n - 1) * step)).max() for n in range(-3, 4)]
    assert max(changes) < 2.0 * min(changes) + 1e-9


@pytest.mark.parametrize("delay", [LATE, -LATE])
def test_a_record_differs_from_its_prediction_no_more_where_it_shows_what_no_other_sensor_does(delay: float) -> None:
    recording, errors, _ = late("beta", delay)
    true = corrected(recording, errors, lambda: path_of(recording))
    motion = reconstruct(recording, errors, true, SETTINGS)
    left = recording.channels["beta"] - predicted_records(recording, errors, motion)["beta"]
    left = left - left.mean()
    assert np.abs(left).max() < 0.02 * np.ptp(recording.channels["beta"])


def test_a_vane_with_a_dead_time_has_no_lag_and_no_false_scale() -> None:
    """The jet still swings as the records end; the sideslip was named late by a lag of .31 s with a scale of 1.12."""
    body = next(each for each in six_axis_flights.BODIES if each.name == "regional jet")
    at = six_axis_flights.Circumstances(body, 0.04, 26.0, gust=0.003 * body.airspeed, memory=0.3, off=0.06)

    def shown(time: Array, beta: Array) -> Array:
        return np.asarray(CubicSpline(time, beta)(np.maximum(time - LATE, time[0])))

    plant = SidePlant("", sensors={"beta": shown})
    seed = 509018
    logs = [six_axis_flights.flown(f"flight {n}", at, plant, seed + n).between(None, 20.0) for n in range(2)]
    aircraft = six_axis_flights.aircraft_of(at, plant, "six", np.random.default_rng(seed))
    (error,) = identified(aircraft, logs[:1], logs[1:]).selected.chosen
    assert (error.hypothesis.kind, error.hypothesis.where) == ("sensor_delay", "beta")
