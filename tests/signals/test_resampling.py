"""Resampling against closed forms: sines of known amplitude and delay, at jittered stamps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from aerosid.signals.resampling import (
    filter_delay,
    hold_to,
    interpolate_to,
    low_pass_to,
    nearest_to_samples,
)

SOURCE, WANTED = 250.0, 50.0


def jittered(rate: float, duration: float, jitter: float, seed: int) -> np.ndarray:
    count = int(duration * rate)
    time = np.arange(count) / rate
    return time + np.random.default_rng(seed).uniform(-jitter, jitter, count) / rate


def amplitude_and_delay(time: np.ndarray, values: np.ndarray, frequency: float) -> tuple[float, float]:
    """Least squares of a sine and a cosine; the delay against sin(2 pi f t)."""
    omega = 2.0 * np.pi * frequency
    basis = np.column_stack([np.sin(omega * time), np.cos(omega * time), np.ones_like(time)])
    a, b, _ = np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(np.hypot(a, b)), float(-np.arctan2(b, a) / omega)


@pytest.mark.parametrize("seed", range(5))
def test_a_slow_sine_keeps_amplitude_and_phase_and_a_fast_one_goes(seed: int) -> None:
    """3 Hz at 250 Hz with 20 % jitter to 50 Hz: amplitude within .5 %, delay within 1 ms; 40 Hz gone below 1 %."""
    time = jittered(SOURCE, 20.0, 0.2, seed)
    wanted = np.arange(1.0, 19.0, 1.0 / WANTED)
    slow = low_pass_to(time, np.sin(2 * np.pi * 3.0 * time), wanted, 1.0 / WANTED)
    amplitude, delay = amplitude_and_delay(wanted, slow, 3.0)
    assert amplitude == pytest.approx(1.0, abs=5e-3)
    assert abs(delay) < 1e-3
    fast = low_pass_to(time, np.sin(2 * np.pi * 40.0 * time), wanted, 1.0 / WANTED)
    assert np.sqrt(2.0 * np.mean(fast**2)) < 0.01
    assert np.max(np.abs(fast)) < 0.01


def test_without_the_low_pass_the_fast_sine_would_alias() -> None:
    """What the filter is for: the same 40 Hz, read at 50 Hz by straight lines, is a 10 Hz sine of its own."""
    time = jittered(SOURCE, 20.0, 0.2, 0)
    wanted = np.arange(1.0, 19.0, 1.0 / WANTED)
    read = interpolate_to(time, np.sin(2 * np.pi * 40.0 * time), wanted, 1.0)
    assert amplitude_and_delay(wanted, read, 10.0)[0] > 0.5


def test_a_straight_line_stays_one_up_to_both_ends() -> None:
    time = jittered(SOURCE, 5.0, 0.2, 3)
    wanted = np.arange(time[0], time[-1], 0.02)
    assert_allclose(low_pass_to(time, 3.0 * time - 1.0, wanted, 0.02), 3.0 * wanted - 1.0, atol=1e-9)


def test_two_near_coincident_noisy_samples_make_no_spike() -> None:
    time = np.sort(np.concatenate([np.arange(0.0, 4.0, 0.004), [2.0001]]))
    values = np.random.default_rng(1).normal(0.0, 0.01, time.size)
    assert np.max(np.abs(low_pass_to(time, values, np.arange(1.0, 3.0, 0.02), 0.02))) < 0.03


def test_a_record_shorter_than_the_filter_is_read_too() -> None:
    time = np.arange(0.0, 0.1, 0.004)
    assert time[-1] < filter_delay(0.02)
    found = low_pass_to(time, np.full(time.size, 2.5), np.array([0.0, 0.02, 0.04]), 0.02)
    assert_allclose(found, 2.5, rtol=1e-12)


def test_nothing_is_interpolated_across_a_hole() -> None:
    time = np.array([0.0, 0.1, 0.2, 1.0, 1.1])
    wanted = np.array([-0.1, 0.0, 0.05, 0.2, 0.3, 0.9, 1.0, 1.05, 1.2])
    found = interpolate_to(time, time, wanted, 0.15)
    assert_array_equal(np.isnan(found), [True, False, False, False, True, True, False, False, True])
    assert_allclose(found[~np.isnan(found)], wanted[~np.isnan(found)])


def test_discrete_values_are_held() -> None:
    found = hold_to(np.array([1.0, 2.0, 4.0]), np.array([0.0, 7.0, 3.0]), np.array([0.5, 1.0, 1.999, 2.0, 9.0]))
    assert_array_equal(found, [np.nan, 0.0, 0.0, 7.0, 3.0])


@settings(deadline=None)
@given(st.integers(3, 40), st.integers(0, 2**32 - 1))
def test_a_slow_channel_has_as_many_values_as_samples(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.5, 1.5, count))
    wanted = np.arange(time[0] - 2.0, time[-1] + 2.0, 0.1)
    found = nearest_to_samples(time, 2.0 * time, wanted)
    there = np.isfinite(found)
    assert count - 2 <= np.count_nonzero(there) <= count
    assert_allclose(found[there], 2.0 * wanted[there], rtol=1e-12)
