"""The covariance of regression scores: against Monte Carlo in noise shared between channels at other lags."""

from __future__ import annotations

import numpy as np
import pytest

from aerosid.signals.spectral_covariance import score_covariance

SAMPLES, RUNS = 600, 300


def noise(generator: np.random.Generator) -> np.ndarray:
    """Two channels (N, 2): one a late, mixed copy of the other beside noise of its own."""
    shocks = generator.standard_normal((SAMPLES + 50, 2))
    slow = np.convolve(shocks[:, 0], 0.9 ** np.arange(50))[: SAMPLES + 50]
    return np.column_stack([slow[50:], 0.8 * slow[46:-4] + shocks[50:, 1]])


def columns() -> np.ndarray:
    time = np.arange(SAMPLES)[:, None]
    first = np.sin(2.0 * np.pi * time * np.array([3.0, 7.0]) / SAMPLES)
    return np.stack([first, np.roll(first, 4, axis=0)], axis=1)


def test_it_is_the_scatter_of_the_scores_over_many_records() -> None:
    x = columns()
    scores, stated = [], []
    for seed in range(RUNS):
        e = noise(np.random.default_rng(seed))
        scores.append(np.einsum("nik,ni->k", x, e))
        stated.append(np.diag(score_covariance(x, e)[0]))
    # A variance of 300 scores is known to 8 %; smoothing over frequencies costs some of the peak at zero.
    ratio = np.mean(stated, axis=0) / np.var(scores, axis=0)
    assert np.all(np.abs(ratio - 1.0) < 0.3)
    apart = np.mean(
        [np.sum(x**2, axis=(0, 1)) * np.var(noise(np.random.default_rng(seed))) for seed in range(20)], axis=0
    )
    assert np.all(np.var(scores, axis=0) > 3.0 * apart)


def test_white_noise_of_one_channel_gives_the_squares_of_the_column() -> None:
    x = columns()[:, :1, :1]
    e = np.random.default_rng(3).standard_normal((SAMPLES, 1))
    found, freedom = score_covariance(x, e)
    # A sine of three turns sits on one frequency, known from its neighbours alone.
    assert found[0, 0] == pytest.approx(float(np.sum(x**2)), rel=0.8)
    assert 4.0 < freedom < 40.0


def test_a_seldom_sampled_channel_counts_its_own_samples() -> None:
    x = columns()[:, :1, :1].copy()
    x[np.arange(SAMPLES) % 5 > 0] = 0.0
    scores, stated = [], []
    for seed in range(RUNS):
        e = np.where(np.arange(SAMPLES) % 5 == 0, np.random.default_rng(seed).standard_normal(SAMPLES), 0.0)[:, None]
        scores.append(np.einsum("nik,ni->k", x, e)[0])
        stated.append(score_covariance(x, e)[0][0, 0])
    assert np.mean(stated) == pytest.approx(np.var(scores), rel=0.3)
    assert np.mean(stated) == pytest.approx(float(np.sum(x**2)), rel=0.1)
