"""Linear models, modes, flying qualities and their deviations, against the textbook equations and published numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from oracles.flight import Airframe, state_rates
from problems import BOTH_SQUARES, LIFT_AND_DRAG, LIGHT, UNSTABLE, declaring
from scipy.optimize import fsolve

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError, EstimationError, UsageError
from aerosid.flight_model.linear_model import FlightCondition, LinearModel, linearise
from aerosid.flight_model.modes import Mode, longitudinal_modes
from aerosid.loop.flying_qualities.carried_deviations import TermCovariance
from aerosid.loop.flying_qualities.extrapolated_modes import beyond_record
from aerosid.loop.flying_qualities.linear_analysis import (
    STEP,
    STEP_TIME,
    analyse,
    load_factor_per_alpha,
    requirement_for,
)
from aerosid.loop.flying_qualities.mil_f_8785c import (
    CLASSES,
    Requirement,
    divergence_level,
    phugoid_level,
    short_period_level,
)
from aerosid.loop.quantity import Parameter

CONDITION = FlightCondition(96.0, 0.9077, 2280.0, speed_of_sound=330.0)
SQUARES = declaring(LIGHT, BOTH_SQUARES)
IMPLICIT = declaring(
    LIGHT,
    {
        ("C_m", "alpha_dot_hat"): -5.0,
        ("C_Z", "alpha_dot_hat"): -1.7,
        ("C_m", "V_hat"): 0.02,
        ("C_X", "mach"): -0.03,
        ("C_m", "C_T"): 0.08,
        ("C_Z", "alpha*delta_e"): -0.5,
        ("C_m", "pos(alpha - 0.005)^2"): -2.0,
    },
)
AIRCRAFT = {"squares": SQUARES, "lift and drag": LIFT_AND_DRAG, "implicit": IMPLICIT, "unstable": UNSTABLE}


def terms_of(aircraft: Aircraft) -> dict[tuple[str, str], float]:
    return {(d.coefficient, str(d.term)): d.value for d in aircraft.derivatives}


def rates(x: np.ndarray, given: Mapping[str, float], terms: Mapping[tuple[str, str], float]) -> np.ndarray:
    frame = Airframe(LIGHT.wing_area, LIGHT.mean_chord, LIGHT.I_yy, 100.0, 100.0)
    inputs = {"rho": CONDITION.density, "mass": CONDITION.mass, "speed_of_sound": CONDITION.speed_of_sound, **given}
    return state_rates([*x, 0.0], inputs, terms, frame)[:4]


def oracle_model(terms: Mapping[tuple[str, str], float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B and (alpha, delta_e, thrust) of level flight, by a library's solver and central differences."""

    def state(alpha: float) -> np.ndarray:
        return np.array([CONDITION.airspeed * math.cos(alpha), CONDITION.airspeed * math.sin(alpha), 0.0, alpha])

    def unbalanced(unknown: np.ndarray) -> np.ndarray:
        return rates(state(unknown[0]), {"delta_e": unknown[1], "thrust": 1e4 * unknown[2]}, terms)[:3]

    alpha, delta_e, thrust = fsolve(unbalanced, [0.03, 0.0, 0.5], xtol=1e-13)
    given = {"delta_e": delta_e, "thrust": 1e4 * thrust}
    x, steps = state(alpha), (1e-3, 1e-3, 1e-5, 1e-5)
    A = np.zeros((4, 4))
    for k, step in enumerate(steps):
        e = np.eye(4)[k] * step
        A[:, k] = (rates(x + e, given, terms) - rates(x - e, given, terms)) / (2.0 * step)
    up, down = ({**given, "delta_e": delta_e + sign * 1e-5} for sign in (1.0, -1.0))
    B = (rates(x, up, terms) - rates(x, down, terms)) / 2e-5
    return A, B, np.array([alpha, delta_e, 1e4 * thrust])


