"""Gaussian low-pass by Fourier transform: the direct sum of scipy.ndimage, and what an average keeps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d

from aerosid.signals.gaussian_filter import gaussian_filtered


@given(st.integers(2, 400), st.floats(0.5, 300.0), st.integers(0, 10))
def test_it_is_the_direct_sum_with_ends_held(count: int, samples: float, seed: int) -> None:
    values = np.cumsum(np.random.default_rng(seed).normal(size=count))
    direct = gaussian_filter1d(values, samples, mode="nearest")
    np.testing.assert_allclose(gaussian_filtered(values, samples), direct, atol=1e-12 * np.abs(values).max())


def test_a_sine_keeps_its_phase_and_loses_what_a_gaussian_takes() -> None:
    omega, samples = 0.05, 12.0
    signal = np.sin(omega * np.arange(2000))
    middle = slice(500, 1500)
    expected = np.exp(-0.5 * (omega * samples) ** 2) * signal[middle]
    assert gaussian_filtered(signal, samples)[middle] == pytest.approx(expected, abs=1e-4)
