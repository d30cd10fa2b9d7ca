"""Residuals against the controls: a dense oracle, false alarms, structures that lack something, the verdict by it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from equations_decided import declared
from numpy.typing import NDArray
from scipy.stats import binom
from scipy.stats import f as variance_ratio

from aerosid.equation_error.equations.instrumental_variables import responses_to_controls, trends_in_band
from aerosid.equation_error.regression.coloured_regression import colour_of
from aerosid.equation_error.regression.design import Weights
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.least_squares import solve
from aerosid.equation_error.selection.control_dependence import (
    DEPENDENCE,
    ControlDependence,
    control_dependence,
    dependent,
)
from aerosid.equation_error.selection.turbulence import may_be_turbulent
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.equation_error_notes import note_on_residuals
from aerosid.loop.identification import identify
from aerosid.loop.verdict import Verdict, judge
from aerosid.search.calm_air import differ
from benchmarks import turbulent_flights
from benchmarks.planted_aircraft import Body
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

Array = NDArray[np.float64]

SEEDS = 9120
"""Of these tests; published tables and trials begin elsewhere."""


def log_of(
    body: Body, seed: int, wrong: Wrong = NOTHING, air: float = 0.6, seconds: float = 25.0, doublets: int = 0
) -> FlightLog:
    """`doublets`: equal ones at equal intervals in place of random steps; none: random steps."""
    if doublets == 0:
        return flown("a", body, SEEDS + seed, air=air, wrong=wrong, seconds=seconds)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(turbulent_flights, "_steps", partial(equal_doublets, doublets=doublets))
        return flown("a", body, SEEDS + seed, air=air, wrong=wrong, seconds=seconds)


def equal_doublets(body: Body, count: int, _generator: np.random.Generator, doublets: int) -> Array:
    """As many doublets of one size as fit into equal parts of a flight of `count` steps, rad, (count,)."""
    size = 0.04 * abs(body.C_m[1] / body.C_m[3])
    phase = (np.arange(count) * doublets / count) % 1.0
    return np.where(phase < 0.2, size, np.where(phase < 0.4, -size, 0.0))


def estimated(body: Body, *logs: FlightLog) -> Estimate:
    """The declared structure's estimate on the logs."""
    return declared(aircraft_of(body, 0.08, np.random.default_rng(SEEDS)), list(logs), [])


def test_it_is_the_f_test_of_a_dense_regression_where_the_residuals_are_white() -> None:
    found = estimated(BODIES[0], log_of(BODIES[0], 1))
    weights = Weights((colour_of(np.ones(1)),) * len(found.design.segments), found.solution.weights.sizes)
    white = replace(found, design=replace(found.design, expected=None))
    white = replace(white, solution=solve(white.design, weights))
    rows = {row.coefficient: row for row in control_dependence(white)}
    fewer = replace(found.problem.settings, laguerre_order=DEPENDENCE.order)
    shifts = np.arange(DEPENDENCE.shifts + 1) / (DEPENDENCE.shifts + 1)
    ((functions, *shifted),) = responses_to_controls(found.problem.recordings, fewer, shifts.tolist())  # type: ignore[misc]
    trends = trends_in_band(found.problem.recordings[0])
    assert functions.shape[1] == 2 * DEPENDENCE.order + 2
    for s, (_, coefficient) in enumerate(white.design.segments):
        samples = white.design.rows(s)
        own = white.design.columns[samples]
        target, known = white.design.target[samples], own[:, np.any(own != 0.0, axis=0)]
        basis, _ = np.linalg.qr(known)
        left = target - basis @ (basis.T @ target)
        beside = np.hstack([basis, new_directions(basis, trends)])
        along = new_directions(beside, functions)
        chance = [new_directions(np.hstack([beside, along]), each) for each in shifted]
        usual = sum(power(each, left) for each in chance) / sum(each.shape[1] for each in chance)
        freedom = target.size - beside.shape[1] - along.shape[1]
        unexplained = float(left @ left) - power(beside, left) - power(along, left)
        variance = max(usual, unexplained / freedom)
        # What shifts every parameter by a share of its value leaves in the residual is as random as the noise.
        shifts = shifted_scores(own, trends, functions, along, DEPENDENCE.attenuation * white.solution.values)
        beyond = variance * np.linalg.solve(variance * np.eye(along.shape[1]) + shifts @ shifts.T, along.T @ left)
        statistic = float(left @ along @ beyond) / along.shape[1] / variance
        assert rows[coefficient].p_value == pytest.approx(
            variance_ratio.sf(statistic, along.shape[1], freedom), rel=0.01
        )
        part = along @ (along.T @ left)
        assert rows[coefficient].share == pytest.approx(float(np.var(part) / np.var(target)), rel=0.01)