def linear_of(aircraft: Aircraft) -> LinearModel:
    return linearise(declared_model(aircraft, 100.0), CONDITION)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_matrices_are_the_slopes_of_the_textbook_equations(name: str) -> None:
    linear = linear_of(AIRCRAFT[name])
    A, B, level = oracle_model(terms_of(AIRCRAFT[name]))
    assert_allclose([linear.trimmed.alpha, linear.trimmed.delta_e, linear.trimmed.thrust], level, rtol=1e-8)
    assert_allclose(linear.A, A, rtol=1e-5, atol=1e-5)
    assert_allclose(linear.B[:, 0], B, rtol=1e-5, atol=1e-5)


def test_modes_are_those_that_nelson_prints_for_the_navion() -> None:
    """Nelson, Flight Stability and Automatic Control, example problem 4.3; printed to three digits, ft and s."""
    A = np.array(
        [[-0.045, 0.036, 0.0, -32.2], [-0.369, -2.02, 176.0, 0.0], [0.0019, -0.0396, -2.948, 0.0], [0.0, 0.0, 1.0, 0.0]]
    )
    short_period, phugoid = longitudinal_modes(A)
    assert (short_period.name, phugoid.name) == ("short_period", "phugoid")
    assert_allclose([short_period.roots[1].real, abs(short_period.roots[1].imag)], [-2.5, 2.59], rtol=5e-3)
    assert_allclose([phugoid.roots[1].real, abs(phugoid.roots[1].imag)], [-0.0171, 0.213], rtol=5e-3)
    assert short_period.time_to_half == pytest.approx(0.28, abs=5e-3)
    assert phugoid.time_to_half == pytest.approx(40.3, rel=0.01)
    assert phugoid.period == pytest.approx(29.5, rel=5e-3)


def test_modes_agree_with_python_control() -> None:
    linear = linear_of(SQUARES)
    frequency, damping, _ = control.damp(linear.state_space(), doprint=False)
    modes = longitudinal_modes(linear.A)
    assert_allclose([mode.frequency for mode in modes], sorted(frequency, reverse=True)[::2], rtol=1e-9)
    assert {round(mode.damping or 0.0, 9) for mode in modes} == {round(float(z), 9) for z in damping}


@given(st.lists(st.floats(-9.0, 3.0), min_size=4, max_size=4, unique=True), st.integers(0, 2))
def test_modes_hold_every_root_once(parts: list[float], oscillations: int) -> None:
    blocks = np.zeros((4, 4))
    for k in range(0, 4, 2):
        a, b = parts[k], parts[k + 1]
        if k // 2 < oscillations:
            blocks[k : k + 2, k : k + 2] = [[a, b], [-b, a]]
        else:
            blocks[k, k], blocks[k + 1, k + 1] = a, b
    modes = longitudinal_modes(blocks)
    held = sorted((root for mode in modes for root in mode.roots), key=lambda r: (r.real, r.imag))
    wanted = sorted(np.linalg.eigvals(blocks).tolist(), key=lambda r: (r.real, r.imag))
    assert_allclose(held, wanted, rtol=1e-9, atol=1e-12)
    for mode in modes:
        assert (mode.time_to_half is None) or (mode.time_to_double is None)
        assert len(mode.roots) == 1 or not mode.roots[0].imag or mode.roots[0] == mode.roots[1].conjugate()


def test_a_statically_unstable_aircraft_has_a_mode_that_doubles() -> None:
    modes = longitudinal_modes(linear_of(UNSTABLE).A)
    doubling = [mode for mode in modes if mode.time_to_double is not None]
    assert len(doubling) == 1
    row = analyse(
        "declared", declared_model(UNSTABLE, 100.0), CONDITION, TermCovariance((), np.zeros((0, 0))), Requirement()
    )
    assert doubling[0].time_to_double is not None
    assert row.short_period_level == (3 if doubling[0].time_to_double >= 6.0 else 4)
    assert [divergence_level(6.1), divergence_level(5.9)] == [3, 4]
    between = np.diag([-4.0, 0.0, 0.0, 0.1]).astype(float)
    between[1:3, 1:3] = [[-0.2, 0.5], [-0.5, -0.2]]
    assert [mode.name for mode in longitudinal_modes(between)] == ["real_root_1", "third_oscillatory", "real_root_2"]
    assert Mode("real_root_1", (-2.0 + 0j,)).time_to_half == pytest.approx(0.34657, rel=1e-4)


