"""A hole of a channel that others predict is bridged by the motion: the same flight without noise is the oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import LIGHT, NOISE, Problem, with_channels

from aerosid.aircraft.declared_model import declared_model
from aerosid.equation_error.equations.bridged_holes import channel_holes
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre, prepare

PROBLEM = Problem(elevator="3211", duration=15.0)
LOG = PROBLEM.fly(5)
QUIET = replace(PROBLEM, noise={name: 1e-6 * size for name, size in NOISE.items()}).fly(5)
COLUMNS = declared_model(LIGHT, 100.0).columns


def lacking(name: str, start: float, stop: float, *others: str) -> Manoeuvre:
    missing = (PROBLEM.time > start) & (PROBLEM.time < stop)
    channels = {
        name: np.where(missing, np.nan, LOG[name]),
        **{other: np.full_like(LOG[name], np.nan) for other in others},
    }
    return prepare(with_channels(LOG, **channels), LIGHT, COLUMNS)


@pytest.mark.parametrize(("name", "start"), [("alpha", 2.0), ("alpha", 4.0), ("theta", 3.0), ("V", 2.5)])
def test_the_bridged_hole_is_near_to_the_flight_where_a_line_is_not(name: str, start: float) -> None:
    manoeuvre = lacking(name, start, start + 1.5)
    (recording,) = read_recordings([manoeuvre], [], EquationErrorSettings())
    time = recording.time
    known = np.isfinite(manoeuvre.measured(name))
    true = np.interp(time, PROBLEM.time, QUIET[name])
    line = np.interp(time, PROBLEM.time[known], LOG[name][known])
    inside = (time > start) & (time < start + 1.5)

    def error(values: np.ndarray) -> float:
        return float(np.sqrt(np.mean((values - true)[inside] ** 2)))

    noise = PROBLEM.noise[name]  # of the samples beside the hole
    assert error(line) > 2.5 * noise
    assert error(recording.channels[name]) < 0.1 * error(line) + noise
    np.testing.assert_array_equal(recording.channels[name][~inside], line[~inside])


def test_without_accelerometers_air_data_are_bridged_by_a_line() -> None:
    manoeuvre = lacking("alpha", 4.0, 5.5, "a_x", "a_z")
    (recording,) = read_recordings([manoeuvre], [], EquationErrorSettings())
    known = np.isfinite(manoeuvre.measured("alpha"))
    line = np.interp(recording.time, PROBLEM.time[known], LOG["alpha"][known])
    np.testing.assert_allclose(recording.channels["alpha"], line, atol=1e-12)


def test_a_hole_is_found_between_the_samples_beside_it() -> None:
    found = channel_holes(lacking("q", 4.0, 5.5))
    assert [*found] == ["q"]
    np.testing.assert_allclose(found["q"], [[4.0, 5.5]], atol=PROBLEM.interval)
