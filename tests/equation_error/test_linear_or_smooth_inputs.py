"""Inputs linear or smooth between samples: as simulated, and behind a recorder's filter."""

from collections.abc import Callable

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import questioned
from scipy.signal import butter, lfilter

from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.linear_or_smooth_inputs import likelier_input_interpolation
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.logs.flight_log import FlightLog

INTERVAL = 0.04


def as_simulated() -> FlightLog:
    return commuter.Lateral(interval=INTERVAL, noise=0.1).log()


def as_recorded() -> FlightLog:
    """Flown in steps of 0.005 s and filtered at 6 Hz, all channels alike, before every eighth sample is kept."""
    fine = commuter.Lateral(interval=0.005, noise=0.0, duration=11.0).log()
    top, bottom = butter(2, 6.0, fs=200.0)
    generator = np.random.default_rng(2)
    channels = {}
    for name, values in fine.channels.items():
        seen = (values[0] + lfilter(top, bottom, values - values[0]))[::8]
        channels[name] = seen + 0.1 * commuter.NOISE[name] * generator.standard_normal(seen.size)
    return FlightLog(fine.name, fine.time[::8], channels, dict(fine.units))


def regressed(log: FlightLog) -> Estimate:
    """The declared structure with smooth inputs."""
    aircraft, settings = commuter.aircraft(commuter.SIDE), EquationErrorSettings()
    model, manoeuvre = questioned(aircraft, log)
    problem = RegressionProblem(read_recordings([manoeuvre], [], settings), COEFFICIENT, settings)
    return estimate(problem, Point(model, tuple((d.coefficient, d.term) for d in aircraft.derivatives), ()))


def furthest_roll_derivative(found: Estimate) -> float:
    """Largest error of a derivative of C_l, standard errors."""
    deviations = np.sqrt(np.diag(corrected_covariance(found.design, found.solution)))
    far = 0.0
    for unknown, value, deviation in zip(found.design.unknowns, found.solution.values, deviations, strict=True):
        if unknown[0] == "term" and unknown[1][0] == "C_l":  # type: ignore[index]
            truth = commuter.SIDE["C_l", str(unknown[1][1])]  # type: ignore[index]
            far = max(far, abs(value - truth) / deviation)
    return far


@pytest.mark.parametrize(
    ("flown", "straight"), [(as_simulated, True), pytest.param(as_recorded, False, marks=pytest.mark.slow)]
)
def test_the_likelier_interpolation_is_the_true_one(flown: Callable[[], FlightLog], straight: bool) -> None:
    smooth = regressed(flown())
    chosen = likelier_input_interpolation(smooth)
    assert [recording.linear_inputs for recording in chosen.problem.recordings] == [straight]
    assert furthest_roll_derivative(chosen) < 3.0


def test_the_wrong_interpolation_biases_roll_derivatives() -> None:
    smooth = regressed(as_simulated())
    pulled = furthest_roll_derivative(smooth)
    assert pulled > 3.0
    assert pulled > 3.0 * furthest_roll_derivative(likelier_input_interpolation(smooth))
