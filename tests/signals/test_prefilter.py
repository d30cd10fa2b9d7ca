"""The filters against scipy's reference and the analogue frequency response; the cut-off against known spectra."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from aerosid.signals.noise import estimate_noise
from aerosid.signals.prefilter import Butterworth, apply, choose_cut_off, noise_gain


def analogue_gain(order: int, cut_off: float, frequency: float) -> float:
    return float(1.0 / np.sqrt(1.0 + (frequency / cut_off) ** (2 * order)))


def uneven(rng: np.random.Generator, count: int, interval: float) -> np.ndarray:
    return np.cumsum(interval * rng.uniform(0.4, 1.6, count))


def test_on_an_even_grid_it_is_the_digital_butterworth() -> None:
    rng = np.random.default_rng(1)
    time, values = 0.02 * np.arange(400), rng.standard_normal(400)
    sections = signal.butter(4, 3.0, fs=50.0, output="sos")
    causal, _ = signal.sosfilt(sections, values, zi=signal.sosfilt_zi(sections) * values[0])
    np.testing.assert_allclose(apply(Butterworth(4, 3.0, False), time, values), causal, rtol=1e-12, atol=1e-12)
    both = signal.sosfiltfilt(sections, values, padlen=300)
    # The treatment of the ends differs, so the middle is compared.
    np.testing.assert_allclose(apply(Butterworth(4, 3.0), time, values)[120:280], both[120:280], atol=1e-6)


@pytest.mark.parametrize("spacing", ["even", "uneven"])
@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("frequency", [0.3, 1.0, 2.0, 3.0])
def test_a_sine_comes_out_as_the_analogue_response_says(spacing: str, order: int, frequency: float) -> None:
    time = 0.005 * np.arange(4000) if spacing == "even" else uneven(np.random.default_rng(2), 4000, 0.005)
    wave = np.sin(2.0 * np.pi * frequency * time)
    middle = (time > 5.0) & (time < 15.0)
    gain = analogue_gain(order, 2.0, frequency)
    np.testing.assert_allclose(apply(Butterworth(order, 2.0), time, wave)[middle], gain**2 * wave[middle], atol=2e-3)
    poles = signal.butter(order, 4.0 * np.pi, analog=True, output="zpk")
    _, response = signal.freqs_zpk(*poles, worN=[2.0 * np.pi * frequency])
    expected = np.imag(response[0] * np.exp(2j * np.pi * frequency * time))
    np.testing.assert_allclose(apply(Butterworth(order, 2.0, False), time, wave)[middle], expected[middle], atol=4e-3)


@settings(max_examples=30, deadline=None)
@given(order=st.integers(1, 6), cut_off=st.floats(0.5, 4.0), zero_phase=st.booleans(), seed=st.integers(0, 999))
def test_it_is_linear_and_keeps_constants_whatever_the_sampling(
    order: int, cut_off: float, zero_phase: bool, seed: int
) -> None:
    """Linear in the data with the same operator for every channel: an equation between channels survives."""
    rng = np.random.default_rng(seed)
    time = uneven(rng, 150, 0.05) if seed % 2 else 0.05 * np.arange(150)
    low_pass = Butterworth(order, cut_off, zero_phase)
    one, two = rng.standard_normal((2, 150))
    combined = apply(low_pass, time, 3.0 * one - 2.0 * two + 7.0)
    parts = 3.0 * apply(low_pass, time, one) - 2.0 * apply(low_pass, time, two) + 7.0
    np.testing.assert_allclose(combined, parts, atol=1e-8)


def test_ends_of_a_smooth_record_are_kept() -> None:
    time = 0.02 * np.arange(500)
    for values in (2.0 + 3.0 * time, np.cos(2.0 * time), np.exp(-time)):
        for instants in (time, time + 0.004 * np.sin(np.arange(500.0) ** 2)):
            smooth = np.interp(instants, time, values)
            np.testing.assert_allclose(apply(Butterworth(4, 4.0), instants, smooth), smooth, atol=0.006)


def test_missing_samples_stay_missing_and_disturb_little() -> None:
    time = 0.02 * np.arange(600)
    values = np.sin(2.0 * time)
    rng = np.random.default_rng(3)
    holed = np.where(rng.random(600) < 0.1, np.nan, values)
    holed[300:380] = np.nan
    for instants in (time, time + 0.004 * np.sin(np.arange(600.0) ** 2)):
        filtered = apply(Butterworth(4, 3.0), instants, holed)
        np.testing.assert_array_equal(np.isnan(filtered), np.isnan(holed))
        there = np.isfinite(holed)
        np.testing.assert_allclose(filtered[there], values[there], atol=0.03)
    assert np.all(np.isnan(apply(Butterworth(4, 3.0), time, np.full(600, np.nan))))


def test_the_record_is_split_at_a_long_gap() -> None:
    """A jump across a gap of 2 s must not ring on either side."""
    time = 0.02 * np.arange(400)
    values = np.where(time < 3.0, 1.0, np.where(time < 5.0, np.nan, -1.0))
    np.testing.assert_allclose(apply(Butterworth(4, 3.0), time, values), values, atol=1e-12)


@pytest.mark.parametrize("order", [1, 2, 4, 7])
@pytest.mark.parametrize("zero_phase", [True, False])
@pytest.mark.parametrize("share", [0.03, 0.3, 0.8])
def test_noise_gain_is_the_share_that_monte_carlo_leaves(order: int, zero_phase: bool, share: float) -> None:
    interval = 0.03
    low_pass = Butterworth(order, share * 0.5 / interval, zero_phase)
    noise = np.random.default_rng(4).standard_normal(40000)
    filtered = apply(low_pass, interval * np.arange(noise.size), noise)
    assert filtered[1000:-1000].std() == pytest.approx(noise_gain(low_pass, interval), rel=0.06)


def flight(ratio: float, seed: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Two responses whose bands end at 1 Hz and 2 Hz, and an elevator with corners; white noise on each."""
    rng = np.random.default_rng(seed)
    time = 0.02 * np.arange(1500)
    slow = signal.sosfiltfilt(signal.butter(8, 1.0, fs=50.0, output="sos"), rng.standard_normal(1500))
    fast = signal.sosfiltfilt(signal.butter(8, 2.0, fs=50.0, output="sos"), rng.standard_normal(1500))
    elevator = np.sign(np.sin(0.7 * time))
    clean = {"theta": slow, "q": fast, "delta_e": elevator}
    return time, {name: v + v.std() / ratio * rng.standard_normal(1500) for name, v in clean.items()}


