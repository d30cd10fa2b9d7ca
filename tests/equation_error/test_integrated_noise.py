"""Random walk of an integrated path against its Monte Carlo."""

from dataclasses import replace

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import questioned

from aerosid.equation_error.equations.integrated_noise import integral_modes
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.selection.cross_validation import without_random_walk
from aerosid.equation_error.settings import EquationErrorSettings

SETTINGS = EquationErrorSettings()


def test_modes_have_the_covariance_of_integrated_white_noise() -> None:
    log = commuter.Lateral(seed=9401, duration=20.0).log()
    (recording,) = read_recordings([questioned(commuter.aircraft(commuter.SIDE), log)[1]], [], SETTINGS)
    gains = {"a_y": 1.0 / commuter.SPEED, "r": 1.0}
    time, step = recording.time, recording.interval
    modes = integral_modes(recording, time, gains, SETTINGS)
    noise = dict(zip(recording.manoeuvre.axes.outputs, recording.manoeuvre.noise, strict=True))
    size = np.sqrt(sum((share * noise[name]) ** 2 for name, share in gains.items()))
    generator = np.random.default_rng(2)
    walks = np.cumsum(size * generator.standard_normal((4000, time.size)), axis=1) * step
    phase = np.pi * (time - time[0]) / np.ptp(time)
    for order in range(1, SETTINGS.wander_modes + 1):
        parts = 2.0 * np.trapezoid(walks * np.cos(order * phase), time, axis=1) / np.ptp(time)
        # Four thousand trials determine a standard deviation to one part in ninety.
        assert np.max(np.abs(modes[:, order - 1])) == pytest.approx(float(np.std(parts)), rel=0.05)


def test_the_noise_of_a_coarse_record_is_that_of_its_own_samples() -> None:
    """Three interpolated samples in place of one have its noise, and not three independent ones."""
    log = commuter.Lateral(seed=9402, duration=24.0).log()
    every = max(1, round(0.12 / float(np.median(np.diff(log.time)))))
    coarse = replace(log, time=log.time[::every], channels={n: v[::every] for n, v in log.channels.items()})
    (recording,) = read_recordings([questioned(commuter.aircraft(commuter.SIDE), coarse)[1]], [], SETTINGS)
    assert recording.refinement == 3
    manoeuvre = recording.manoeuvre
    whole = float(manoeuvre.noise[manoeuvre.axes.outputs.index("r")]) * np.sqrt(0.12 / np.ptp(recording.time)) * 2**0.5
    modes = integral_modes(recording, recording.time, {"r": 1.0}, SETTINGS)
    assert np.max(np.abs(modes[:, 0])) == pytest.approx(whole * np.ptp(recording.time) / np.pi)


def test_modes_remove_no_more_than_their_prior_allows() -> None:
    """Of a residual that is a mode: all of it where the prior is large compared with it, nothing where it is small."""
    mode = np.cos(np.linspace(0.0, np.pi, 200))[:, None]
    left, slopes = 0.01 * mode[:, 0], np.ones((200, 1))
    for size, most, least in ((1.0, 1e-3, 0.0), (1e-6, 1.0, 1.0 - 1e-3)):
        rest, remaining = without_random_walk(left, slopes, size * mode)
        assert least <= float(rest @ rest) / float(left @ left) <= most
        assert remaining.shape == slopes.shape
    same, _ = without_random_walk(left, slopes, np.zeros((200, 3)))
    assert np.array_equal(same, left)
