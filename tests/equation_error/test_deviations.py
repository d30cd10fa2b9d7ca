"""Deviations by the delete-a-block jackknife: against regressions anew, and by Monte Carlo where events are few."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.signal import lfilter

from aerosid.equation_error.regression.design import Design, Solution, regress, solve, white_weights
from aerosid.equation_error.regression.deviations import (
    corrected_covariance,
    covariance_of_scores,
    moves_without_blocks,
)
from aerosid.equation_error.settings import DEVIATIONS, EquationErrorSettings

Array = NDArray[np.float64]

SAMPLES = 100
"""In the band, as of half a minute."""

TRUE = np.array([0.02, -0.7, -16.0, -1.9])


def steps(generator: np.random.Generator) -> Array:
    """A control that steps a few times."""
    values = np.zeros(SAMPLES)
    for place in generator.integers(8, SAMPLES - 8, 4):
        values[place : place + 6] += generator.uniform(-0.04, 0.04)
    return values


def flown(generator: np.random.Generator) -> Design:
    """Two coefficients of a recording: alpha answers the steps of a control, the noise is coloured and larger there."""
    control = steps(generator)
    alpha = lfilter([0.2], [1.0, -1.5, 0.72], control)
    rate = 0.02 * np.gradient(alpha)
    columns = np.column_stack([np.ones(SAMPLES), alpha, rate, control])
    scale = 1.0 + 30.0 * np.abs(np.gradient(control))
    noise = [1e-3 * lfilter([1.0], [1.0, -0.6], scale * generator.standard_normal(SAMPLES)) for _ in range(2)]
    whole = np.zeros((2 * SAMPLES, 2 * TRUE.size))
    whole[:SAMPLES, : TRUE.size], whole[SAMPLES:, TRUE.size :] = columns, columns
    unknowns = tuple(("term", (name, n)) for name in ("C_Z", "C_m") for n in range(TRUE.size))
    return Design(
        segments=((0, "C_Z"), (0, "C_m")),
        groups=(("C_Z", 0.3), ("C_m", 0.3)),
        bounds=np.array([0, SAMPLES, 2 * SAMPLES]),
        target=np.concatenate([columns @ TRUE + noise[0], columns @ TRUE + noise[1]]),
        columns=whole,
        unknowns=unknowns,
        precisions=np.zeros(len(unknowns)),
        floors=np.zeros(2),
        instruments=(None, None),
    )


def fitted(seed: int) -> tuple[Design, Solution]:
    design = flown(np.random.default_rng(seed))
    return design, regress(design, EquationErrorSettings())


def test_moves_are_those_of_regressions_without_a_block() -> None:
    design = flown(np.random.default_rng(1))
    solution = solve(design, white_weights(design))
    moves = moves_without_blocks(design, solution)
    length = SAMPLES // (SAMPLES // min(DEVIATIONS.lags + 1, SAMPLES // DEVIATIONS.fewest_blocks))
    assert len(moves) == SAMPLES // length
    edges = np.linspace(0, SAMPLES, len(moves) + 1).astype(int)
    white = solution.whitened + solution.slopes @ solution.values
    compared = 0
    for n, (first, stop) in enumerate(pairwise(edges.tolist())):
        keep = np.ones(2 * SAMPLES, dtype=bool)
        keep[first:stop] = keep[SAMPLES + first : SAMPLES + stop] = False
        out = solution.slopes[~keep]
        if np.linalg.eigvalsh(out @ solution.covariance @ out.T).max() < 0.8:
            anew = np.linalg.lstsq(solution.slopes[keep], white[keep], rcond=None)[0]
            size = np.sqrt(np.diag(solution.covariance))
            assert_allclose((solution.values - anew) / size, moves[n] / size, rtol=1e-6, atol=1e-8)
            compared += 1
    assert compared > len(moves) // 2


def test_no_variance_is_smaller_than_that_of_least_squares() -> None:
    for seed in range(5):
        design, solution = fitted(seed)
        assert np.all(np.diag(corrected_covariance(design, solution)) >= np.diag(solution.covariance))


def test_the_bounds_hold_where_a_few_events_tell_everything() -> None:
    """200 flights: 92 of 100 numbers within two deviations; least squares and summed scores are too sure."""
    within = {"blocks": 0, "least squares": 0, "scores": 0}
    flights = 200
    for seed in range(flights):
        design, solution = fitted(1000 + seed)
        bread = solution.covariance
        scores = covariance_of_scores(design, solution.slopes * solution.whitened[:, None])
        variances = {
            "blocks": np.diag(corrected_covariance(design, solution)),
            "least squares": np.diag(bread),
            "scores": np.diag(bread @ scores @ bread),
        }
        off = np.abs(solution.values - np.tile(TRUE, 2))
        for name, variance in variances.items():
            within[name] += int(np.sum(off < 2.0 * np.sqrt(variance)))
    share = {name: count / (flights * 2 * TRUE.size) for name, count in within.items()}
    assert share["blocks"] > 0.90
    assert share["blocks"] > share["least squares"] + 0.03
    assert share["blocks"] > share["scores"] + 0.03
    assert share["blocks"] == pytest.approx(0.93, abs=0.03)
