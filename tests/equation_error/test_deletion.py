"""Structures with one effect deleted against separate regressions, and on any number of cores."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, identified

from aerosid.compiled.cores import on_cores
from aerosid.compiled.replicas import replicated
from aerosid.equation_error.regression.estimate import CLOSE, estimate, maximise_likelihood
from aerosid.equation_error.selection.structure import STEPS, deletions, point_without, structure_without
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
        point, weights = point_without(found.point, each), found.solution.weights
        alone = maximise_likelihood(found.problem, point, weights, STEPS, near=found).estimate
        assert peak.log_likelihood == alone.log_likelihood
        unaided = estimate(found.problem, point, weights, STEPS)
        assert peak.log_likelihood == pytest.approx(unaided.log_likelihood, abs=CLOSE)
        assert peak.estimate.solution.covariance.tobytes() == alone.solution.covariance.tobytes()
        assert structure_without(selected, each).estimate.solution.values.tobytes() == alone.solution.values.tobytes()


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
