"""Forces without accelerometers: the low-pass against scipy's, the forces against the accelerometers', the height."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import questioned
from numpy.typing import NDArray
from problems import NOISE, Problem, with_channels
from scipy.signal import lsim

from aerosid.equation_error.equations.channels import KINEMATIC, equations_of
from aerosid.equation_error.equations.derived_forces import is_derived, low_passed
from aerosid.equation_error.equations.height_random_walk import height_random_walk
from aerosid.equation_error.equations.kinematic import reconstruct
from aerosid.equation_error.equations.points import Equations, Point, Segment
from aerosid.equation_error.equations.recording import has_inertial_path
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, SIX
from aerosid.logs.flight_log import FlightLog

Array = NDArray[np.float64]

SETTINGS = EquationErrorSettings()

EXACT = dict.fromkeys(NOISE, 0.0)
"""Every channel recorded without noise."""


def without_accelerometers(log: FlightLog) -> FlightLog:
    return with_channels(log, a_x=None, a_z=None)


def test_the_low_pass_is_that_of_the_differential_equation() -> None:
    """T y' + y = x by scipy's exact response to an input linear between samples, and T F(s) x' = x - F(s) x."""
    interval, time_constant = 0.02, 3.0
    time = np.arange(1500) * interval
    wave = np.sin(1.7 * time) + 0.3 * np.cos(0.4 * time)
    (found,) = low_passed(wave[:, None], interval, time_constant).T
    _, expected, _ = lsim(([1.0], [time_constant, 1.0]), wave - wave.mean(), time)
    # The bilinear transform bends 1.7 rad/s by (w dt)^2/12, one in 10,000; a start at rest is the same for both.
    np.testing.assert_allclose(found - wave.mean(), expected, atol=2e-3 * np.ptp(wave))

    slope = 1.7 * np.cos(1.7 * time) - 0.12 * np.sin(0.4 * time)
    (of_slope,) = low_passed(slope[:, None], interval, time_constant).T
    settled = time > 8.0 * time_constant
    np.testing.assert_allclose(time_constant * of_slope[settled], (wave - found)[settled], atol=0.02 * np.ptp(wave))


def test_columns_pass_alike() -> None:
    columns = np.random.default_rng(1).normal(2.0, 1.0, (400, 3))
    weights = np.array([0.7, -2.0, 11.0])
    np.testing.assert_allclose(
        low_passed((columns @ weights)[:, None], 0.02, 3.0)[:, 0], low_passed(columns, 0.02, 3.0) @ weights, rtol=1e-10
    )


def test_which_records_form_the_equations() -> None:
    for axes, needed, accelerometers, instead in (
        (LONGITUDINAL, {"V", "alpha", "q"}, {"a_x", "a_z"}, {"theta"}),
        (LATERAL, {"p", "r", "phi"}, {"a_y"}, {"beta"}),
        (SIX, {"V", "alpha", "p", "q", "r", "phi", "theta"}, {"a_x", "a_y", "a_z"}, {"beta"}),
    ):
        equations = equations_of(axes)
        assert equations.can_be_formed(needed | accelerometers)
        assert equations.can_be_formed(needed | instead)
        assert not equations.can_be_formed(needed)
        for missing in needed:
            assert not equations.can_be_formed((needed | accelerometers | instead) - {missing})


def segments(log: FlightLog) -> dict[str, Segment]:
    model, manoeuvre = questioned(Problem().aircraft, log)
    recordings = read_recordings([manoeuvre], [], SETTINGS)
    equations = Equations(recordings, SETTINGS, (*KINEMATIC, "C_X", "C_Z", "C_m"))
    return {each.equation: each for each in equations.at(Point(model, (), ()))}


@pytest.mark.parametrize("interval", [0.04, 0.02])
def test_derived_forces_are_those_of_the_accelerometers(interval: float) -> None:
    """Without noise, and behind the same low-pass: the spline's derivative is right to fourth order in the interval."""
    log = Problem(noise=EXACT, interval=interval, elevator="3211", duration=20.0).fly()
    _, manoeuvre = questioned(Problem().aircraft, without_accelerometers(log))
    (recording,) = read_recordings([manoeuvre], [], SETTINGS)
    assert is_derived(recording, "C_X")
    assert is_derived(recording, "C_Z")
    assert not is_derived(recording, "C_m")
    motion = reconstruct(recording, (), recording.channels, SETTINGS)
    for channel in ("a_x", "a_z"):
        both = np.column_stack([motion.specific_force[channel], log[channel]])
        derived, measured = low_passed(both, interval, SETTINGS.derived_forces).T
        assert np.abs(derived - measured).max() < 2e-3 * np.ptp(measured), channel


def test_a_declared_model_leaves_nothing_of_its_own_flight() -> None:
    log = Problem(noise=EXACT, interval=0.02, elevator="3211", duration=20.0).fly()
    with_them, without = segments(log), segments(without_accelerometers(log))
    assert set(without) == set(with_them) - {"alpha", "V"}
    for name, size in (("C_X", 0.03), ("C_Z", 0.4)):
        assert np.abs(without[name].target).max() < 5e-3 * size, name


def test_the_height_from_air_data_contains_light_turbulence() -> None:
    """The random walk against a Monte Carlo of gusts of first order with the settings' size and scale."""
    log = without_accelerometers(Problem(noise={**EXACT, "h": 0.1}, interval=0.04, duration=40.0).fly())
    _, manoeuvre = questioned(Problem().aircraft, log)
    settings = replace(SETTINGS, wander_modes=40)
    (recording,) = read_recordings([manoeuvre], [], settings)
    assert not has_inertial_path(recording)
    step, speed = recording.interval, float(np.mean(recording.channels["V"]))
    kept = float(np.exp(-step * speed / settings.turbulence_scale * 2.0))
    generator, trials = np.random.default_rng(3), []
    basis = np.linalg.qr(np.vander(recording.time, 3))[0]
    for _ in range(200):
        gust = np.zeros(recording.time.size)
        white = generator.standard_normal(gust.size) * settings.light_turbulence * np.sqrt(1.0 - kept**2)
        gust[0] = settings.light_turbulence * generator.standard_normal()
        for n in range(1, gust.size):
            gust[n] = kept * gust[n - 1] + white[n]
        climb = np.cumsum(gust) * step
        trials.append(climb - basis @ (basis.T @ climb))
    modes = height_random_walk(recording, recording.time, settings)[:, :-1]
    modes = modes - basis @ (basis.T @ modes)
    predicted = float(np.sqrt(np.mean(np.sum(modes**2, axis=1))))
    # Twice the correlation time L/(2V) times sigma^2 is the density; slower gusts than the record reduce the integral.
    assert 0.8 < predicted / float(np.sqrt(np.mean(np.square(trials)))) < 2.0
