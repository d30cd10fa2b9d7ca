"""A moment that no effect of the catalogue describes, in calm air: the coefficient equations decide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from problems import LIGHT, NOISE, Problem, declaring, entry, with_channels, with_thrust

from aerosid.aircraft.declared_model import declared_model
from aerosid.compiled.cores import on_cores
from aerosid.flight_model.simulation import fly, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from aerosid.reporting.result_json import result_text

TRUTH = declaring(LIGHT, {("C_X", "alpha^2"): 3.6, ("C_m", "trim_change"): 1.0})
"""Flown; the declared aircraft is the light transport without these two terms."""

WITHOUT_REPORT = LoopSettings(paper_chain=False, next_flight=False, linear_analysis=False)


def random_moment(time: NDArray[np.float64], seed: int, size: float, memory: float = 12.0) -> NDArray[np.float64]:
    """First-order Gauss-Markov process with a standard deviation of `size` and a long memory, s."""
    kept = float(np.exp(-(time[1] - time[0]) / memory))
    white = np.random.default_rng(seed).standard_normal(time.size)
    moment = np.zeros(time.size)
    for k in range(1, time.size):
        moment[k] = kept * moment[k - 1] + size * np.sqrt(1.0 - kept**2) * white[k]
    return moment


def flight(seed: int, amplitude: float) -> FlightLog:
    """A 3-2-1-1 with the slow moment, which is not recorded; a tenth of a degree of elevator has its size."""
    problem = Problem(LIGHT, elevator="3211", amplitude=amplitude, duration=24.0, interval=0.04)
    model = declared_model(TRUTH, problem.airspeed, [parse_term("trim_change")])
    assert LIGHT.density is not None
    level = trim(model, problem.airspeed, LIGHT.density, LIGHT.mass)
    moment = random_moment(problem.time, seed, 0.004)
    log = fly(
        model,
        level,
        problem.time,
        problem.deflection,
        density=LIGHT.density,
        mass=LIGHT.mass,
        noise=NOISE,
        seed=seed,
        further_inputs={"trim_change": moment},
        name=f"flight_{seed}",
    )
    channels = {name: values for name, values in log.channels.items() if name != "trim_change"}
    return with_thrust(
        FlightLog(log.name, log.time, channels, {name: log.units[name] for name in channels}), level.thrust
    )


@pytest.mark.parametrize("seed", [11, pytest.param(21, marks=pytest.mark.slow)])
def test_a_slow_moment_without_a_name_hides_no_term_and_leaves_the_standard_errors_true(seed: int) -> None:
    """The likelihood simulates open loop, integrates the moment and found no term here, or wrong ones, for minutes."""
    result = close_loop([flight(seed, 0.05)], LIGHT, [flight(seed + 1, -0.05)], WITHOUT_REPORT)
    assert result.decided_by == "equations"
    assert result.verdict is Verdict.PARTLY_EXPLAINED
    assert [(e.kind, e.where, e.term) for e in result.effects if e.kind != "gust"] == [("aero_term", "C_X", "alpha^2")]
    assert abs(result.effects[0].value - 3.6) < 4.0 * result.effects[0].std_error
    assert any("no effect of the catalogue describes" in note for note in result.notes)
    assert_derivatives_within_standard_errors(result)


@pytest.mark.slow
def test_equations_begun_beside_the_likelihood_give_the_same_bytes() -> None:
    """Two hypotheses have entered, the model is inadequate still: a second core need not wait for the search's end."""
    logs = [flight(51, 0.05), flight(52, -0.05)]
    alone = close_loop(logs[:1], LIGHT, logs[1:], WITHOUT_REPORT)
    with on_cores(2):
        beside = close_loop(logs[:1], LIGHT, logs[1:], WITHOUT_REPORT)
    assert alone.decided_by == "equations"
    assert result_text(beside) == result_text(alone)


@pytest.mark.parametrize("seed", [pytest.param(n, marks=pytest.mark.slow) for n in (11, 21, 41)])
def test_the_same_without_accelerometers(seed: int) -> None:
    """The likelihood, which alone could decide before, left derivatives 11 standard errors off, in 110 s.

    Of the pairs 11, 21, ... 81 one, 31, is given a step of C_m and a shifted centre of gravity as well.
    """
    logs = [with_channels(flight(seed + n, size), a_x=None, a_z=None) for n, size in enumerate((0.05, -0.05))]
    result = close_loop(logs[:1], LIGHT, logs[1:], WITHOUT_REPORT)
    assert result.decided_by == "equations"
    assert any("Without accelerometers" in note for note in result.notes)
    # The power of alpha is not determined at this precision: a third or the square, and nothing else.
    named = {(e.kind, e.where, e.term) for e in result.effects}
    assert named <= {("aero_term", "C_X", "alpha^2"), ("aero_term", "C_X", "alpha^3")}
    assert_derivatives_within_standard_errors(result, of=("C_Z", "C_m"))


def assert_derivatives_within_standard_errors(result: ClosedLoop, of: tuple[str, ...] = ("C_X", "C_Z", "C_m")) -> None:
    declared = {(d.coefficient, d.term): d.value for d in LIGHT.derivatives}
    for row in result.derivatives:
        term = entry(row.coefficient, row.term)
        if row.term != "1" and row.coefficient in of and term in declared:
            # Seven derivatives of two flights within 4.5: one false alarm in 10,000.
            assert abs(row.value - declared[term]) < 4.5 * row.std_error, (row.coefficient, row.term)


def test_without_the_moment_the_likelihood_decides() -> None:
    problem = Problem(LIGHT, {("C_X", "alpha^2"): 3.6}, elevator="3211", amplitude=0.05, duration=12.0)
    log, other = problem.fly(3, "a"), replace(problem, amplitude=-0.05).fly(4, "b")
    result = close_loop([log], LIGHT, [other], WITHOUT_REPORT)
    assert (result.decided_by, result.verdict) == ("likelihood", Verdict.EXPLAINED)