@pytest.mark.parametrize("name", ["squares", "implicit"])
def test_load_factor_is_that_of_a_steady_pull_up(name: str) -> None:
    """A small elevator deflection at constant airspeed, alpha and q found where neither changes any more."""
    terms = terms_of(AIRCRAFT[name])
    linear, (_, _, (alpha, delta_e, thrust)) = linear_of(AIRCRAFT[name]), oracle_model(terms)
    push = -1e-4

    def moving(unknown: np.ndarray) -> np.ndarray:
        a, q = unknown
        x = np.array([CONDITION.airspeed * math.cos(a), CONDITION.airspeed * math.sin(a), q, alpha])
        u_dot, w_dot, q_dot, _ = rates(x, {"delta_e": delta_e + push, "thrust": thrust}, terms)
        return np.array([w_dot * math.cos(a) - u_dot * math.sin(a), 100.0 * q_dot])

    a, q = fsolve(moving, [alpha, 0.0], xtol=1e-13)
    assert load_factor_per_alpha(linear) == pytest.approx(CONDITION.airspeed * q / 9.80665 / (a - alpha), rel=2e-3)


def test_step_response_is_that_of_python_control_and_the_tangent_of_the_flight() -> None:
    linear = linear_of(SQUARES)
    response = linear.step_response(STEP_TIME, "delta_e", STEP)
    _, states = control.step_response(linear.state_space(), STEP_TIME)
    u, w, q, theta = STEP * states[:, 0]
    alpha = linear.trimmed.alpha
    assert_allclose(response["q"], q, atol=1e-10)
    assert_allclose(response["theta"], theta, atol=1e-9)
    assert_allclose(response["V"], u * math.cos(alpha) + w * math.sin(alpha), atol=1e-8)
    assert_allclose(response["alpha"], (w * math.cos(alpha) - u * math.sin(alpha)) / CONDITION.airspeed, atol=1e-10)
    terms = terms_of(SQUARES)
    x0 = CONDITION.airspeed * np.array([math.cos(alpha), math.sin(alpha), 0.0, 0.0]) + np.array([0, 0, 0, alpha])
    errors = []
    for size in (0.004, 0.002):
        given = {"delta_e": linear.trimmed.delta_e + size, "thrust": linear.trimmed.thrust}
        x, step = x0, 0.01
        for _ in range(150):
            k1 = rates(x, given, terms)
            k2 = rates(x + step / 2 * k1, given, terms)
            k3 = rates(x + step / 2 * k2, given, terms)
            k4 = rates(x + step * k3, given, terms)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        linear_q = linear.step_response(np.linspace(0.0, 1.5, 31), "delta_e", size)["q"][-1]
        errors.append(abs(x[2] - linear_q))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)  # what is left is quadratic


