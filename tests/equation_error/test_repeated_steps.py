"""Several step changes of one coefficient: on one record, and on several."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, declared
from problems import with_channels

from aerosid.effects.step_input import instant_of, rise_of
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.starting_values import (
    RISES,
    step_change_hypotheses,
    step_changes_in_place_of,
)
from aerosid.logs.flight_log import FlightLog
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SINGLE = BODIES[0]
STEP = 0.4
"""m/s^2."""
CRITERION = SelectionCriterion({("step_change", "C_X", ""): 1.0}, 1000, 0.01)


def with_steps(log: FlightLog, *moments: float) -> FlightLog:
    """The log with steps of the axial acceleration, as by sudden changes of drag."""
    return with_channels(log, a_x=log["a_x"] + STEP * np.sum([log.time >= moment for moment in moments], axis=0))


@pytest.mark.slow
def test_a_coefficient_may_step_on_every_identification_flight() -> None:
    """At an instant of its own; a step of thrust is hardly distinguishable from one of the axial force.

    The motion is flown without the steps, so that their mean is a bias of a_x besides.
    """
    aircraft = aircraft_of(SINGLE, 0.08, np.random.default_rng(5310))
    instants = {"one": 11.0, "two": 16.0, "three": 8.0}
    logs = [
        with_steps(flown(name, SINGLE, 5310 + n, air=0.3, seconds=24.0), moment)
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


@pytest.fixture(scope="module")
def with_first() -> Estimate:
    """The declared structure and the likelier of two steps of C_X."""
    aircraft = aircraft_of(SINGLE, 0.08, np.random.default_rng(5320))
    log = with_steps(flown("one", SINGLE, 5320, air=0.3, seconds=24.0), 8.0, 16.0)
    base = declared(aircraft, [log], [])
    (first, *_) = [h for h in step_change_hypotheses(base.problem, base, ("C_X",)) if h.kind == "step_change"]
    return estimate(base.problem, with_hypothesis(base.point, first), base.solution.weights)


def test_a_second_step_is_searched_for_where_the_form_of_the_first_has_ended(with_first: Estimate) -> None:
    (known,) = with_first.point.effects
    seconds = [h for h in step_change_hypotheses(with_first.problem, with_first, ("C_X",)) if h.kind == "step_change"]
    assert seconds
    assert {h.label for h in seconds} == {("step_change", "C_X", "2")}
    for hypothesis in seconds:
        (active,) = hypothesis.effects
        assert abs(instant_of(active) - instant_of(known)) > rise_of(active) + rise_of(known) + max(RISES)
    instants = sorted([instant_of(known), instant_of(seconds[0].effects[0])])
    assert instants == pytest.approx([8.0, 16.0], abs=0.3)


def test_a_further_step_needs_the_gain_of_all_of_them(with_first: Estimate) -> None:
    """Steps follow any slow residual, given enough of them."""
    problem = with_first.problem
    (second, *_) = [h for h in step_change_hypotheses(problem, with_first, ("C_X",)) if h.kind == "step_change"]
    both = estimate(problem, with_hypothesis(with_first.point, second), with_first.solution.weights)
    first, other = both.point.effects
    assert (first.ordinal, other.ordinal) == (1, 2)
    assert second.repetition == 1
    assert CRITERION.penalty(second) == pytest.approx(2.0 * CRITERION.penalty(replace(second, repetition=0)))


def test_a_step_is_no_alternative_to_itself(with_first: Estimate) -> None:
    """Whatever ordinal it had: of two steps the first may have been eliminated since."""
    problem = with_first.problem
    (second, *_) = [h for h in step_change_hypotheses(problem, with_first, ("C_X",)) if h.kind == "step_change"]
    assert second.effects[0].ordinal == 2
    reduced = replace(with_first, point=with_first.point.with_effects(()))
    offered = step_changes_in_place_of(reduced, second, ("C_X", "C_Z"))
    assert {(h.kind, h.where) for h in offered} == {("thrust_change", "thrust"), ("step_change", "C_Z")}
