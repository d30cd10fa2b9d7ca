"""Structures with one effect deleted against separate regressions, and on any number of cores."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, frames_of, identified

from aerosid.compiled.cores import on_cores
from aerosid.compiled.replicas import replicated
from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_lag
from aerosid.effects.step_change import step_change
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import CLOSE, estimate, maximise_likelihood
from aerosid.equation_error.selection.structure import STEPS, deletions, point_without, structure_without
from aerosid.flight_model.terms import parse_term
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 7500
"""Of tests; published tables and trials begin elsewhere."""

BODY = BODIES[2]
WRONG = Wrong(bias={"q": 0.01, "theta": 0.02}, terms={("C_m", "alpha^2"): -2.0})
AIRCRAFT = aircraft_of(BODY, 0.08, np.random.default_rng(SEEDS))
LOGS = [flown(name, BODY, SEEDS + n, air=0.2, wrong=WRONG, seconds=20.0) for n, name in enumerate("ab")]


def test_deletion_matches_a_separate_estimate() -> None:
    selected = identified(AIRCRAFT, LOGS[:1], LOGS[1:]).selected
    found = selected.estimate
    assert {each.hypothesis.label for each in selected.chosen} >= {("sensor_bias", "q", "")}
    with on_cores(2):
        rest = deletions(replace(selected, cache={}), selected.chosen, with_columns=True)
    for peak, each in zip(rest, selected.chosen, strict=True):
        point, weights = point_without(found.point, each.hypothesis), found.solution.weights
        alone = maximise_likelihood(found.problem, point, weights, STEPS, near=found).estimate
        assert peak.log_likelihood == alone.log_likelihood
        unaided = estimate(found.problem, point, weights, STEPS)
        assert peak.log_likelihood == pytest.approx(unaided.log_likelihood, abs=CLOSE)
        assert peak.estimate.solution.covariance.tobytes() == alone.solution.covariance.tobytes()
        assert structure_without(selected, each).estimate.solution.values.tobytes() == alone.solution.values.tobytes()


@pytest.mark.parametrize("number", [0, 2])
def test_columns_kept_from_the_whole_structure_cost_little_likelihood(number: int) -> None:
    """A term, a step and a lag of the elevator deleted in turn from the coefficients of two flights."""
    body, term = BODIES[number], ("C_m", parse_term("alpha^2"))
    wrong = Wrong(terms={("C_m", "alpha^2"): -4.0}, elevator_delay=0.12)
    logs = [flown(name, body, SEEDS + 100 + n, air=0.2, wrong=wrong, seconds=20.0) for n, name in enumerate("ab")]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    model, whole, _ = frames_of(aircraft, logs[:1], logs[1:], [term])
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives)
    step = ActiveEffect(step_change("C_m", 8.0, 0.04), (8.0, 2e-3), "a")
    acting = (step, ActiveEffect(control_lag("delta_e"), (0.05,)))
    found = estimate(whole, Point(model.extended([term]), (*free, term), ()).with_effects(acting))
    point, weights = found.point, found.solution.weights
    for reduced in (
        replace(point, model=point.model.without({term}), free=free),
        replace(point, effects=point.effects[1:]),
        replace(point, effects=point.effects[:1]),
    ):
        kept = maximise_likelihood(whole, reduced, weights, STEPS, near=found, keep_near=True)
        once = maximise_likelihood(whole, reduced, weights, STEPS, near=found)
        assert kept.log_likelihood > once.log_likelihood - 4.0 * CLOSE


def test_the_decision_does_not_depend_on_the_number_of_cores() -> None:
    """Neither where each piece of work is done by copies made for it, nor where replicas find it together."""
    alone = decided(AIRCRAFT, LOGS[:1], LOGS[1:])
    assert len(alone.findings) >= 2
    with on_cores(2):
        found = [decided(AIRCRAFT, LOGS[:1], LOGS[1:]), replicated(lambda: decided(AIRCRAFT, LOGS[:1], LOGS[1:]))]
    for shared in found:
        for one, other in ((alone.findings, shared.findings), (alone.alternatives, shared.alternatives)):
            rows, again = (
                [(row.hypothesis.label, row.value, row.std_error, row.gain) for row in each] for each in (one, other)
            )
            assert rows == again
        assert alone.covariance.tobytes() == shared.covariance.tobytes()
