"""The noise estimate against known noise on simulated manoeuvres; the autocovariance against its double sum."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal
from scipy.stats import norm, truncnorm

from aerosid.signals.noise import _trimmed_scale, autocovariance, estimate_noise, noise_at_rest


def short_period(
    interval: float, duration: float, step: float, signs: tuple[int, ...], frequency: float = 3.0
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Elevator steps from 1 s on through a second-order short period: alpha, q, a_z (with direct lift) and elevator."""
    time = np.arange(0.0, duration, interval)
    edges = 1.0 + step * np.arange(len(signs) + 1)
    elevator = np.concatenate(([0.0], signs, [0.0]))[np.searchsorted(edges, time, side="right")]
    dynamics = np.array([[-1.2, 1.0], [-(frequency**2), 1.2 - frequency]])
    output = np.array([[1.0, 0.0], [0.0, 1.0], [-120.0, 0.0]])
    system = (dynamics, np.array([[-0.1], [-12.0]]), output, np.array([[0.0], [0.0], [-10.0]]))
    _, response, _ = signal.lsim(system, elevator, time)
    return time, {"alpha": response[:, 0], "q": response[:, 1], "a_z": response[:, 2], "delta_e": elevator}


FLIGHTS = {
    "doublet, 30 ms": (short_period(0.03, 14.0, 1.0, (1, -1)), 0.05),
    "3-2-1-1, 20 ms": (short_period(0.02, 12.0, 0.6, (1, 1, 1, -1, -1, 1, -1)), 0.05),
    "2 s steps, 10 Hz": (short_period(0.1, 60.0, 2.0, (1, -1) * 14), 0.12),
}


@pytest.mark.parametrize("flight", FLIGHTS)
@pytest.mark.parametrize("ratio", [20.0, 100.0])
def test_the_mean_estimate_is_the_planted_noise(flight: str, ratio: float) -> None:
    (time, channels), tolerance = FLIGHTS[flight]
    rng = np.random.default_rng(1)
    for name, clean in channels.items():
        planted = clean.std() / ratio
        estimates = [estimate_noise(time, clean + planted * rng.standard_normal(time.size)) for _ in range(30)]
        assert np.mean(estimates) == pytest.approx(planted, rel=tolerance), name
        assert np.std(estimates) < 0.12 * planted, name


def test_a_manoeuvre_without_noise_has_none() -> None:
    for flight, _ in FLIGHTS.values():
        time, channels = flight
        for name, clean in channels.items():
            assert estimate_noise(time, clean) <= 1e-4 * clean.std(), name
    assert estimate_noise(np.arange(50.0), np.full(50, 9.7)) == 0.0
    ramp = 1500.0 + 0.1 * np.arange(50.0)
    assert estimate_noise(np.arange(50.0), ramp) == 0.0


@pytest.mark.parametrize("spoil", ["missing", "spikes", "irregular", "large offset", "quantised"])
def test_spoiled_records_give_the_same_noise(spoil: str) -> None:
    rng = np.random.default_rng(2)
    time, channels = short_period(0.03, 14.0, 1.0, (1, -1))
    if spoil == "irregular":
        fine, dense = short_period(0.003, 14.0, 1.0, (1, -1))
        chosen = np.sort(rng.choice(fine.size, time.size, replace=False))
        time, channels = fine[chosen], {"q": dense["q"][chosen]}
    clean = channels["q"]
    planted = 0.05 * clean.std()
    estimates = []
    for _ in range(20):
        values = clean + planted * rng.standard_normal(time.size)
        if spoil == "missing":
            values[rng.random(time.size) < 0.15] = np.nan
            values[200:240] = np.nan
        elif spoil == "spikes":
            values[rng.choice(time.size, 6, replace=False)] += 50.0 * planted
        elif spoil == "large offset":
            values = values + 1e5
        elif spoil == "quantised":
            values = np.round(values / planted) * planted
        estimates.append(estimate_noise(time, values))
    expected = planted * np.sqrt(1.0 + 1.0 / 12.0) if spoil == "quantised" else planted
    assert np.mean(estimates) == pytest.approx(expected, rel=0.08)


def test_noise_far_below_the_quantum_reads_as_the_quantum() -> None:
    time = np.arange(400) * 0.05
    quantum = 0.7
    values = quantum * np.round(30.0 * np.sin(0.3 * time) + 0.05 * np.random.default_rng(3).standard_normal(400))
    assert estimate_noise(time, values) == pytest.approx(quantum / np.sqrt(12.0), rel=0.35)
    assert estimate_noise(time, values) >= quantum / np.sqrt(12.0) * (1.0 - 1e-9)


