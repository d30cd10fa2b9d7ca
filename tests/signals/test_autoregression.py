"""Scatter of means and mean squares of autoregressions against Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from aerosid.signals.autoregression import correlation_time, independent_squares, variance_of_mean

SEED = 61_000
"""Of these tests; published tables and trials begin elsewhere."""

TRIALS, SAMPLES, INTERVAL = 800, 600, 0.1


def series(time: float) -> NDArray[np.float64]:
    """Autoregressions (TRIALS, SAMPLES) of unit variance with a correlation time, s; white noise of none."""
    pole = np.exp(-INTERVAL / time) if time else 0.0
    white = np.random.default_rng(SEED).standard_normal((TRIALS, SAMPLES + 200))
    return np.asarray(lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white)[:, 200:])


@pytest.mark.parametrize("time", [0.0, 0.3, 1.0])
def test_root_mean_squares_and_means_scatter_as_told(time: float) -> None:
    rows = series(time)
    sizes = np.sqrt(np.mean(rows**2, axis=1))
    count = np.median([independent_squares(row, INTERVAL) for row in rows])
    # Eight hundred trials determine a standard deviation to one part in forty; correlations have medians below 1.
    assert np.std(sizes) == pytest.approx(1.0 / np.sqrt(2.0 * count), rel=0.12)
    variance = np.median([variance_of_mean(row) for row in rows])
    assert np.std(rows.mean(axis=1)) == pytest.approx(np.sqrt(variance), rel=0.12)
    if time:
        assert np.median([correlation_time(row, INTERVAL) for row in rows]) == pytest.approx(time, rel=0.1)


def test_a_mean_scatters_no_more_than_a_value() -> None:
    assert variance_of_mean(np.linspace(-1.0, 1.0, 20)) <= np.var(np.linspace(-1.0, 1.0, 20))
