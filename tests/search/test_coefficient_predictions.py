"""R^2 of coefficients predicted with given values, against those of the decision and against plain sums of squares."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, questioned

from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.flight_model.aerodynamics import Entry
from aerosid.search.attribution import Attribution
from aerosid.search.equation_error_attribution import attribute_by_equations
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEED = 7420
BODY = BODIES[1]


@pytest.fixture(scope="module")
def found() -> Attribution:
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(SEED))
    wrong = Wrong(delay={"alpha": 0.12})
    log, other = (flown(each, BODY, SEED + n, air=0.3, wrong=wrong, seconds=24.0) for n, each in enumerate("ab"))
    return attribute_by_equations(decided(aircraft, [log], [other]), [questioned(aircraft, log)[1]])


def entry_of(found: Attribution, coefficient: str, term: str) -> Entry:
    return next(entry for entry in found.completed.free if (entry[0], str(entry[1])) == (coefficient, term))


def with_factor(found: Attribution, coefficient: str, term: str, factor: float) -> Refinement:
    """The completed estimate with one derivative times a factor."""
    model = found.completed.model
    values = model.values.copy()
    values[model.index(entry_of(found, coefficient, term))] *= factor
    return replace(found.completed, model=model.with_values(values))


def test_at_the_regression_s_own_values_they_are_those_of_the_decision(found: Attribution) -> None:
    assert found.predictions is not None
    expected = {(a.recording, a.coefficient): (b.r2, a.r2) for b, a in found.predictions.decision.coefficient_fits}
    rows = {(row.log, row.coefficient): (row.r2_before, row.r2_after) for row in found.r_squared}
    assert set(rows) == set(expected)
    assert len(rows) == 6
    for key, pair in rows.items():
        assert pair == pytest.approx(expected[key], abs=1e-9)


def test_a_value_off_by_three_tenths_is_told_on_the_validation_flight_alone_and_by_how_much(found: Attribution) -> None:
    """The fall of R^2 is the difference of both predictions' R^2, whose squares are summed elsewhere."""
    assert found.predictions is not None
    off = with_factor(found, "C_m", "delta_e", 1.3)
    worse = found.predictions.worse(off, found.completed)
    assert set(worse) == {("b", "C_m")}
    assert not found.predictions.worse(found.completed, off)
    before, after = (
        next(row.r2_after for row in found.predictions.r_squared(each) if (row.log, row.coefficient) == ("b", "C_m"))
        for each in (found.completed, off)
    )
    assert worse["b", "C_m"] == pytest.approx(before - after, rel=1e-6)
    assert before - after > 0.02


def test_an_estimate_is_not_worse_than_itself_or_one_within_the_noise(found: Attribution) -> None:
    assert found.predictions is not None
    near = with_factor(found, "C_m", "alpha", 1.001)
    assert not found.predictions.worse(found.completed, found.completed)
    assert not found.predictions.worse(near, found.completed)
    assert not found.predictions.worse(found.completed, near)