def new_directions(basis: Array, functions: Array) -> Array:
    """Orthonormal directions of functions beside a basis, those with hardly any part of their own left out."""
    scaled = functions / np.linalg.norm(functions, axis=0)
    directions, singular, _ = np.linalg.svd(scaled - basis @ (basis.T @ scaled), full_matrices=False)
    return np.asarray(directions[:, singular**2 > 1e-3])


def shifted_scores(own: Array, trends: Array, functions: Array, along: Array, shifts: Array) -> Array:
    """What shifts of the parameters would leave along directions of functions, these not freed of the own columns."""
    columns = np.hstack([own, trends, functions])
    coefficients = np.linalg.lstsq(columns, along, rcond=None)[0]
    beside = columns[:, own.shape[1] :] @ coefficients[own.shape[1] :]
    return np.asarray(beside.T @ (own * shifts))


def power(directions: Array, residual: Array) -> float:
    return float(np.sum((directions.T @ residual) ** 2))


def test_residuals_of_complete_structures_depend_on_the_controls_as_rarely_as_stated() -> None:
    """Eight aircraft in gusts behind a recorder, two flights each: fewer than chance gives once in a thousand."""
    rows = [
        row
        for n, body in enumerate(BODIES)
        for seed in (20, 40)
        for row in control_dependence(estimated(body, log_of(body, seed + n)))
    ]
    assert len(rows) == 3 * 2 * len(BODIES)
    for level in (0.05, 0.3):
        alarms = sum(row.p_value < level for row in rows)
        assert alarms <= binom.ppf(0.999, len(rows), level)
    assert not dependent(rows)


@pytest.mark.parametrize("doublets", [0, 6, 12])
@pytest.mark.parametrize("number", [0, 2, 5])
def test_a_late_elevator_in_gusts_is_seen_in_the_moment(number: int, doublets: int) -> None:
    """Also where equal doublets follow one another, so that controls shifted along the record are the same again."""
    body = BODIES[number]
    late = log_of(body, 60 + number, Wrong(elevator_delay=0.1), seconds=36.0, doublets=doublets)
    assert "C_m" in {row.coefficient for row in dependent(control_dependence(estimated(body, late)))}


def test_a_drift_is_no_dependence_and_hides_none() -> None:
    """A parabola in the normal acceleration, ten times the noise, with and without a term that is missing."""
    body, missing = BODIES[2], Wrong(terms={("C_Z", "alpha^2"): 12.0})
    for wrong, seen in ((NOTHING, False), (missing, True)):
        log = log_of(body, 85, wrong, air=0.2)
        drift = 0.5 * np.linspace(-1.0, 1.0, log.time.size) ** 2
        drifting = replace(log, channels={**log.channels, "a_z": log["a_z"] + drift})
        plain, other = (
            next(row for row in control_dependence(estimated(body, each)) if row.coefficient == "C_Z")
            for each in (log, drifting)
        )
        assert (other in dependent([other])) is seen
        assert (plain in dependent([plain])) is seen
        assert other.share == pytest.approx(plain.share, rel=0.5, abs=5e-4)


def test_what_is_even_in_the_motion_is_seen_by_the_squares() -> None:
    """A moment by the square of the angle of attack answers doublets to either side alike: no linear function does."""
    body = BODIES[0]
    found = estimated(body, log_of(body, 80, Wrong(terms={("C_m", "alpha^2"): 6.0}), air=0.2))
    (row,) = dependent(control_dependence(found))
    assert row.coefficient == "C_m"
    assert row.share > 0.01


def test_the_air_is_in_doubt_in_the_lightest_turbulence_and_rarely_in_calm_air() -> None:
    """Two standard errors of the response to gusts: one calm flight in forty by chance, here one in twenty at most."""
    moving, calm = (
        sum(may_be_turbulent(estimated(body, log_of(body, 200 + n, air=air))) for n, body in enumerate(BODIES))
        for air in (0.15, 0.0)
    )
    assert moving == len(BODIES)
    assert calm <= binom.ppf(0.999, len(BODIES), 0.05)