@pytest.mark.parametrize("seed", range(4))
def test_the_cut_off_lies_where_the_widest_response_ends(seed: int) -> None:
    time, channels = flight(30.0, seed)
    noise = {name: estimate_noise(time, values) for name, values in channels.items()}
    chosen = choose_cut_off(time, channels, noise)
    assert 0.7 < (chosen.per_channel["theta"] or 0.0) < 1.6
    assert 1.5 < (chosen.per_channel["q"] or 0.0) < 2.7
    assert chosen.cut_off_hz == pytest.approx(1.5 * (chosen.per_channel["q"] or 0.0))
    assert (chosen.per_channel["delta_e"] or 0.0) > 1.5 * (chosen.per_channel["q"] or 0.0)
    assert len(chosen.explanations) == 4
    low_pass = chosen.butterworth()
    assert low_pass == Butterworth(4, chosen.cut_off_hz or 0.0)


def test_units_and_uneven_sampling_leave_the_choice() -> None:
    time, channels = flight(30.0, 7)
    noise = {name: estimate_noise(time, values) for name, values in channels.items()}
    reference = choose_cut_off(time, channels, noise).cut_off_hz
    degrees = {name: 57.3 * values + 20.0 for name, values in channels.items()}
    scaled = choose_cut_off(time, degrees, {name: 57.3 * value for name, value in noise.items()}).cut_off_hz
    assert scaled == pytest.approx(reference)
    keep = np.random.default_rng(8).random(time.size) > 0.2
    thinned = choose_cut_off(time[keep], {name: values[keep] for name, values in channels.items()}, noise)
    assert thinned.cut_off_hz == pytest.approx(reference, rel=0.35)


def test_where_filtering_takes_only_signal_it_says_so() -> None:
    time, channels = flight(30.0, 9)
    without = choose_cut_off(time, channels, {})
    assert without.cut_off_hz is None
    assert without.butterworth() is None
    assert "no response channel" in without.explanations[-1]
    wide = np.random.default_rng(10).standard_normal(1500)
    full = choose_cut_off(time, {"q": wide}, {"q": 0.01})
    assert full.cut_off_hz is None
    assert "not filtered: q holds signal" in full.explanations[-1]


def test_what_cannot_be_had_is_said_in_a_sentence() -> None:
    with pytest.raises(ValueError, match="cannot be had from samples"):
        apply(Butterworth(4, 5.0), 0.1 * np.arange(50), np.zeros(50))
    with pytest.raises(ValueError, match="order"):
        Butterworth(0, 1.0)
    with pytest.raises(ValueError, match="cut-off"):
        Butterworth(4, np.nan)
