"""Lateral and six-axis linear models against the suite's own equations and the textbook's matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import control
import numpy as np
import pytest
from lateral_problems import PITCH, SIDE, commuter
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.rigid_body import Body, answer, slopes
from scipy.optimize import fsolve

from aerosid.aircraft.declared_model import declared_model
from aerosid.flight_model.linear_model import FlightCondition, LinearModel, linearise
from aerosid.flight_model.modes import modes_of

CONDITION = FlightCondition(72.0, 1.02, 4650.0, speed_of_sound=335.0, inputs={"alpha": 0.034})
CROOKED = {"C_Y": {"1": 0.004}, "C_l": {"1": 0.0011}, "C_n": {"1": -0.0023, "alpha*p_hat": -0.4, "beta^3": 0.3}}
BODY = Body(39.0, 1.98, 19.8, (27500.0, 32600.0, 51000.0, 1600.0), None, 72.0)


def with_crooked(values: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    return {name: {**terms, **CROOKED.get(name, {})} for name, terms in values.items()}


CASES = {
    "lateral": SIDE,
    "lateral, crooked": with_crooked(SIDE),
    "six": PITCH | SIDE,
    "six, crooked": PITCH | with_crooked(SIDE),
}


def linear_of(values: Mapping[str, Mapping[str, float]]) -> LinearModel:
    return linearise(declared_model(commuter(values), 72.0), CONDITION)


def oracle_matrices(
    states: Sequence[str], controls: Sequence[str], values: Mapping[str, Mapping[str, float]]
) -> tuple[dict[str, float], NDArray[np.float64], NDArray[np.float64]]:
    """The trim by a library's solver, and the slopes of the suite's own equations there by the complex step."""
    terms = {(coefficient, term): value for coefficient, own in values.items() for term, value in own.items()}
    pitching = "q" in states
    unknowns = [*(("alpha", "delta_e", "thrust") if pitching else ()), "beta", "delta_a", "delta_r"]
    moving = [n for n, name in enumerate(states) if name in "uvwpqr"]

    def at(given: Mapping[str, float]) -> tuple[list[float], dict[str, float]]:
        alpha, beta = given.get("alpha", 0.034), given["beta"]
        along = 72.0 * np.cos(beta)
        motion = {"u": along * np.cos(alpha), "v": 72.0 * np.sin(beta), "w": along * np.sin(alpha), "theta": alpha}
        inputs = {"rho": 1.02, "mass": 4650.0, "speed_of_sound": 335.0, "delta_e": 0.0, **given}
        inputs["thrust"] = 1e4 * given.get("thrust", 0.0)
        inputs |= {} if pitching else {"V": 72.0, "alpha": alpha, "theta": alpha}
        return [motion.get(name, 0.0) for name in states], inputs

    def moved(unknown: NDArray[np.float64]) -> NDArray[np.float64]:
        x, inputs = at(dict(zip(unknowns, unknown.tolist(), strict=True)))
        return np.real(answer(states, x, inputs, terms, BODY).rates)[moving]

    start = [0.03, 0.0, 0.5, 0.0, 0.0, 0.0] if pitching else [0.0, 0.0, 0.0]
    found = dict(zip(unknowns, fsolve(moved, start, xtol=1e-13).tolist(), strict=True))
    x, inputs = at(found)
    A = slopes(lambda z: answer(states, list(z), inputs, terms, BODY).rates, x)
    B = slopes(
        lambda z: answer(states, x, {**inputs, **dict(zip(controls, z, strict=True))}, terms, BODY).rates,
        [inputs[name] for name in controls],
    )
    return found, A, B


@pytest.mark.parametrize("name", CASES)
def test_matrices_are_the_slopes_of_the_suites_own_equations(name: str) -> None:
    linear = linear_of(CASES[name])
    found, A, B = oracle_matrices(linear.states, linear.inputs, CASES[name])
    for unknown, value in found.items():
        wanted = 1e4 * value if unknown == "thrust" else value
        assert getattr(linear.trimmed, unknown) == pytest.approx(wanted, rel=1e-7, abs=1e-10)
    assert_allclose(linear.A, A, rtol=1e-7, atol=1e-8)
    assert_allclose(linear.B, B, rtol=1e-7, atol=1e-8)


def test_a_crooked_aircraft_is_trimmed_with_wings_level_and_its_surfaces() -> None:
    trimmed = linear_of(CASES["lateral, crooked"]).trimmed
    assert trimmed.balanced == ("beta", "delta_a", "delta_r")
    assert abs(trimmed.delta_a) > 1e-3
    assert trimmed.phi == 0.0
    straight = linear_of(SIDE).trimmed
    assert (straight.beta, straight.delta_a, straight.delta_r) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_bank_holds_what_a_missing_rudder_would() -> None:
    values = {name: {t: v for t, v in terms.items() if "delta_r" not in t} for name, terms in SIDE.items()}
    values["C_n"] = {**values["C_n"], "1": 0.002}
    linear = linear_of(values)
    assert linear.trimmed.balanced == ("beta", "delta_a", "phi")
    lean = 9.80665 * 4650.0 * np.sin(linear.trimmed.phi) * np.cos(linear.trimmed.alpha)
    side = 0.5 * 1.02 * 72.0**2 * 39.0 * SIDE["C_Y"]["beta"] * linear.trimmed.beta
    assert lean == pytest.approx(-side, rel=1e-4)


def textbook_matrix(alpha: float) -> NDArray[np.float64]:
    """A of v, p, r, phi from dimensional derivatives, I_xz by primed ones (Nelson, equations 5.32 to 5.35)."""
    force = 0.5 * 1.02 * 72.0**2 * 39.0
    half = 19.8 / 144.0
    scale = {"beta": 1.0 / 72.0, "p_hat": half, "r_hat": half}
    y, roll, yaw = (
        {term: SIDE[name].get(term, 0.0) * force * size * arm for term, size in scale.items()}
        for name, arm in (("C_Y", 1.0 / 4650.0), ("C_l", 19.8), ("C_n", 19.8))
    )
    i_xx, _, i_zz, i_xz = BODY.inertia
    inverse = np.linalg.inv([[i_xx, -i_xz], [-i_xz, i_zz]])
    primed = {term: inverse @ [roll[term], yaw[term]] for term in scale}
    u, w = 72.0 * np.cos(alpha), 72.0 * np.sin(alpha)
    return np.array(
        [
            [y["beta"], y["p_hat"] + w, y["r_hat"] - u, 9.80665 * np.cos(alpha)],
            [primed["beta"][0], primed["p_hat"][0], primed["r_hat"][0], 0.0],
            [primed["beta"][1], primed["p_hat"][1], primed["r_hat"][1], 0.0],
            [0.0, 1.0, np.tan(alpha), 0.0],
        ]
    )


def test_the_lateral_matrix_is_the_textbooks_and_its_roots_those_of_python_control() -> None:
    linear = linear_of(SIDE)
    A = textbook_matrix(0.034)
    assert_allclose(linear.A, A, rtol=1e-9, atol=1e-12)
    frequency, damping, poles = control.damp(control.ss(A, np.eye(4), np.eye(4), np.zeros((4, 4))), doprint=False)
    modes = {mode.name: mode for mode in modes_of(linear.A, linear.states)}
    assert set(modes) == {"dutch_roll", "roll", "spiral"}
    oscillating = np.flatnonzero(np.abs(np.imag(poles)) > 0.0)[0]
    assert modes["dutch_roll"].frequency == pytest.approx(frequency[oscillating], rel=1e-9)
    assert modes["dutch_roll"].damping == pytest.approx(damping[oscillating], rel=1e-9)
    real = sorted(np.real(poles[np.imag(poles) == 0.0]))
    assert [modes["roll"].root, modes["spiral"].root] == pytest.approx(real, rel=1e-9)


def test_control_objects_carry_the_names_of_the_case() -> None:
    for values, states, surfaces in (
        (SIDE, ["v", "p", "r", "phi"], {"delta_a", "delta_r"}),
        (PITCH | SIDE, ["u", "v", "w", "p", "q", "r", "phi", "theta"], {"delta_e", "delta_a", "delta_r"}),
    ):
        linear = linear_of(values)
        system = linear.state_space()
        assert list(system.state_labels) == states
        inputs = list(system.input_labels)
        assert set(inputs) == surfaces
        assert_allclose(np.sort_complex(system.poles()), np.sort_complex(np.linalg.eigvals(linear.A)), rtol=1e-9)
        time = np.linspace(0.0, 4.0, 81)
        _, found = control.step_response(system, time)
        rudder = inputs.index("delta_r")
        ours = linear.step_response(time, "delta_r", 0.02)
        for name in ("p", "r", "phi"):
            assert_allclose(ours[name], 0.02 * found[states.index(name), rudder], atol=1e-9)
        assert_allclose(ours["beta"], 0.02 * found[states.index("v"), rudder] / 72.0, atol=1e-9)
