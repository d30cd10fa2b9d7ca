"""A bias of the airspeed that kinematics and coefficients show together, against the joint likelihood on a grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from equations_decided import decided, identified
from numpy.testing import assert_allclose

from aerosid.effects import frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.related_problems import coefficients_of_all
from aerosid.equation_error.selection.candidates import distinct_name, is_instrument_error, with_hypothesis
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.kinematic_evidence import kinematic_evidence
from benchmarks.planted_aircraft import Body
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 655_000
"""Of these flights."""

LABEL = ("sensor_bias", "V", "")


class Flown(NamedTuple):
    body: Body
    bias: float
    errors: InstrumentErrors
    decision: EquationErrorDecision


def flights(seed: int, body: Body, size: float) -> Flown:
    """Two flights of an aircraft in gusts whose airspeed is off by a part of its usual value."""
    aircraft = aircraft_of(body, 0.05, np.random.default_rng(SEEDS + seed))
    bias = size * body.airspeed
    one, two = (
        flown(name, body, SEEDS + 10 * seed + n, air=0.5, wrong=Wrong(bias={"V": bias}))
        for n, name in enumerate(("one", "two"))
    )
    return Flown(body, bias, identified(aircraft, [one], [two]), decided(aircraft, [one], [two]))


@pytest.fixture(scope="module", params=[0, pytest.param(2, marks=pytest.mark.slow)])
def named(request: pytest.FixtureRequest) -> Flown:
    """An airspeed six per cent off, which neither kinematics nor one flight's coefficients show by themselves."""
    return flights(24 + request.param, BODIES[request.param], 0.06)


def test_it_is_named_from_both_and_the_derivatives_are_right(named: Flown) -> None:
    (row,) = named.decision.findings
    assert row.hypothesis.label == LABEL
    assert abs(row.value - named.bias) < 3.0 * row.std_error
    seen = named.decision.joint_evidence[LABEL]
    assert row.std_error < np.sqrt(seen.covariance[0, 0])
    deviations, values = np.sqrt(np.diag(named.decision.covariance)), named.decision.completed.solution.values
    for n, unknown in enumerate(named.decision.completed.design.unknowns):
        if unknown[0] == "term" and unknown[1][1].factors:  # type: ignore[index]
            true = named.body.terms[unknown[1][0], str(unknown[1][1])]  # type: ignore[index]
            assert abs(values[n] - true) < 3.0 * deviations[n]


def test_the_kinematic_evidence_is_the_maximum_of_the_kinematics(named: Flown) -> None:
    """Whatever the limits of usable instruments: beyond them too it may agree with a value within."""
    errors = named.errors
    sensors = [h for h in errors.hypotheses if is_instrument_error(h)]
    seen = kinematic_evidence(errors.selected, sensors)[distinct_name(bias_of(errors))]
    peak, error = maximum(kinematics(errors), float(np.sqrt(seen.covariance[0, 0])), seen.values[0])
    assert abs(seen.values[0] - peak) < 0.5 * error
    assert_allclose(np.sqrt(seen.covariance[0, 0]), error, rtol=0.3)


def test_its_value_is_the_maximum_of_the_joint_likelihood(named: Flown) -> None:
    errors, (row,) = named.errors, named.decision.findings
    base = errors.selected.estimate
    problem = coefficients_of_all(base.problem.recordings, base.problem.settings, errors.start.model)

    def joint(value: float) -> float:
        point = replace(errors.start, effects=(held(errors, value).effects[0],))
        return kinematics(errors)(value) + estimate(problem, point).log_likelihood

    peak, error = maximum(joint, row.std_error, row.value)
    assert abs(row.value - peak) < 0.5 * error
    assert_allclose(row.std_error, error, rtol=0.3)


def bias_of(errors: InstrumentErrors) -> Hypothesis:
    (bias,) = (h for h in errors.hypotheses if h.label == LABEL)
    return bias


def held(errors: InstrumentErrors, value: float) -> Hypothesis:
    bias = bias_of(errors)
    return replace(bias, effects=(frozen(replace(bias.effects[0], values=(value,))),))


def kinematics(errors: InstrumentErrors) -> Callable[[float], float]:
    """Ln L of the kinematic equations by the value of the bias."""
    base = errors.selected.estimate
    return lambda value: estimate(base.problem, with_hypothesis(base.point, held(errors, value))).log_likelihood


def maximum(likelihood: Callable[[float], float], width: float, middle: float) -> tuple[float, float]:
    """Maximum of a parabola through ln L on a grid, and the standard error by its curvature."""
    grid = middle + width * np.linspace(-1.5, 1.5, 7)
    square, linear, _ = np.polyfit(grid, [likelihood(float(value)) for value in grid], 2)
    return float(-0.5 * linear / square), float(np.sqrt(-0.5 / square))


def test_without_a_bias_none_is_named() -> None:
    found = flights(40, BODIES[4], 0.0)
    assert not [row for row in found.decision.findings if row.hypothesis.where == "V"]
