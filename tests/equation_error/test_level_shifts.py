"""Step changes of validation flights: estimated with the structure, no finding, and masking no effect."""

from pathlib import Path

import numpy as np
import pytest
from equations_decided import decided, declared, questioned
from problems import with_channels

from aerosid.aircraft import load_aircraft
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.level_shifts import (
    as_hypotheses,
    level_shifts,
    shift_columns,
    shifts_of,
    shifts_of_further,
)
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.starting_values import step_change_hypotheses
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST, written
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SINGLE = BODIES[0]
MOMENT, STEP = 11.0, 0.4
"""s, m/s^2."""


def with_step(log: FlightLog) -> FlightLog:
    """The log with a step of the axial acceleration, as by a sudden change of drag."""
    return with_channels(log, a_x=log["a_x"] + STEP * (log.time >= MOMENT))


def test_a_level_shift_of_a_validation_flight_is_found_there_only() -> None:
    aircraft = aircraft_of(SINGLE, 0.08, np.random.default_rng(5300))
    one, two = (flown(name, SINGLE, 5300 + n, air=0.3, seconds=24.0) for n, name in enumerate(("one", "two")))
    base = declared(aircraft, [one], [with_step(two)])
    whole = estimate(
        RegressionProblem(base.problem.recordings, COEFFICIENT, base.problem.settings, all_fitted=True), base.point
    )
    found = level_shifts(
        whole, ("C_X", "C_Z", "C_m"), SelectionCriterion({("step_change", "C_X", ""): 1.0}, 1000, 0.01), 4
    )
    (shift,) = shifts_of(found)
    assert (shift.effect.where, shift.log) == ("C_X", "two")
    force = 0.5 * SINGLE.density * SINGLE.airspeed**2 * SINGLE.wing_area
    assert shift.values[0] == pytest.approx(STEP * SINGLE.mass / force, rel=0.15)
    assert shift.values[1] == pytest.approx(MOMENT, abs=0.1)
    ((place, equation),) = shift_columns(found)
    assert (found.problem.recordings[place].name, equation) == ("two", "C_X")
    alone = estimate(base.problem, found.point)
    assert shifts_of(alone) == ()
    np.testing.assert_allclose(alone.solution.values, base.solution.values, rtol=1e-6, atol=1e-9)


def test_each_shift_is_charged_as_when_it_entered_and_a_short_flight_has_none() -> None:
    aircraft = aircraft_of(SINGLE, 0.08, np.random.default_rng(5310))
    one, two = (flown(name, SINGLE, 5310 + n, air=0.3, seconds=24.0) for n, name in enumerate(("one", "two")))
    steps = STEP * np.searchsorted([5.0, MOMENT, 17.0], two.time, side="right")
    base = declared(aircraft, [one], [with_channels(two, a_x=two["a_x"] + steps)])
    found = estimate(
        RegressionProblem(base.problem.recordings, COEFFICIENT, base.problem.settings, all_fitted=True), base.point
    )
    criterion = SelectionCriterion({("step_change", "C_X", ""): 1.0}, 1000, 0.01)
    charged = []
    for _ in range(3):
        hypotheses = step_change_hypotheses(found.problem, found, ("C_X",), "two")
        hypothesis = next(h for h in hypotheses if (h.kind, h.where) == ("step_change", "C_X"))
        charged.append(criterion.penalty(hypothesis))
        found = estimate(found.problem, with_hypothesis(found.point, hypothesis), steps=0)
    assert len(set(charged)) == 3  # one after the other on the same flight costs more
    assert [criterion.penalty(each) for each in as_hypotheses(found)] == pytest.approx(charged)

    _, short = questioned(aircraft, two.between(0.0, 0.7))
    assert shifts_of_further(found, [short], ("C_X",), criterion) == {}


@pytest.mark.slow
def test_a_level_shift_of_a_validation_flight_masks_no_term(tmp_path: Path) -> None:
    """C_m steps on either flight; that of the validation flight masked alphadot, and C_m_q was 16 errors off."""
    at, (step, _, downwash), _ = written(tmp_path, [FIRST, 102, 21], 21)
    aircraft = load_aircraft(tmp_path / "aircraft.toml")
    found = decided(aircraft, [read_log(tmp_path / "identification.csv")], [read_log(tmp_path / "validation.csv")])
    named = {row.hypothesis.label for row in (*found.findings, *found.alternatives)}
    assert {*step.accept, *downwash.accept} <= named
    deviations = np.sqrt(np.diag(found.covariance))
    off = [
        abs(value - at.body.terms["C_m", str(unknown[1][1])]) / error  # type: ignore[index]
        for unknown, value, error in zip(
            found.completed.design.unknowns, found.completed.solution.values, deviations, strict=True
        )
        if unknown[0] == "term" and ("C_m", str(unknown[1][1])) in at.body.terms and unknown[1][0] == "C_m"  # type: ignore[index]
    ]
    assert len(off) == 3
    assert max(off) < 3.0
