"""Rotary gusts: their closed form, and flights of simulators that share no code with the package."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, declared
from numpy.testing import assert_allclose

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.effects import KINDS, ActiveEffect, frozen
from aerosid.equation_error.equations.gust_response import expected_rotary_responses
from aerosid.equation_error.equations.rotary_gust import rotary_gust
from aerosid.equation_error.regression.estimate import Estimate, effect_sensitivities, estimate, linear_values
from aerosid.equation_error.regression.least_squares import solve
from aerosid.equation_error.selection.coefficient_information import information_on
from aerosid.equation_error.selection.control_dependence import control_dependence
from aerosid.equation_error.selection.rotary_gusts import with_rotary_gusts
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from benchmarks import sideways_flights as sideways
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

SINGLE = BODIES[0]
MOMENT = ("alpha", "q_hat", "delta_e")


def pair(
    seed: int, air: float, *, rotary: bool, wrong: Wrong = NOTHING
) -> tuple[Aircraft, list[FlightLog], list[FlightLog]]:
    """Two flights of the light single, the first to identify."""
    logs = [flown(f"flight {n}", SINGLE, seed + n, air=air, wrong=wrong, rotary=rotary) for n in range(2)]
    return aircraft_of(SINGLE, 0.08, np.random.default_rng(seed)), logs[:1], logs[1:]


def side_pair(seed: int, *, rotary: bool) -> tuple[Aircraft, list[FlightLog], list[FlightLog]]:
    """The same of the unmanned aircraft in lateral motion and side gusts."""
    body = sideways.BODIES[2]
    logs = [
        sideways.flown(f"flight {n}", body, seed + n, gust=0.6, interval=0.02, seconds=24.0, rotary=rotary)
        for n in range(2)
    ]
    return sideways.aircraft_of(body, 0.08, np.random.default_rng(seed)), logs[:1], logs[1:]


@pytest.mark.parametrize(("vane", "spans", "sense"), [("alpha", 4.0, -1.0), ("beta", 3.0, 1.0)])
def test_a_sinusoidal_gust_has_the_rate_behind_its_average(vane: str, spans: float, sense: float) -> None:
    constants = declared_model(aircraft_of(SINGLE, 0.0, np.random.default_rng(0)), 55.0).constants
    assert constants.span == 0.0
    span, interval, omega = constants.wing_area / constants.mean_chord, 0.01, 3.0
    length = constants.mean_chord if vane == "alpha" else span
    time = interval * np.arange(4000)
    found = rotary_gust(0.01 * np.exp(1j * omega * time).real, vane, 55.0, interval, constants)
    average = 1.0 / (1.0 + 1j * omega * spans * span / (math.pi * 55.0))
    expected = (sense * length / 110.0 * 0.01 * 1j * omega * average * np.exp(1j * omega * time)).real
    settled = slice(1000, -100)
    assert_allclose(found[settled], expected[settled], atol=2e-3 * np.abs(expected).max())


def test_the_expected_response_is_half_the_damping() -> None:
    model = declared_model(aircraft_of(SINGLE, 0.0, np.random.default_rng(0)), 55.0)
    damping = ("C_m", parse_term("q_hat"))
    (expected,) = expected_rotary_responses(model).values()
    assert expected.derivatives == {damping: (0.5, model.value(damping))}
    assert expected.deviation == pytest.approx(-0.5 * model.value(damping))


@pytest.mark.parametrize(("air", "rotary", "shown"), [(0.8, True, ("alpha",)), (0.8, False, ()), (0.0, False, ())])
def test_they_are_regressors_where_the_moment_responds_to_them(air: float, rotary: bool, shown: tuple[str]) -> None:
    found = with_rotary_gusts(declared(*pair(9100, air, rotary=rotary)))
    assert found.problem.rotary_gusts == shown
    if shown:
        response = found.value(("rotary_gust", "C_m"))
        assert response == pytest.approx(SINGLE.terms["C_m", "q_hat"], rel=0.3)


@pytest.mark.slow
def test_without_them_a_late_elevator_is_half_as_late_and_the_moment_too_small() -> None:
    aircraft, logs, others = pair(9200, 0.8, rotary=True, wrong=Wrong(elevator_delay=0.12))
    found = decided(aircraft, logs, others)
    (late,) = [each for each in found.findings if each.hypothesis.effects[0].effect.where == "delta_e"]
    assert late.value == pytest.approx(0.12, abs=max(0.02, 3.0 * late.std_error))
    model = found.completed.point.model
    for term in MOMENT:
        assert model.value(("C_m", parse_term(term))) == pytest.approx(SINGLE.terms["C_m", term], rel=0.15)
    plain = replace(found.completed.problem, rotary_gusts=())
    before = estimate(plain, found.before.point).point.model
    assert abs(before.value(("C_m", parse_term("delta_e")))) < 0.8 * abs(SINGLE.terms["C_m", "delta_e"])


def test_rolling_moments_are_compared_by_instruments_where_yaw_shows_rotary_gusts() -> None:
    body = sideways.BODIES[2]
    plain = declared(*side_pair(9300, rotary=True))
    found = with_rotary_gusts(plain)
    assert found.problem.rotary_gusts == ("beta",)
    for s, (_, equation) in enumerate(found.design.segments):
        assert (found.design.instruments[s] is not None) == (equation in ("C_l", "C_n"))
    for term in ("beta", "p_hat", "delta_a"):
        entry, truth = ("C_l", parse_term(term)), body.terms["C_l", term]
        off, before = (abs(each.point.model.value(entry) / truth - 1.0) for each in (found, plain))
        assert off < 0.5 * before
    calm = with_rotary_gusts(declared(*side_pair(9300, rotary=False)))
    assert calm.problem.rotary_gusts == ()


@pytest.mark.parametrize("seed", [41010, 41020, 41060])
def test_where_instruments_compare_a_moment_its_residual_is_tested_in_their_space(seed: int) -> None:
    """Nothing is missing; with the residual itself C_l of seed 41020 depended on the controls with p = 4e-8."""
    found = with_rotary_gusts(declared(*side_pair(seed, rotary=True)))
    names = [equation for _, equation in found.design.segments]
    assert found.design.instruments[names.index("C_l")] is not None
    assert min(row.p_value for row in control_dependence(found)) > 1e-3


@pytest.mark.parametrize("where", ["beta", "p"])
def test_where_instruments_compare_a_moment_a_delay_is_led_to_the_maximum_of_its_likelihood(where: str) -> None:
    """By the score and the information of its column, the linear unknowns eliminated; ln L by whole estimates."""
    found = with_rotary_gusts(declared(*side_pair(9300, rotary=True)))
    late, place = KINDS["sensor_delay"].made(where, {"delay": 0.02}, 0.02), len(found.point.effects)

    def at(delay: float) -> Estimate:
        effects = (*found.point.effects, frozen(ActiveEffect(late, (delay,))))
        return estimate(found.problem, found.point.with_effects(effects), found.solution.weights, steps=0)

    def likelihood(delay: float) -> float:
        return solve(at(delay).design, found.solution.weights).log_likelihood

    delay, std_error = 0.02, np.inf
    for _ in range(8):
        here = at(delay)
        free = here.point.with_effects((*found.point.effects, ActiveEffect(late, (delay,))))
        columns = effect_sensitivities(here.problem, linear_values(here.design, here.solution), free, [(place, 0)])
        information, score = information_on(here, columns)
        delay, std_error = delay + float(score[0] / information[0, 0]), float(information[0, 0] ** -0.5)
    tried = delay + std_error * np.linspace(-1.0, 1.0, 9)
    highest = tried[int(np.argmax([likelihood(value) for value in tried]))]
    # Half is left by the ends of the colour; with rows that no instrument compares it was more than one.
    assert abs(highest - delay) < 0.6 * std_error


def clean_pair(plane: str, n: int) -> tuple[Aircraft, list[FlightLog], dict[tuple[str, str], float]]:
    """Two flights of the n-th aircraft in rotary gusts with nothing missing, and its derivatives."""
    seed = 41000 + 10 * n
    if plane == "vertical":
        body = BODIES[n % len(BODIES)]
        logs = [flown(f"{k}", body, seed + k, air=0.8, rotary=True) for k in range(2)]
        return aircraft_of(body, 0.08, np.random.default_rng(seed)), logs, body.terms
    other, small = sideways.BODIES[n % 3], n % 3 == 2
    gust, interval, seconds = (0.6, 0.02, 24.0) if small else (1.0, 0.04, 40.0)
    logs = [
        sideways.flown(f"{k}", other, seed + k, gust=gust, interval=interval, seconds=seconds, rotary=True)
        for k in range(2)
    ]
    return sideways.aircraft_of(other, 0.08, np.random.default_rng(seed)), logs, other.terms


@pytest.mark.slow
@pytest.mark.parametrize(("plane", "moment", "pairs"), [("vertical", "C_m", 12), ("lateral", "C_l", 24)])
def test_the_moments_standard_errors_hold_and_nothing_is_named(plane: str, moment: str, pairs: int) -> None:
    """By least squares without them 72 % of C_l were within two and 89 % within three, and two pairs had a delay."""
    within, named = [], 0
    for n in range(pairs):
        aircraft, logs, terms = clean_pair(plane, n)
        found = decided(aircraft, logs[:1], logs[1:])
        named += bool(found.findings)
        deviations = np.sqrt(np.diag(found.covariance))
        places = {unknown: p for p, unknown in enumerate(found.completed.design.unknowns)}
        for coefficient, term in ((c, t) for c, t in terms if c == moment and t != "1"):
            entry = (coefficient, parse_term(term))
            off = abs(found.completed.point.model.value(entry) - terms[coefficient, term])
            deviation = deviations[places["term", entry]]
            within.append((off < 2.0 * deviation, off < 3.0 * deviation))
    assert named <= 1
    two, three = np.mean(within, axis=0)
    assert two > 0.85
    assert three > 0.94
