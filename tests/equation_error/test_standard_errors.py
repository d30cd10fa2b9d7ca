"""Standard errors by the delete-a-block jackknife: against separate regressions, and by Monte Carlo for few events."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.linalg import sqrtm
from scipy.signal import lfilter

from aerosid.equation_error.regression.design import Design, white_weights
from aerosid.equation_error.regression.least_squares import Solution, regress, solve
from aerosid.equation_error.regression.standard_errors import (
    CR2,
    block_deletion_changes,
    corrected_covariance,
    covariance_of_scores,
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
    """Two coefficients of a record: alpha responds to control steps, where the coloured noise is larger."""
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
        inverse_deviations=np.zeros(len(unknowns)),
        floors=np.zeros(2),
        instruments=(None, None),
    )


def fitted(seed: int) -> tuple[Design, Solution]:
    design = flown(np.random.default_rng(seed))
    return design, regress(design, EquationErrorSettings())


def test_deletion_changes_match_regressions_without_a_block() -> None:
    design = flown(np.random.default_rng(1))
    solution = solve(design, white_weights(design))
    moves = block_deletion_changes(design, solution)
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


def test_the_bounds_hold_where_few_events_determine_the_parameters() -> None:
    """200 flights: 92 of 100 parameters within two deviations; least squares and summed scores are too small."""
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


def one_event(generator: np.random.Generator) -> Design:
    """One coefficient with white noise; one event has as much information on its second parameter as all the rest."""
    shape = 0.2 * generator.standard_normal(SAMPLES)
    shape[40:47] += 1.0
    columns = np.column_stack([np.ones(SAMPLES), shape])
    return Design(
        segments=((0, "C_X"),),
        groups=(("C_X", 0.3),),
        bounds=np.array([0, SAMPLES]),
        target=columns @ np.array([0.02, 0.5]) + 0.1 * generator.standard_normal(SAMPLES),
        columns=columns,
        unknowns=(("one", "constant"), ("term", "event")),
        inverse_deviations=np.zeros(2),
        floors=np.zeros(1),
        instruments=(None,),
    )


def test_standard_errors_of_replicated_parameters_are_bias_reduced() -> None:
    """Against (1 - H_b)^-1/2 e_b with the whole hat matrix H (Bell & McCaffrey 2002, CR2)."""
    design = one_event(np.random.default_rng(3))
    solution = solve(design, white_weights(design))
    bread, slopes = solution.covariance, solution.slopes
    hat = slopes @ bread @ slopes.T
    edges = np.linspace(0, SAMPLES, len(block_deletion_changes(design, solution)) + 1).astype(int)
    moves = []
    for first, stop in pairwise(edges.tolist()):
        block = slice(first, stop)
        root = np.linalg.inv(np.real(sqrtm(np.eye(stop - first) - hat[block, block])))
        moves.append(bread @ slopes[block].T @ root @ solution.whitened[block])
    freedom = SAMPLES / (SAMPLES - 2)
    plain, event = freedom * bread[1, 1], design.unknowns[1]
    expected = max(plain, float(np.sum(np.array(moves)[:, 1] ** 2)))
    assert np.linalg.eigvalsh(hat[edges[5] : edges[7], edges[5] : edges[7]]).max() < DEVIATIONS.most_followed
    assert corrected_covariance(design, solution, [event])[1, 1] == pytest.approx(expected, rel=1e-9)
    both = [np.diag(corrected_covariance(design, solution, known)) for known in ((), [event])]
    assert both[0][0] == both[1][0]


def test_cr2_is_unbiased_and_cr3_conservative() -> None:
    estimates, reduced, deleted = [], [], []
    for seed in range(400):
        design = one_event(np.random.default_rng([7, seed]))
        solution = solve(design, white_weights(design))
        estimates.append(solution.values[1])
        reduced.append(np.sum(block_deletion_changes(design, solution, CR2)[:, 1] ** 2))
        deleted.append(np.sum(block_deletion_changes(design, solution)[:, 1] ** 2))
    # Both means are uncertain by some hundredths: a variance of 400 by 7 %.
    true = float(np.var(estimates))
    assert np.mean(reduced) == pytest.approx(true, rel=0.2)
    assert np.mean(deleted) > 1.6 * true
