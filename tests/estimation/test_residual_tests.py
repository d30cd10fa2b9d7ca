"""Channels with a model error are those whose output errors exceed the noise, by independent whitening."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from problems import BOTH_SQUARES, NOISE, Problem, entry, with_channels
from scipy.signal import butter, filtfilt, lfilter

from aerosid.estimation import residual_tests
from aerosid.estimation.fit_settings import RESIDUAL_TESTS, TRIAL
from aerosid.estimation.maximum_likelihood import refine, whiten
from aerosid.estimation.open_loop import respond
from aerosid.estimation.residual_tests import coloured_noise, unexplained_channels


@pytest.mark.parametrize("complete", [False, True])
def test_channels_with_residuals_above_noise_are_those_of_a_simulation(complete: bool) -> None:
    problem = Problem(undeclared=BOTH_SQUARES)
    model, manoeuvre = problem.prepared(problem.fly())
    squares = tuple(entry(*key) for key in BOTH_SQUARES) if complete else ()
    found = refine(model.extended(squares), [manoeuvre], (*model.entries, *squares), settings=TRIAL)
    errors = respond(found.model, manoeuvre, found.variance).rms
    gross = {name for name, error in errors.items() if error > 2.0 * manoeuvre.noise[manoeuvre.row(name)]}
    told = set(unexplained_channels(found, [manoeuvre]))
    assert gross <= told
    assert bool(told) is not complete
    assert coloured_noise(found, [manoeuvre]) == ()
    assert np.isfinite(list(errors.values())).all()


def test_the_residuals_of_an_estimate_are_simulated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """However they are tested; those of other flights, or of a part of one, are others."""
    problem = Problem(undeclared=BOTH_SQUARES)
    model, manoeuvre = problem.prepared(problem.fly())
    found = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    asked: list[int] = []

    def counted(*arguments: Any, **named: Any) -> Any:
        asked.append(1)
        return whiten(*arguments, **named)

    monkeypatch.setattr(residual_tests, "whiten", counted)
    told = unexplained_channels(found, [manoeuvre])
    assert told == unexplained_channels(found, [manoeuvre]) == unexplained_channels(replace(found), [manoeuvre])
    unexplained_channels(found, [manoeuvre], least_share=0.5)
    coloured_noise(found, [manoeuvre])
    assert len(asked) == 2  # the copy's own
    half = manoeuvre.flight._replace(
        time=manoeuvre.flight.time[:100], inputs=manoeuvre.flight.inputs[:100], measured=manoeuvre.flight.measured[:100]
    )
    unexplained_channels(found, [replace(manoeuvre, flight=half)])
    assert len(asked) == 3


@pytest.mark.parametrize("value", [-1.2, -0.03], ids=["much", "little"])
def test_behind_a_recorder_a_residual_has_to_leave_a_share_of_the_motion(value: float) -> None:
    """Beyond twice the white noise, and 0.3 % of the variance: both recomputed by a simulation."""
    noise = {name: 0.2 * level for name, level in NOISE.items()}
    problem = Problem(undeclared={("C_m", "alpha^2"): value}, noise=noise)
    model, manoeuvre = problem.prepared(problem.fly())
    found = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    errors = respond(found.model, manoeuvre, found.variance).rms
    told = set(unexplained_channels(found, [manoeuvre], noise_hidden=True))
    assert told <= set(unexplained_channels(found, [manoeuvre]))
    for name, error in errors.items():
        place = manoeuvre.row(name)
        share = (error / float(np.nanstd(manoeuvre.flight.measured[:, place]))) ** 2
        if error > 2.4 * manoeuvre.noise[place] and share > 0.0036:
            assert name in told
        if error < 1.6 * manoeuvre.noise[place] or share < 0.0024:
            assert name not in told
    assert bool(told) == (value == -1.2)


@pytest.mark.parametrize("value", [0.0, -1.2], ids=["complete", "lacking"])
def test_noise_behind_a_recorder_is_not_told_from_a_model_error_by_its_size(value: float) -> None:
    """A filter leaves noise that is many times what the samples show, and as much as the motion of a quiet channel."""
    problem = Problem(undeclared={("C_m", "alpha^2"): value}, elevator="3211", duration=20.0)
    log = problem.fly(7)
    coefficients = butter(2, 4.0, fs=1.0 / problem.interval)
    filtered = {name: filtfilt(*coefficients, values) for name, values in log.channels.items()}
    model, manoeuvre = problem.prepared(replace(log, channels=filtered))
    found = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    assert unexplained_channels(found, [manoeuvre])
    assert bool(unexplained_channels(found, [manoeuvre], noise_hidden=True)) == (value != 0.0)


@pytest.mark.parametrize("memory", [0.3, 3.0], ids=["coloured noise", "drift"])
def test_noise_that_remembers_less_than_the_means_are_long_is_no_model_error(memory: float) -> None:
    """Noise with a memory of 0.3 s, filtered, repeats itself over 0.2 s, and hardly over 1 s; a drift does."""
    problem = Problem(elevator="3211", duration=60.0, noise={name: 0.1 * level for name, level in NOISE.items()})
    log, decay = problem.fly(3), float(np.exp(-problem.interval / memory))
    white = np.random.default_rng(4).standard_normal(log.time.size)
    noise = lfilter([np.sqrt(1.0 - decay**2)], [1.0, -decay], white)
    noise = lfilter(*butter(2, 5.0, fs=1.0 / problem.interval), noise)
    model, manoeuvre = problem.prepared(with_channels(log, a_z=log["a_z"] + 0.5 * noise))
    found = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    hidden = {"noise_hidden": True}
    assert "a_z" in unexplained_channels(found, [manoeuvre], **hidden)
    slow = unexplained_channels(found, [manoeuvre], memory=RESIDUAL_TESTS.sensor_memory, **hidden)
    assert ("a_z" in slow) is (memory > 1.0)


@pytest.mark.parametrize("share", [0.0033, 0.012])
def test_the_share_of_the_motion_is_that_of_the_slow_part(share: float) -> None:
    """Of noise with a memory of 1.5 s the means over 1 s have eight tenths of the power, and are coloured."""
    problem = Problem(elevator="3211", duration=120.0, noise={name: 0.1 * level for name, level in NOISE.items()})
    log, decay = problem.fly(3), float(np.exp(-problem.interval / 1.5))
    white = np.random.default_rng(5).standard_normal(log.time.size)
    noise = lfilter([np.sqrt(1.0 - decay**2)], [1.0, -decay], white)
    noise = lfilter(*butter(2, 5.0, fs=1.0 / problem.interval), noise)
    size = np.sqrt(share) * float(np.std(log["a_z"])) / float(np.std(noise))
    model, manoeuvre = problem.prepared(with_channels(log, a_z=log["a_z"] + size * noise))
    found = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    slow = unexplained_channels(found, [manoeuvre], noise_hidden=True, memory=RESIDUAL_TESTS.sensor_memory)
    assert ("a_z" in slow) is (share > 0.006)


def test_a_residual_counts_only_with_the_least_share_of_the_motion() -> None:
    problem = Problem(undeclared=BOTH_SQUARES)
    model, manoeuvre = problem.prepared(problem.fly())
    found = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    errors = respond(found.model, manoeuvre, found.variance).rms
    shares = {name: (errors[name] / float(manoeuvre.spread[manoeuvre.row(name)])) ** 2 for name in errors}
    told = unexplained_channels(found, [manoeuvre])
    least = float(np.median([shares[name] for name in told]))
    fewer = set(unexplained_channels(found, [manoeuvre], least_share=least))
    assert fewer <= {name for name in told if shares[name] > 0.8 * least}
    assert fewer >= {name for name in told if shares[name] > 1.2 * least}
    assert set(told) - fewer


def test_behind_a_recorder_a_small_residual_does_not_count_however_quiet_the_log_is() -> None:
    """Several times the white noise, and a thousandth of the variance."""
    noise = {name: 0.02 * level for name, level in NOISE.items()}
    problem = Problem(undeclared={("C_m", "alpha^2"): -0.05}, noise=noise)
    model, manoeuvre = problem.prepared(problem.fly())
    found = refine(model, [manoeuvre], model.entries, settings=TRIAL)
    errors = respond(found.model, manoeuvre, found.variance).rms
    loud = {name for name, error in errors.items() if error > 2.4 * manoeuvre.noise[manoeuvre.row(name)]}
    assert loud
    assert loud <= set(unexplained_channels(found, [manoeuvre]))
    assert unexplained_channels(found, [manoeuvre], noise_hidden=True) == ()
