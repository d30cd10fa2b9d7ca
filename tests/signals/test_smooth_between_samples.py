"""Samples for lines, and samples in between, against sines that are known between samples."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.interpolate import lagrange

from aerosid.signals.delay_and_lag import refined
from aerosid.signals.smooth_between_samples import samples_for_lines

Array = NDArray[np.float64]


def lost(interval: float, *, correct: bool) -> float:
    """Part of a sine of 1 Hz that lines through its samples lack in the mean, (1)."""
    time = np.arange(0.0, 20.0 + 0.5 * interval, interval)
    samples = np.sin(2.0 * np.pi * time)
    fine = np.arange(5.0, 15.0, 1e-4)
    lines = np.interp(fine, time, samples_for_lines(samples) if correct else samples)
    return 1.0 - 2.0 * float(np.mean(lines * np.sin(2.0 * np.pi * fine)))


def test_lines_contain_a_sine_to_the_sixth_order_of_its_sampling() -> None:
    assert lost(0.1, correct=False) == pytest.approx(0.0325, abs=0.001)
    assert abs(lost(0.1, correct=True)) < 2e-4
    assert np.log2(lost(0.2, correct=True) / lost(0.1, correct=True)) == pytest.approx(6.0, abs=0.5)


def test_a_line_is_left_as_it_is() -> None:
    line = 3.0 - 0.5 * np.arange(12.0)
    assert_allclose(samples_for_lines(line), line, atol=1e-12)
    instants, values = refined(np.arange(12.0), line, 4)
    assert_allclose(values, 3.0 - 0.5 * instants, atol=1e-12)


@pytest.mark.parametrize("parts", [1, 2, 5])
def test_values_in_between_are_those_of_the_cubic_through_four_samples(parts: int) -> None:
    values = np.random.default_rng(3).standard_normal(9)
    instants, fine = refined(2.0 + 0.5 * np.arange(9.0), values, parts)
    assert instants.size == fine.size == 8 * parts + 1
    assert_allclose(fine[::parts], values)
    for n in range(1, 7):
        cubic = lagrange(np.arange(-1.0, 3.0), values[n - 1 : n + 3])
        for k in range(parts):
            assert fine[n * parts + k] == pytest.approx(float(cubic(k / parts)))
            assert instants[n * parts + k] == pytest.approx(2.0 + 0.5 * (n + k / parts))
