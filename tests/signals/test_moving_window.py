"""Windows that move along a signal, against scipy's filters bit by bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from aerosid.signals.moving_window import moving_mean, moving_range


@given(samples=st.integers(1, 60), size=st.integers(1, 130), seed=st.integers(0, 2**32 - 1))
def test_the_windows_have_the_bits_of_scipy(samples: int, size: int, seed: int) -> None:
    """Odd and even windows, longer than the signal too."""
    generator = np.random.default_rng(seed)
    values = generator.standard_normal(samples) * 10.0 ** generator.uniform(-8.0, 8.0)
    assert np.array_equal(moving_mean(values, size), uniform_filter1d(values, size))
    assert np.array_equal(moving_mean(values, size, "edge"), uniform_filter1d(values, size, mode="nearest"))
    assert np.array_equal(moving_range(values, size), maximum_filter1d(values, size) - minimum_filter1d(values, size))


@pytest.mark.parametrize("size", [1, 4, 9])
def test_columns_are_averaged_each_by_itself(size: int) -> None:
    values = np.random.default_rng(3).standard_normal((40, 3, 2))
    assert np.array_equal(moving_mean(values, size), uniform_filter1d(values, size, axis=0))
