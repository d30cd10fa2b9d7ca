"""Records on a regular grid are used as they are, whatever their rate; others are interpolated to one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import Problem

from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre

AS_SAMPLED = EquationErrorSettings(coarsest=1.0)


def stretched(rate: float, seconds: float) -> Manoeuvre:
    """A manoeuvre of a rate, Hz, and white noise of unit deviation in its pitch rate."""
    problem = Problem()
    _, manoeuvre = problem.prepared(problem.fly())
    time = np.arange(round(seconds * rate) + 1) / rate
    old = manoeuvre.flight
    measured = np.column_stack([np.interp(time, old.time, column) for column in old.measured.T])
    measured[:, manoeuvre.row("q")] = np.random.default_rng(int(rate)).standard_normal(time.size)
    inputs = np.column_stack([np.interp(time, old.time, column) for column in old.inputs.T])
    return replace(manoeuvre, flight=old._replace(time=time, inputs=inputs, measured=measured))


@pytest.mark.parametrize("rate", [18.75, 30.0, 60.0, 64.0, 120.0, 128.0])
def test_a_long_regular_record_is_not_interpolated_though_its_interval_is_rounded(rate: float) -> None:
    """The interval is known to a microsecond, which after a minute at 128 Hz amounts to half a sample."""
    manoeuvre = stretched(rate, 120.0)
    (recording,) = read_recordings([manoeuvre], [], AS_SAMPLED)
    np.testing.assert_array_equal(recording.channels["q"], manoeuvre.flight.measured[:, manoeuvre.row("q")])
    np.testing.assert_array_equal(recording.time, manoeuvre.flight.time)


def test_an_irregular_record_is_interpolated_to_a_regular_grid() -> None:
    manoeuvre = stretched(50.0, 20.0)
    time = manoeuvre.flight.time.copy()
    time[1:-1] += 0.004 * np.random.default_rng(0).uniform(-1.0, 1.0, time.size - 2)
    moved = replace(manoeuvre, flight=manoeuvre.flight._replace(time=time))
    (recording,) = read_recordings([moved], [], AS_SAMPLED)
    steps = np.diff(recording.time)
    assert np.ptp(steps) < 1e-9
    expected = np.interp(recording.time, time, moved.flight.measured[:, moved.row("q")])
    np.testing.assert_allclose(recording.channels["q"], expected)
