"""Cross-validation over blocks: deletion formula against separate regressions, division into blocks, and its cost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided
from numpy.testing import assert_allclose

from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.block_cross_validation import Block, block_residuals, blocks_of
from aerosid.equation_error.selection.cross_validation import (
    CoefficientFit,
    PredictionResidual,
    lowers_fit,
    predicts_worse,
    unexplained_rise,
)
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

SEEDS = 6_000_000
BENT = Wrong(terms={("C_m", "alpha^2"): -2.5})


def estimated(flights: int = 1, seconds: float = 24.0, seed: int = 1, air: float = 0.6) -> Estimate:
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(seed))
    logs = [flown(f"f{n}", body, SEEDS + 10 * seed + n, air=air, seconds=seconds) for n in range(flights)]
    return decided(aircraft, logs, []).before


def regressed_without(found: Estimate, block: Block) -> np.ndarray:
    """The parameters by ordinary least squares on all whitened rows that do not depend on the block."""
    design, keep = found.design, np.ones(found.design.target.size, dtype=bool)
    for s, (place, _) in enumerate(design.segments):
        if place == block.recording:
            start = design.rows(s).start
            keep[start + block.first : min(start + block.stop + 4, design.rows(s).stop)] = False
    slopes = found.solution.slopes
    y = found.solution.whitened + slopes @ found.solution.values
    prior, expected = design.inverse_deviations > 0.0, design.expected
    assert expected is not None
    own = np.zeros((expected.values.size, slopes.shape[1]))
    own[:, : expected.rows.shape[1]] = expected.rows
    rows = np.vstack([slopes[keep], np.diag(design.inverse_deviations)[prior], own])
    return np.linalg.lstsq(rows, np.concatenate([y[keep], np.zeros(prior.sum()), expected.values]), rcond=None)[0]


def test_the_deletion_formula_matches_a_regression_without_the_block() -> None:
    found = estimated()
    design, blocks = found.design, blocks_of(found)
    assert len(blocks) > 1
    predicted = block_residuals(found, blocks)
    assert set(predicted) == {(n, name) for n in range(len(blocks)) for name in ("C_X", "C_Z", "C_m")}
    for (number, equation), each in predicted.items():
        block = blocks[number]
        start = design.rows(design.segments.index((0, equation))).start
        rows = slice(start + block.first, start + block.stop)
        left = design.target[rows] - design.columns[rows] @ regressed_without(found, block)
        free = [p for p, unknown in enumerate(design.unknowns) if unknown[0] in ("one", "gust")]
        own = np.column_stack([np.ones(left.size), design.columns[rows][:, free]])
        left = left - own @ np.linalg.lstsq(own, left, rcond=None)[0]
        assert_allclose(each.residual, left, atol=1e-7 * float(np.std(design.target[rows])) + 1e-12)


def test_blocks_are_contiguous_long_enough_and_of_equal_variance() -> None:
    found = estimated(seconds=40.0)
    settings = found.problem.settings
    blocks = blocks_of(found)
    design = found.design
    interval = found.problem.recordings[0].interval * found.problem.recordings[0].band.step
    assert [b.first for b in blocks[1:]] == [b.stop for b in blocks[:-1]]
    assert blocks[0].first == 0
    assert all((b.stop - b.first) * interval >= settings.block_length for b in blocks)
    for equation in ("C_Z", "C_m"):
        values = design.target[design.rows(design.segments.index((0, equation)))]
        squares = (values - values.mean()) ** 2
        shares = [squares[b.first : b.stop].sum() / squares.sum() for b in blocks]
        assert min(shares) > 0.3 / len(blocks)


def test_a_record_too_short_for_two_blocks_has_none_and_of_several_records_each_is_one() -> None:
    found = estimated()
    short = replace(found.problem.settings, block_length=20.0)
    assert blocks_of(replace(found, problem=replace(found.problem, settings=short))) == ()
    assert block_residuals(found, ()) == {}
    blocks = blocks_of(estimated(flights=3, air=0.0))
    assert [b.recording for b in blocks] == [0, 1, 2]
    assert all(b.first == 0 for b in blocks)


NO_SLOPES = np.zeros((200, 0))


def left(seed: int, size: float) -> PredictionResidual:
    generator = np.random.default_rng(seed)
    measured, residual = generator.standard_normal(200), size * generator.standard_normal(200)
    return PredictionResidual(measured, residual, NO_SLOPES, np.eye(0))


def test_a_worse_prediction_refutes_unless_another_coefficient_gains_more() -> None:
    same = {(0, "C_Z"): left(1, 0.1), (1, "C_Z"): left(2, 0.1)}
    worse = same | {(1, "C_Z"): left(3, 0.3)}
    assert predicts_worse(same, worse, 2.0, 0.002)
    assert not predicts_worse(worse, same, 2.0, 0.002)
    assert not predicts_worse(same, same, 2.0, 0.002)
    gaining = {(1, "C_m"): left(4, 0.9)}, {(1, "C_m"): left(5, 0.1)}
    assert not predicts_worse(same | gaining[0], worse | gaining[1], 2.0, 0.002)


def test_prediction_improves_where_the_unexplained_fractions_fall_in_sum() -> None:
    same = {(0, "C_Z"): left(1, 0.1), (0, "C_m"): left(2, 0.1)}
    better = same | {(0, "C_m"): left(2, 0.05)}
    assert unexplained_rise(same, same) == 0.0
    assert unexplained_rise(same, better) == pytest.approx(-0.0075, rel=0.3)
    assert unexplained_rise(better, same) == pytest.approx(-unexplained_rise(same, better))


@pytest.mark.parametrize(
    ("before", "after", "lowered"),
    [
        ({"one": 0.02}, {"one": -3.4}, True),
        ({"one": 0.02, "unseen": 0.15}, {"one": -3.4, "unseen": -0.2}, True),
        ({"one": 0.02, "unseen": 0.15}, {"one": -3.4, "unseen": 0.6}, False),  # confirmed by the other record
        ({"one": 0.02, "two": 0.5}, {"one": -3.4, "two": 0.51}, False),
        ({"one": 0.900}, {"one": 0.899}, False),
        ({"one": 0.5, "unseen": 0.5}, {"one": 0.6, "unseen": 0.4}, False),
    ],
)
def test_a_term_that_fits_its_own_coefficient_worse_is_known_by_all_records(
    before: dict[str, float], after: dict[str, float], *, lowered: bool
) -> None:
    def fits(values: dict[str, float]) -> list[CoefficientFit]:
        other = CoefficientFit("one", True, "C_Z", 0.9)
        return [other, *(CoefficientFit(name, name != "unseen", "C_X", r2) for name, r2 in values.items())]

    assert lowers_fit(fits(before), fits(after), "C_X", 0.002) is lowered
    assert not lowers_fit(fits(before), fits(after), "C_Z", 0.002)


def test_a_term_that_predicts_the_left_out_flight_worse_is_not_selected() -> None:
    """Two flights with moments of opposite sign: the term improves the whole fit, but predicts neither flight."""
    body = BODIES[0]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(1))
    logs = [
        flown(f"f{n}", body, SEEDS + n, air=0.0, wrong=Wrong(terms={("C_m", "alpha*delta_e"): size}), seconds=24.0)
        for n, size in enumerate((12.0, -3.0))
    ]
    found = decided(aircraft, logs, [])
    assert ("C_m", "alpha*delta_e") not in {row.hypothesis.label[1:] for row in found.findings}


@pytest.mark.parametrize("n", range(3))
def test_a_planted_effect_is_found_on_a_single_flight(n: int) -> None:
    body = BODIES[(0, 2, 4)[n]]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(n))
    log = flown("one", body, SEEDS + 100 + n, air=0.3, wrong=BENT, seconds=30.0)
    (row,) = decided(aircraft, [log], []).findings
    assert row.hypothesis.label == ("aero_term", "C_m", "alpha^2")
    assert row.improves_prediction is True
    assert abs(row.value + 2.5) < 4.0 * row.std_error


def test_nothing_is_selected_on_a_single_complete_flight() -> None:
    body = BODIES[1]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(5))
    log = flown("one", body, SEEDS + 200, air=0.6, wrong=NOTHING, seconds=30.0)
    assert decided(aircraft, [log], []).findings == ()
