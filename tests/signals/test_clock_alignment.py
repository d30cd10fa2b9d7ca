"""Offset and drift against planted ones: found within three of their own deviations, and those honest."""

from __future__ import annotations

import numpy as np
import pytest

from aerosid.signals.clock_alignment import fit_clocks

OFFSET, DRIFT = 0.137, 40e-6


def motion(time: np.ndarray) -> np.ndarray:
    """A pitch rate as flown: doublets and a slow wave, of incommensurate frequencies."""
    return (
        np.sin(2 * np.pi * 0.31 * time) * np.exp(-(((time % 60.0) - 20.0) ** 2) / 60.0)
        + 0.3 * np.sin(2 * np.pi * 0.073 * time + 1.0)
        + 0.2 * np.sin(2 * np.pi * 0.83 * time) * np.exp(-(((time % 37.0) - 18.0) ** 2) / 20.0)
    )


def two_records(seed: int, duration: float = 600.0, noise: float = 0.05) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, duration, 0.02) + rng.uniform(-2e-3, 2e-3, int(duration * 50))
    true = np.arange(3.0, duration - 3.0, 0.1)
    other = true + OFFSET + DRIFT * (true - 300.0)
    return (
        time,
        motion(time) + rng.normal(0, noise, time.size),
        other,
        1.3 * motion(true) + 0.2 + rng.normal(0, noise, true.size),
    )


def test_offset_and_drift_are_found_within_three_of_their_deviations() -> None:
    fit = fit_clocks(*two_records(0))
    assert fit is not None
    at_300 = fit.offset + fit.drift * (300.0 - fit.at)
    assert abs(at_300 - OFFSET) < 3.0 * fit.offset_std
    assert abs(fit.drift - DRIFT) < 3.0 * fit.drift_std
    assert fit.offset_std < 5e-3
    assert fit.drift_std < 40e-6
    assert fit.gain == pytest.approx(1.3, rel=0.02)


def test_the_deviations_are_those_of_repeats() -> None:
    """60 noise records: normalised errors scatter by one. A chi-square of 60 passes in 0.1 to 99.9 % (31.7 to 99.6)."""
    fits = [fit_clocks(*two_records(seed, duration=200.0)) for seed in range(60)]
    assert all(fit is not None for fit in fits)
    offset = np.array([(f.offset - OFFSET - DRIFT * (f.at - 300.0)) / f.offset_std for f in fits if f])
    drift = np.array([(f.drift - DRIFT) / f.drift_std for f in fits if f])
    assert 31.7 < np.sum(offset**2) < 99.6
    assert 31.7 < np.sum(drift**2) < 99.6


def test_stamps_go_there_and_back() -> None:
    fit = fit_clocks(*two_records(1))
    assert fit is not None
    time = np.linspace(0.0, 600.0, 7)
    np.testing.assert_allclose(fit.first(fit.other(time)), time, atol=1e-9)


def test_records_of_different_things_are_not_aligned() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 100.0, 0.1)
    assert fit_clocks(time, rng.normal(size=1000), time, rng.normal(size=1000)) is None


@pytest.mark.parametrize("begun", [40.0, 55.0])
def test_records_that_are_still_where_they_overlap_are_not_aligned(begun: float) -> None:
    """One recorder was switched off before the other's signal moved: nothing tells their clocks apart."""
    time, other = np.arange(0.0, 60.0, 0.1), np.arange(begun, 120.0, 0.1)
    assert fit_clocks(time, 0.25 * (time < 1.0), other, 0.25 * (other > 119.0)) is None


def test_a_steady_ramp_tells_no_offset() -> None:
    time = np.arange(0.0, 60.0, 0.1)
    assert fit_clocks(time, 0.01 * time, time, 0.01 * time) is None