def test_deviations_are_the_scatter_of_whole_analyses() -> None:
    """Derivatives drawn with their covariance; trim and roots of each by the oracle alone."""
    model = declared_model(SQUARES, 100.0)
    entries = tuple(entry for entry in model.entries if str(entry[1]) in ("alpha", "q_hat", "alpha^2", "delta_e"))
    sizes = np.array([0.01 * abs(model.value(entry)) for entry in entries])
    generator = np.random.default_rng(5)
    root = np.tril(generator.uniform(-0.6, 0.6, (sizes.size, sizes.size)), -1) + np.eye(sizes.size)
    covariance = np.outer(sizes, sizes) * (root @ root.T)
    row = analyse("completed", model, CONDITION, TermCovariance(entries, covariance), Requirement())
    drawn = []
    for sample in generator.multivariate_normal([model.value(entry) for entry in entries], covariance, size=250):
        terms = terms_of(SQUARES) | {(c, str(t)): v for (c, t), v in zip(entries, sample, strict=True)}
        A, _, level = oracle_model(terms)
        (fast, slow) = (max(np.linalg.eigvals(A), key=abs), min(np.linalg.eigvals(A), key=abs))
        drawn.append([abs(fast), -fast.real / abs(fast), abs(slow), -slow.real / abs(slow), *level])
    short_period, phugoid = (mode.numbers for mode in row.modes)
    stated = [
        *(mode[name].std_error for mode in (short_period, phugoid) for name in ("frequency", "damping")),
        *(row.trim[name].std_error for name in ("alpha", "delta_e", "thrust")),
    ]
    # A standard deviation from 250 draws is known to 4.5 %; four of those.
    assert_allclose(np.std(drawn, axis=0, ddof=1), stated, rtol=0.18)


def test_what_is_unknown_leaves_no_deviation_only_where_it_matters() -> None:
    model = declared_model(LIGHT, 100.0)
    given = {d.coefficient + " " + str(d.term): (d.coefficient, d.term) for d in LIGHT.derivatives}
    entries = (given["C_m alpha"], given["C_m q_hat"])
    spread = TermCovariance(entries, np.diag([1e-4, np.inf]))
    row = analyse("declared", model, CONDITION, spread, Requirement())
    assert row.modes[0].numbers["damping"].std_error is None
    assert row.short_period_level_range is None
    assert row.short_period_level == 1
    assert row.steps[0].deviation == {}
    # Level flight has no pitch rate: its derivative cannot matter to the trim.
    assert row.trim["delta_e"].std_error == pytest.approx(0.01 * abs(row.trim["alpha"].value / 1.94), rel=0.1)
    indefinite = TermCovariance(entries, -1e-4 * np.eye(2))  # as the corrected covariance of a short record may be
    assert analyse("declared", model, CONDITION, indefinite, Requirement()).qualities["cap"].std_error is None
    nothing = analyse("declared", model, CONDITION, TermCovariance((), np.zeros((0, 0))), Requirement())
    assert nothing.trim["alpha"].std_error is None


@pytest.mark.parametrize(
    ("category", "aircraft_class", "numbers", "level"),
    [
        ("A", "IV", (3.0, 0.70, 20.0), 1),
        ("A", "IV", (2.0, 0.70, 20.0), 2),  # CAP 0.20
        ("A", "IV", (0.9, 0.70, 2.0), 2),  # slower than 1 rad/s
        ("A", "IV", (3.0, 1.31, 20.0), 2),
        ("A", "IV", (3.0, 0.24, 20.0), 3),
        ("A", "IV", (3.0, 0.14, 20.0), 4),
        ("B", "II", (1.4, 0.30, 23.0), 1),  # CAP 0.0852
        ("B", "II", (1.0, 0.30, 23.0), 2),
        ("B", "II", (1.4, 0.29, 23.0), 2),
        ("B", "II", (0.9, 0.30, 23.0), 4),  # CAP 0.035
        ("C", "I", (1.5, 0.70, 2.6), 2),
        ("C", "II", (1.5, 0.70, 2.6), 1),
        ("C", "II-C", (1.5, 0.70, 2.6), 2),
        ("C", "III", (0.69, 0.70, 2.1), 2),
        ("C", "III", (0.35, 0.70, 1.2), 3),
        ("B", "II", (3.0, 0.70, -1.0), 4),
    ],
)
def test_levels_are_those_of_the_specification(
    category: str, aircraft_class: str, numbers: tuple[float, float, float], level: int
) -> None:
    assert short_period_level(*numbers, Requirement(category, aircraft_class)) == level


