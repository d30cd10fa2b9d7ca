"""Standard errors with the choice among alternatives: closed forms, and a flight on which the wrong one is selected."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from equations_decided import decided
from numpy.testing import assert_allclose

from aerosid.aircraft import load_aircraft
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.selection.alternatives import Alternative
from aerosid.equation_error.selection.joint_errors import with_errors_held
from aerosid.equation_error.selection.model_averaging import averaged_covariance, probabilities, probability_of
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST, written

LATE_VANE = (31, 18)
"""Seed and index of a flight whose vane lags by .05 s, which is identified as a time delay of .05 s."""


@pytest.fixture(scope="module")
def identified_as_delay(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[EquationErrorDecision, dict[tuple[str, str], float]]:
    folder = Path(tmp_path_factory.mktemp("late"))
    seed, n = LATE_VANE
    circumstances, _, _ = written(folder, [FIRST, seed, n], n)
    logs = [[read_log(folder / f"{name}.csv")] for name in ("identification", "validation")]
    return decided(load_aircraft(folder / "aircraft.toml"), *logs), dict(circumstances.body.terms)


def row(found: Estimate, deficit: float, chosen: str) -> Alternative:
    other, named = Hypothesis("aero_term", "C_m", "alpha^2"), Hypothesis("aero_term", "C_m", chosen)
    return Alternative(other, None, 1.0, 0.1, 9.0, deficit, 8.0, named, found)


def test_probabilities_are_those_of_equal_prior_odds(identified_as_delay: tuple[EquationErrorDecision, object]) -> None:
    found = identified_as_delay[0].completed
    rows = [row(found, np.log(2.0), "alpha^3"), row(found, np.log(4.0), "alpha^3"), row(found, -3.0, "q_hat^2")]
    # One, a half and a quarter share the first; nothing is likelier than the selected effect.
    assert_allclose(probabilities(rows), [2.0 / 7.0, 1.0 / 7.0, 0.5])
    # A size of a fourth of the prior probability counts as a deficit of its logarithm.
    unusual = replace(row(found, 0.0, "alpha^3"), prior_deficit=np.log(4.0))
    assert_allclose(probabilities([unusual, *rows[:1]]), [1.0 / 7.0, 2.0 / 7.0])


def test_the_bounds_contain_the_truth_where_the_alternative_is_selected(
    identified_as_delay: tuple[EquationErrorDecision, dict[tuple[str, str], float]],
) -> None:
    decision, flown = identified_as_delay
    assert [each.hypothesis.label for each in decision.findings] == [("sensor_delay", "alpha", "")]
    assert ("sensor_lag", "alpha", "") in {each.hypothesis.label for each in decision.alternatives}
    completed = decision.completed
    deviations = np.sqrt(np.diag(decision.covariance))
    off = {
        str(unknown[1][1]): abs(value - flown[unknown[1][0], str(unknown[1][1])]) / deviation  # type: ignore[index]
        for unknown, value, deviation in zip(
            completed.design.unknowns, completed.solution.values, deviations, strict=True
        )
        if unknown[0] == "term"
    }
    assert max(off.values()) < 3.0


def test_alternatives_add_their_squared_difference_weighted_by_probability(
    identified_as_delay: tuple[EquationErrorDecision, object],
) -> None:
    decision, _ = identified_as_delay
    completed = decision.completed
    size = len(completed.design.unknowns)
    declared = [unknown for unknown in completed.design.unknowns if unknown[0] == "term"]
    lag = next(each for each in decision.alternatives if each.hypothesis.kind == "sensor_lag")
    fitted = estimate(completed.problem, completed.point)
    total = averaged_covariance(completed, np.zeros((size, size)), fitted, [lag], declared)
    assert np.linalg.matrix_rank(total, tol=1e-9 * np.trace(total)) == 1
    assert np.linalg.eigvalsh(total).min() > -1e-9 * np.trace(total)
    deviations = np.sqrt(np.diag(completed.solution.covariance))
    # The same flight with the lag in place of the delay, estimated from the declared values.
    assert lag.active is not None
    before = decision.before.point
    point = before.with_effects((*before.effects, lag.active))
    other = estimate(completed.problem, with_errors_held(point, (lag.active,)))
    for unknown in declared:
        place = completed.design.unknowns.index(unknown)
        apart = other.value(unknown) - completed.solution.values[place]
        assert_allclose(
            np.sqrt(total[place, place] / probabilities([lag])[0]), abs(apart), atol=0.2 * deviations[place], rtol=0.05
        )


@pytest.mark.slow
def test_the_bounds_contain_a_near_significant_effect(tmp_path: Path) -> None:
    """A vane that shows .904 of alpha: kinematics gain 11 in ln L of 12, and C_m_alpha was 52 standard errors off."""
    circumstances, _, _ = written(tmp_path, [FIRST, 151, 1], 1)
    logs = [[read_log(tmp_path / f"{name}.csv")] for name in ("identification", "validation")]
    found = decided(load_aircraft(tmp_path / "aircraft.toml"), *logs)
    assert ("sensor_scale", "alpha", "") not in {each.hypothesis.label for each in found.findings}
    (row, *_) = found.near_significant
    assert row.hypothesis.label == ("sensor_scale", "alpha", "")
    assert 0.1 < probability_of(row.gain - row.penalty) < 0.5
    for unknown, value, variance in zip(
        found.completed.design.unknowns, found.completed.solution.values, np.diag(found.covariance), strict=False
    ):
        if unknown[0] == "term":
            coefficient, term = unknown[1]  # type: ignore[misc]
            assert abs(value - circumstances.body.terms[coefficient, str(term)]) < 3.5 * np.sqrt(variance)


@pytest.mark.slow
def test_the_bounds_of_the_constants_contain_a_near_significant_bias(tmp_path: Path) -> None:
    """A vane off by -.007 rad: kinematics gain 7 in ln L of 12, and the constants were 6, 10 and 12 bounds off."""
    circumstances, _, _ = written(tmp_path, [FIRST, 205, 12], 12)
    logs = [[read_log(tmp_path / f"{name}.csv")] for name in ("identification", "validation")]
    found = decided(load_aircraft(tmp_path / "aircraft.toml"), *logs)
    assert [row.hypothesis.label for row in found.near_significant] == [("sensor_bias", "alpha", "")]
    deviations = np.sqrt(np.diag(found.covariance))
    off = {
        unknown[1][0]: abs(value - circumstances.body.terms[unknown[1][0], "1"]) / deviation  # type: ignore[index]
        for unknown, value, deviation in zip(
            found.completed.design.unknowns, found.completed.solution.values, deviations, strict=True
        )
        if unknown[0] == "one"
    }
    assert set(off) == {"C_X", "C_Z", "C_m"}
    assert max(off.values()) < 3.0


def test_a_gain_equal_to_the_penalty_has_even_odds() -> None:
    assert probability_of(0.0) == 0.5
    assert probability_of(-np.log(3.0)) == pytest.approx(0.25)
    assert probability_of(-30.0) < 1e-12
    assert (probability_of(-2000.0), probability_of(2000.0)) == (0.0, 1.0)  # of a hopeless effect, without a warning
