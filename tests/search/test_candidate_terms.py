"""Candidate terms: inputs that the logs excite and no response of the aircraft; findings of simulated terms."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray
from problems import LIGHT, NOISE, Problem, Truth, with_channels

from aerosid.effects.aerodynamic_terms import searched_parameters
from aerosid.flight_model.simulation import fly, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings, Method
from aerosid.loop.verdict import Verdict
from aerosid.search.candidate_terms import candidate_entries

Array = NDArray[np.float64]


def flown(
    undeclared: Truth,
    channels: Mapping[str, Callable[[Array], Array]] | None = None,
    duration: float = 14.1,
    seed: int = 3,
) -> FlightLog:
    """A flight with undeclared terms, and further channels as recorded without noise."""
    problem = Problem(undeclared=undeclared, duration=duration, elevator="3211", amplitude=-0.045)
    model, held = problem.truth, {name: make(problem.time) for name, make in (channels or {}).items()}
    level = trim(model, 100.0, LIGHT.density, LIGHT.mass)
    body = {"density": LIGHT.density, "mass": LIGHT.mass, "noise": NOISE, "seed": seed, "name": f"flight {seed}"}
    driving = {name: values for name, values in held.items() if name in model.columns}
    log = fly(model, level, problem.time, problem.deflection, further_inputs=driving, **body)
    return with_channels(log, thrust=np.full(problem.time.size, level.thrust), **held)


def trimming(time: Array) -> Array:
    return 0.03 * np.clip((time - 5.0) / 4.0, 0.0, 1.0)


def asked(*logs: FlightLog) -> set[tuple[str, str]]:
    return {(coefficient, str(term)) for coefficient, term in candidate_entries(LIGHT, logs)}


def test_channels_that_vary_are_candidates_in_every_coefficient() -> None:
    log = flown(
        {}, {"delta_h": trimming, "speed_brake": lambda t: 1.0 * (t > 6.0), "delta_f": lambda t: 0.2 + 0.0 * t}, 9
    )
    names = asked(log)
    for coefficient in LIGHT.coefficients:
        assert {(coefficient, "delta_h"), (coefficient, "speed_brake")} <= names
        assert (coefficient, "delta_f") not in names  # it does not vary
        assert (coefficient, "C_T") not in names  # thrust is constant
    assert ("C_m", "delta_h") not in asked(log, with_channels(log, delta_h=None))


def test_a_response_of_the_aircraft_is_no_input() -> None:
    log = flown({}, duration=9.0)
    noise = np.random.default_rng(0).standard_normal((2, log.time.size))
    answers = {"n_z": -log["a_z"] / 9.81 + 0.01 * noise[0], "gamma": log["theta"] - log["alpha"]}
    named = {
        name
        for _, term in candidate_entries(LIGHT, [with_channels(log, hiss=noise[1], **answers)])
        for name in term.variables
    }
    assert not named & {"n_z", "gamma", "hiss"}


def test_thrust_and_mach_are_candidates_where_they_vary() -> None:
    log = flown({}, duration=9.0)
    swinging = with_channels(log, thrust=log["thrust"] * (1.0 + 0.2 * np.sin(log.time)), mach=log["V"] / 340.0)
    assert {("C_X", "C_T"), ("C_m", "C_T"), ("C_Z", "mach"), ("C_m", "alpha*mach")} <= asked(swinging)
    assert not {("C_X", "C_T"), ("C_Z", "mach")} & asked(log)
    steady = with_channels(log, mach=np.full(log.time.size, 0.3))
    assert ("C_Z", "mach") not in asked(steady)


def test_knots_lie_inside_the_flown_range() -> None:
    log = flown({}, duration=9.0)
    terms = {term for coefficient, term in candidate_entries(LIGHT, [log]) if coefficient == "C_m"}
    knots = {factor.offset for term in terms for factor in term.factors if searched_parameters(term)}
    assert len(knots) == 3
    assert log["alpha"].min() < min(knots) < max(knots) < log["alpha"].max()
    assert all(knot == pytest.approx(round(knot, 2), abs=1e-12) for knot in knots)
    still = with_channels(log, alpha=0.02 + 0.001 * np.sin(log.time))
    assert not any(map(searched_parameters, (term for _, term in candidate_entries(LIGHT, [still]))))
    assert searched_parameters(parse_term("pos(alpha - 0.1)^2*delta_e")) == 1
    assert searched_parameters(parse_term("pos(alpha)*abs(delta_e)")) == 0


def test_a_recorded_trim_is_named_as_the_channel_it_is() -> None:
    result = close_loop([flown({("C_m", "delta_h"): -1.0}, {"delta_h": trimming})], LIGHT)
    assert [(effect.kind, effect.where, effect.term) for effect in result.effects] == [("aero_term", "C_m", "delta_h")]
    assert result.verdict is Verdict.EXPLAINED
    assert abs(result.effects[0].value + 1.0) < 4.0 * result.effects[0].std_error


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coefficient", "text", "value"),
    [("C_X", "speed_brake", -0.04), ("C_Z", "delta_f", -0.6), ("C_m", "pos(alpha - 0.05)", -0.6)],
)
def test_planted_terms_are_named(coefficient: str, text: str, value: float) -> None:
    moving = {
        "speed_brake": lambda t: 1.0 * ((t > 5.0) & (t < 9.0)),
        "delta_f": lambda t: 0.2 * np.clip((t - 4.0) / 2.0, 0, 1),
    }
    result = close_loop([flown({(coefficient, text): value}, {k: v for k, v in moving.items() if k == text})], LIGHT)
    first = result.effects[0]
    assert (first.kind, first.where) == ("aero_term", coefficient)
    if "pos" in text:
        assert first.term.startswith("pos(alpha")
    else:
        assert first.term == text
        assert abs(first.value - value) < 4.0 * first.std_error
    assert len(result.effects) == 1


@pytest.mark.slow
def test_indistinguishable_terms_are_not_both_named() -> None:
    """For an elevator of three levels its square and its cube are linearly dependent."""
    result = close_loop([flown({("C_m", "delta_e^2"): 6.0})], LIGHT)
    assert len(result.effects) == 1
    told = {(effect.where, effect.term) for effect in (*result.effects, *result.alternatives)}
    assert {("C_m", "delta_e^2")} <= told


def test_attitude_is_a_candidate_of_the_pitching_moment_where_it_is_recorded_and_varies() -> None:
    log = flown({}, duration=9.0)
    turning = with_channels(log, phi=0.3 * np.sin(log.time))
    assert float(np.ptp(log["theta"])) > 0.1
    assert {name for name in asked(turning) if name[1] in ("theta", "phi")} == {("C_m", "theta"), ("C_m", "phi")}
    assert {name for name in asked(log) if name[1] in ("theta", "phi")} == {("C_m", "theta")}
    level = with_channels(log, theta=0.02 + 0.001 * np.sin(log.time))
    assert ("C_m", "theta") not in asked(level)


@pytest.mark.parametrize("method", ["equations", "likelihood"])
def test_a_moment_due_to_pitch_attitude_is_named_and_not_imitated_by_slow_terms(method: Method) -> None:
    logs = [flown({("C_m", "theta"): 0.012}, duration=24.0, seed=seed) for seed in (1, 2)]
    settings = LoopSettings(method=method, paper_chain=False, second_opinion=False, next_flight=False)
    result = close_loop(logs[:1], LIGHT, logs[1:], settings=settings)
    assert [(effect.kind, effect.where, effect.term) for effect in result.effects] == [("aero_term", "C_m", "theta")]
    assert abs(result.effects[0].value - 0.012) < 4.0 * result.effects[0].std_error
