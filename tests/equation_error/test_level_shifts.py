"""Step changes of validation flights: estimated with the structure, no finding, and masking no effect."""

from pathlib import Path

import numpy as np
import pytest
from equations_decided import decided, declared

from aerosid.aircraft import load_aircraft
from aerosid.effects.step_input import instant_of, rise_of
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.estimate import RegressionProblem, estimate
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.level_shifts import level_shifts, shift_columns, shifts_of
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.starting_values import step_change_hypotheses
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST, written
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SINGLE = BODIES[0]
MOMENT, STEP = 11.0, 0.4
"""s, m/s^2."""


def with_step(log: FlightLog, moment: float = MOMENT) -> FlightLog:
    """The log with a step of the axial acceleration, as by a sudden change of drag."""
    channels = {name: log[name].copy() for name in log.units}
    channels["a_x"] += STEP * (log.time >= moment)
    return FlightLog(log.name, log.time, channels, dict(log.units))


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


def test_a_coefficient_may_step_on_every_identification_flight() -> None:
    """At an instant of its own; a step of thrust is hardly distinguishable from one of the axial force.

    The motion is flown without the steps, so that their mean is a bias of a_x besides.
    """
    aircraft = aircraft_of(SINGLE, 0.08, np.random.default_rng(5310))
    instants = {"one": 11.0, "two": 16.0, "three": 8.0}
    logs = [
        with_step(flown(name, SINGLE, 5310 + n, air=0.3, seconds=24.0), moment)
        for n, (name, moment) in enumerate(instants.items())
    ]
    found = decided(aircraft, logs, [])
    force = 0.5 * SINGLE.density * SINGLE.airspeed**2 * SINGLE.wing_area
    sizes = {"step_change": STEP * SINGLE.mass / force, "thrust_change": STEP * SINGLE.mass}
    steps = {row.active.log: row for row in found.findings if row.active and row.hypothesis.kind in sizes}
    assert set(steps) == set(instants)
    for log, row in steps.items():
        assert row.active is not None
        assert row.active.values[1] == pytest.approx(instants[log], abs=0.1)
        assert row.value == pytest.approx(sizes[row.hypothesis.kind], rel=0.15)


def test_a_second_step_near_the_first_is_none_of_its_own() -> None:
    """Two near steps would model the form of one: the second is searched for where the first has ended."""
    aircraft = aircraft_of(SINGLE, 0.08, np.random.default_rng(5320))
    log = with_step(flown("one", SINGLE, 5320, air=0.3, seconds=24.0))
    base = declared(aircraft, [log], [])
    (first, *_) = [h for h in step_change_hypotheses(base.problem, base, ("C_X",)) if h.time is None]
    with_first = estimate(base.problem, with_hypothesis(base.point, first), base.solution.weights)
    (known,) = with_first.point.effects
    for hypothesis in step_change_hypotheses(base.problem, with_first, ("C_X",)):
        (active,) = hypothesis.effects
        if active.name == known.name:
            assert hypothesis.label == ("step_change", "C_X", "2")
            assert abs(instant_of(active) - instant_of(known)) > rise_of(active) + rise_of(known)