def test_what_noise_in_the_motion_takes_from_the_derivatives_is_no_dependence() -> None:
    """Functions of the controls are without noise, and would stand in for the noisy angle of attack."""
    body, generator = BODIES[3], np.random.default_rng(SEEDS)
    log = log_of(body, 95, air=0.0, seconds=60.0)
    noisy = log["alpha"] + 0.15 * float(np.std(log["alpha"])) * generator.standard_normal(log.time.size)
    found = estimated(body, replace(log, channels={**log.channels, "alpha": noisy}))
    rows = control_dependence(found)
    assert not dependent(rows)


def test_too_few_samples_and_resting_controls_are_not_tested() -> None:
    body = BODIES[0]
    log = log_of(body, 90)
    assert control_dependence(estimated(body, log))
    resting = replace(log, channels={**log.channels, "delta_e": np.full(log.time.size, float(log["delta_e"][0]))})
    assert not control_dependence(estimated(body, resting))
    assert not control_dependence(estimated(body, log.between(float(log.time[0]), float(log.time[0]) + 4.0)))


def test_turbulence_behind_a_recorder_is_no_residual_and_a_dependence_on_the_controls_is() -> None:
    """Innovations and open-loop errors there are coloured by the recorder, whatever the model."""
    body = BODIES[1]
    logs = [log_of(body, seed) for seed in (101, 102)]
    identified = identify(logs[:1], aircraft_of(body, 0.08, np.random.default_rng(SEEDS)), logs[1:])
    found = identified.found
    assert found is not None
    assert [finding.kind for finding in found.findings] == ["gust"]
    assert found.noise_hidden
    assert found.dependence
    assert {row.recording for row in found.dependence} == {each.name for each in identified.manoeuvres} | {
        each.name for each in identified.validation
    }
    judged = judge(found, identified.manoeuvres, identified.validation)
    assert judged == (Verdict.EXPLAINED, False)
    lacking = replace(found, dependence=(*found.dependence, ControlDependence("a", "C_m", 1e-6, 0.05)))
    assert judge(lacking, identified.manoeuvres, identified.validation) == (Verdict.PARTLY_EXPLAINED, True)
    told = (
        note_on_residuals(found),
        note_on_residuals(lacking),
        note_on_residuals(replace(found, dependence=None)),
    )
    assert "none does significantly and by 0.3 % of its variance (least p-value" in told[0]
    assert "C_m of a (p-value 1.0·10⁻⁶, 5.0 % of its variance)" in told[1]
    assert "is part of the innovations" in told[2]


@pytest.mark.parametrize("wrong", [NOTHING, Wrong(elevator_delay=0.1)], ids=["complete", "late"])
def test_gusts_too_small_to_be_identified_are_no_residual_where_the_noise_is_known(wrong: Wrong) -> None:
    """They are in every open-loop error; a height recorded without a filter says that the noise of the log is known."""
    body = BODIES[4]
    logs = [with_unfiltered_height(log_of(body, seed, wrong, air=0.1), seed) for seed in (340, 341)]
    identified = identify(logs[:1], aircraft_of(body, 0.08, np.random.default_rng(SEEDS)), logs[1:])
    found = identified.found
    assert found is not None
    assert not found.noise_hidden
    if wrong is NOTHING:
        assert found.dependence is not None
        assert judge(found, identified.manoeuvres, identified.validation) == (Verdict.NOTHING_MISSING, False)
        assert "suggest gusts, too small to be identified" in note_on_residuals(found)
    else:
        assert [(row.kind, row.where) for row in found.findings] == [("control_delay", "delta_e")]


@pytest.mark.parametrize("errors", [2.0, 6.0])
def test_two_estimates_differ_by_standard_errors_of_both(errors: float) -> None:
    body = BODIES[1]
    found = identify([log_of(body, 101)], aircraft_of(body, 0.08, np.random.default_rng(SEEDS))).found
    assert found is not None
    free, model = found.completed.free, found.completed.model
    place = free.index(("C_m", parse_term("alpha")))
    values = np.array([model.value(entry) for entry in model.entries])
    values[model.index(free[place])] += errors * found.completed_deviations.published[place]
    other = replace(found, completed=replace(found.completed, model=model.with_values(values)))
    # Two estimates of one size of error: root two of each.
    assert differ(other, found, 3.0) is (errors > 3.0 * 1.415)


def with_unfiltered_height(log: FlightLog, seed: int) -> FlightLog:
    """The log with white noise of 1.5 m in its height."""
    noise = 1.5 * np.random.default_rng(seed).standard_normal(log.time.size)
    return replace(log, channels={**log.channels, "h": log["h"] + noise})