@given(
    st.floats(0.1, 20.0), st.floats(0.0, 3.0), st.floats(0.5, 80.0), st.sampled_from("ABC"), st.sampled_from(CLASSES)
)
def test_light_classes_are_held_to_no_less_than_heavy_ones(
    frequency: float, damping: float, n_alpha: float, category: str, aircraft_class: str
) -> None:
    heavy = short_period_level(frequency, damping, n_alpha, Requirement(category, "III"))
    assert short_period_level(frequency, damping, n_alpha, Requirement(category, aircraft_class)) >= heavy


def test_phugoid_levels() -> None:
    assert [phugoid_level(0.05, None), phugoid_level(0.03, None)] == [1, 2]
    assert [phugoid_level(-0.01, 60.0), phugoid_level(None, 20.0)] == [3, 4]


def test_a_mode_that_lasts_longer_than_the_recording_is_marked() -> None:
    # The period by another library; a recording of half of it has not seen the phugoid, the short period it has.
    A, _, _ = oracle_model(terms_of(SQUARES))
    frequencies, dampings, _ = control.damp(control.ss(A, np.zeros((4, 1)), np.eye(4), 0), doprint=False)
    slow = int(np.argmin(frequencies))
    period = 2.0 * math.pi / (frequencies[slow] * math.sqrt(1.0 - dampings[slow] ** 2))
    model, unknown = declared_model(SQUARES, 100.0), TermCovariance((), np.zeros((0, 0)))

    def marked(record: float) -> dict[str, tuple[str, ...]]:
        row = analyse("declared", model, CONDITION, unknown, Requirement(), record)
        return {mode.name: mode.extrapolated for mode in row.modes}

    half = marked(0.5 * period)
    assert {"frequency", "damping", "period"} <= set(half["phugoid"])
    assert half["short_period"] == ()
    assert "period" not in marked(1.05 * period)["phugoid"]
    assert marked(1e6) == {"short_period": (), "phugoid": ()}


def test_two_real_roots_are_extrapolated_from_one_cycle_of_their_frequency() -> None:
    overdamped = {"frequency": Parameter(0.5, None, "rad/s"), "time_to_half": Parameter(9.0, None, "s")}
    assert beyond_record(overdamped, 12.0) == ("frequency",)  # one cycle is 12.6 s
    assert beyond_record(overdamped, 13.0) == ()
    assert beyond_record({"time_to_double": Parameter(30.0, None, "s")}, 20.0) == ("time_to_double",)


def test_the_option_wins_over_the_aircraft_file_and_that_over_the_default() -> None:
    text = LIGHT.text + '\n[flying_qualities]\ncategory = "C"\nclass = "III"\n'
    stated = aircraft_from_text(text, "stated.toml", "0" * 64)
    assert requirement_for(LIGHT, None, None) == Requirement("B", "II")
    assert requirement_for(stated, None, None) == Requirement("C", "III")
    assert requirement_for(stated, "A", None) == Requirement("A", "III")
    with pytest.raises(UsageError, match="'D', expected one of A, B, C"):
        requirement_for(stated, "D", None)
    with pytest.raises(AircraftError, match=r"stated.toml: flying_qualities.class .*'V', expected one of 'I'"):
        aircraft_from_text(text.replace('"III"', '"V"'), "stated.toml", "0" * 64)
    with pytest.raises(AircraftError, match=r"flying_qualities\.kind is unknown, expected category, class"):
        aircraft_from_text(text.replace("class =", "kind ="), "stated.toml", "0" * 64)


def test_an_aircraft_without_elevator_or_trim_says_so() -> None:
    model = declared_model(LIGHT, 100.0)
    without = model.without([entry for entry in model.entries if "delta_e" in entry[1].variables])
    with pytest.raises(EstimationError, match="delta_e"):
        linearise(without, CONDITION)
    with pytest.raises(EstimationError, match="no trim"):
        linearise(declared_model(LIGHT, 100.0), FlightCondition(10.0, 0.9077, 2280.0))