def test_a_channel_that_dwells_on_its_levels_keeps_the_noise_of_its_jumps() -> None:
    """Most differences are tiny; the noise is in the third that jump by the converter's step."""
    rng = np.random.default_rng(4)
    values = 0.1 * (rng.random(600) < 0.3) + 0.001 * rng.standard_normal(600)
    assert estimate_noise(np.arange(600) * 0.1, values) == pytest.approx(values.std(), rel=0.5)


@given(st.integers(1, 80), st.integers(0, 3), st.integers(0, 2**32 - 1))
def test_the_scale_of_differences_is_that_of_trimming_them_again_and_again(count: int, ties: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    differences = rng.standard_normal(count) * np.where(rng.random(count) < 0.1, 20.0, 1.0)
    differences = np.round(differences, ties) if ties else differences
    size = np.abs(differences)
    scale = np.quantile(size, 0.8) / norm.ppf(0.9)
    for _ in range(50):
        if scale == 0.0:
            break
        before, scale = scale, np.sqrt(np.mean(size[size <= 3.0 * scale] ** 2) / truncnorm.var(-3.0, 3.0))
        if abs(scale - before) <= 1e-6 * before:
            break
    assert _trimmed_scale(differences) == pytest.approx(scale, rel=1e-9)


def test_a_smooth_record_that_drifts_does_not_count_as_noise() -> None:
    time = np.arange(1000) * 0.02
    rng = np.random.default_rng(5)
    values = np.sin(time) + 0.3 * time + 0.02 * rng.standard_normal(1000)
    assert estimate_noise(time, values) == pytest.approx(0.02, rel=0.1)


@pytest.mark.parametrize("values", [[], [1.0], [np.nan] * 30, [np.nan, 1.0, 2.0] * 3, [np.inf] * 20])
def test_too_little_to_judge_is_zero_and_never_nan(values: list[float]) -> None:
    assert estimate_noise(np.arange(float(len(values))), np.array(values)) == 0.0


@settings(max_examples=40, deadline=None)
@given(scale=st.floats(1e-6, 1e6), offset=st.floats(-1e3, 1e3), stretch=st.floats(1e-3, 1e3), seed=st.integers(0, 99))
def test_the_estimate_follows_a_change_of_units(scale: float, offset: float, stretch: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.5, 1.5, 120))
    values = np.sin(0.1 * time) + 0.1 * rng.standard_normal(120)
    reference = estimate_noise(time, values)
    assert estimate_noise(stretch * time, scale * (values + offset)) == pytest.approx(scale * reference, rel=1e-4)


@settings(max_examples=50, deadline=None)
@given(count=st.integers(1, 40), max_lag=st.integers(0, 50), missing=st.floats(0.0, 0.6), seed=st.integers(0, 10**6))
def test_autocovariance_is_the_double_sum(count: int, max_lag: int, missing: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    residual = rng.standard_normal(count)
    residual[rng.random(count) < missing] = np.nan
    expected = np.zeros(max_lag + 1)
    for lag in range(min(max_lag, count - 1) + 1):
        products = [residual[i] * residual[i + lag] for i in range(count - lag)]
        there = [product for product in products if np.isfinite(product)]
        if there:
            expected[lag] = sum(there) / len(there) * (count - lag) / count
    np.testing.assert_allclose(autocovariance(residual, max_lag), expected, atol=1e-12)


@pytest.mark.parametrize("memory", [0.0, 0.1, 0.3])
def test_noise_at_rest_contains_its_colour(memory: float) -> None:
    """A first-order process of unit variance, between steps of the channel that differences take for corners."""
    generator, interval = np.random.default_rng(17), 0.04
    time = np.arange(0.0, 60.0, interval)
    kept = np.exp(-interval / memory) if memory else 0.0
    noise = signal.lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], generator.standard_normal(time.size + 200))[200:]
    steps = 40.0 * np.sign(np.sin(2.0 * np.pi * time / 15.0)) * (time > 5.0)
    # Over two seconds a mean takes a part of it along, and the quietest tenth of the windows is below the average.
    white = estimate_noise(time, steps + noise)
    assert 0.6 < noise_at_rest(time, steps + noise, white) < 1.1
    if memory == 0.3:
        assert white < 0.5


def test_a_channel_that_never_rests_has_no_more_than_a_few_times_its_white_noise() -> None:
    time = np.arange(0.0, 40.0, 0.04)
    values = 20.0 * np.sin(2.0 * np.pi * 0.8 * time) + np.random.default_rng(3).standard_normal(time.size)
    white = estimate_noise(time, values)
    assert noise_at_rest(time, values, white) == pytest.approx(5.0 * white)
    assert white == pytest.approx(1.0, rel=0.15)
