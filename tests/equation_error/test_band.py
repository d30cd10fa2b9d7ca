"""The common low-pass and decimation."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from aerosid.equation_error.equations.band import Band, band_end, band_up_to

LIMITS = (0.8, 4.0, 0.25)


def choose_band(rates: list[np.ndarray], interval: float, depth: float) -> Band:
    return band_up_to(band_end(rates, interval, 10.0, depth, LIMITS), interval)


def pitching(samples: int, interval: float, noise: float) -> np.ndarray:
    time = interval * np.arange(samples)
    generator = np.random.default_rng(1)
    motion = 0.1 * np.sin(2.0 * np.pi * 0.5 * time) * np.exp(-(((time - 10.0) / 4.0) ** 2))
    return np.asarray(motion + noise * generator.standard_normal(samples))


@given(st.floats(-5.0, 5.0), st.floats(-1.0, 1.0))
def test_lines_pass_unchanged(level: float, slope: float) -> None:
    band = choose_band([pitching(800, 0.02, 1e-3)], 0.02, 1e-4)
    time = 0.02 * np.arange(800)
    line = level + slope * time
    np.testing.assert_allclose(band(line), line[band.rows(800)], atol=1e-9)


def test_the_pass_band_is_kept_and_the_stop_band_removed() -> None:
    band = choose_band([pitching(2000, 0.02, 1e-3)], 0.02, 1e-4)
    assert band.step > 1
    time = 0.02 * np.arange(2000)
    rows = band.rows(2000)
    slow, fast = np.sin(2.0 * np.pi * 0.4 * time), np.sin(2.0 * np.pi * 20.0 * time)
    inner = slice(5, -5)
    np.testing.assert_allclose(band(slow)[inner], slow[rows][inner], atol=5e-3)
    assert np.abs(band(fast)[inner]).max() < 5e-3


def test_columns_are_filtered_independently() -> None:
    band = choose_band([pitching(900, 0.02, 1e-3)], 0.02, 1e-4)
    columns = np.random.default_rng(2).standard_normal((900, 3))
    together = band(columns)
    for k in range(3):
        np.testing.assert_allclose(together[:, k], band(columns[:, k]), atol=1e-12)


def test_noise_narrows_the_band() -> None:
    quiet = choose_band([pitching(1500, 0.02, 1e-5)], 0.02, 1e-8)
    noisy = choose_band([pitching(1500, 0.02, 2e-2)], 0.02, 1e-8)
    assert noisy.step >= quiet.step
