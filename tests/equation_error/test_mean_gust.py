"""Airspeed path after a mean gust: the mode against a path integrated twice, and no bias of a vane in gusts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from equations_decided import identified, questioned

from aerosid.aircraft import load_aircraft
from aerosid.equation_error.equations.kinematic import reconstruct
from aerosid.equation_error.equations.mean_gust import airspeed_by_mean_gust
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST, written
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SEEDS = 8_400
"""Of tests; published tables and trials begin elsewhere."""

SETTINGS = EquationErrorSettings()


def recorded(air: float) -> Recording:
    log = flown("one", BODIES[1], SEEDS, air=air, seconds=36.0)
    _, manoeuvre = questioned(aircraft_of(BODIES[1], 0.0, np.random.default_rng(0)), log)
    (recording,) = read_recordings([manoeuvre], [], SETTINGS)
    return recording


@pytest.mark.parametrize("angle", [-0.01, 0.02])
def test_the_mode_is_the_change_of_the_path_with_the_mean_of_the_vane(angle: float) -> None:
    recording = recorded(0.8)
    moved = {**recording.channels, "alpha": recording.channels["alpha"] + angle}
    here, there = (reconstruct(recording, (), channels, SETTINGS) for channels in (recording.channels, moved))
    change = recording.band(there.path["V"] - here.path["V"])
    mode = airspeed_by_mean_gust(recording, SETTINGS)
    assert mode is not None
    vane = recording.channels["alpha"] - here.path["alpha"]
    size = min(float(vane.std()), SETTINGS.drifts["h"] / float(here.V.mean()))
    expected = angle / size * mode[:, 0]
    # To first order, about the mean; over ten seconds the path's velocities follow those measured.
    left = change - expected
    assert float((left - left.mean()).std()) < 0.2 * float(change.std())
    assert float(change.std()) > abs(angle)  # m/s and rad: the aircraft climbs and descends


def test_in_calm_air_the_mode_is_that_of_the_vane_and_its_noise() -> None:
    calm, gusty = (airspeed_by_mean_gust(recorded(air), SETTINGS) for air in (0.0, 0.8))
    assert calm is not None
    assert gusty is not None
    assert float(calm.std()) < 0.2 * float(gusty.std())


def test_without_a_vane_or_accelerometers_there_is_none() -> None:
    recording = recorded(0.3)
    for missing in ("alpha", "a_x"):
        channels = {name: values for name, values in recording.channels.items() if name != missing}
        assert airspeed_by_mean_gust(replace(recording, channels=channels), SETTINGS) is None


def test_a_mean_gust_is_no_bias_of_the_vane(tmp_path: Path) -> None:
    """A glider with nothing wrong, whose vane saw .02 rad more than its path: told as a bias of .021 +- .003 rad."""
    written(tmp_path, [FIRST, 168, 9], 9)
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    assert identified(load_aircraft(tmp_path / "aircraft.toml"), logs[:1], logs[1:]).selected.labels == ()
