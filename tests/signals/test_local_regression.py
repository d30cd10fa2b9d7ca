"""Local linear regression by Fourier transform: against a fit at each sample, what it keeps, and its ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aerosid.signals.gaussian_filter import REACH
from aerosid.signals.local_regression import locally_smoothed


@given(st.integers(2, 120), st.floats(0.5, 300.0), st.integers(0, 10))
def test_it_is_a_weighted_line_at_each_sample(count: int, samples: float, seed: int) -> None:
    values = np.cumsum(np.random.default_rng(seed).normal(size=count))
    place = np.arange(count)
    direct = []
    for n in place:
        weights = np.exp(-0.5 * ((place - n) / samples) ** 2) * (np.abs(place - n) <= int(REACH * samples + 0.5))
        root = np.sqrt(weights)
        design = np.column_stack([np.ones(count), (place - n) / samples])
        direct.append(np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0][0])
    np.testing.assert_allclose(locally_smoothed(values, samples), direct, atol=1e-7 * np.abs(values).max())


def test_a_sine_keeps_its_phase_and_loses_what_a_gaussian_takes() -> None:
    omega, samples = 0.05, 12.0
    signal = np.sin(omega * np.arange(2000))
    middle = slice(500, 1500)
    expected = np.exp(-0.5 * (omega * samples) ** 2) * signal[middle]
    assert locally_smoothed(signal, samples)[middle] == pytest.approx(expected, abs=1e-4)


def test_the_end_is_a_line_and_not_the_noise_of_its_sample() -> None:
    """A signal held beyond its end leaves a quarter of the last sample's variance; the line a tenth, by its weights."""
    generator = np.random.default_rng(4)
    samples = 25.0
    ends = [locally_smoothed(generator.standard_normal(400), samples)[0] for _ in range(400)]
    assert np.var(ends) == pytest.approx(_variance_at_an_end(samples), rel=0.2)
    assert np.var(ends) < 0.1
    line = 3.0 - 0.2 * np.arange(300)
    np.testing.assert_allclose(locally_smoothed(line, samples), line, atol=1e-9)


def _variance_at_an_end(samples: float) -> float:
    """Of the intercept of a weighted line through white noise on one side: the sum of its squared weights."""
    distance = np.arange(int(REACH * samples) + 1) / samples
    bell = np.exp(-0.5 * distance**2)
    s0, s1, s2 = (float(np.sum(bell * distance**power)) for power in (0, 1, 2))
    weights = bell * (s2 - s1 * distance) / (s0 * s2 - s1**2)
    return float(weights @ weights)
