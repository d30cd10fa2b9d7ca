"""Names of lateral and of coupled modes against printed examples and matrices made from known roots."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lateral_problems import PITCH, SIDE, commuter
from numpy.testing import assert_allclose

from aerosid.aircraft.declared_model import declared_model
from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, SIX, coupled_of
from aerosid.flight_model.linear_model import FlightCondition, linearise
from aerosid.flight_model.modes import longitudinal_modes, mode_shape_ratio, modes_of

SIDEWAYS = coupled_of(LATERAL)
NAVION = np.array(
    [[-0.254, 0.0, -1.0, 0.182], [-16.02, -8.40, 2.19, 0.0], [4.488, -0.350, -0.760, 0.0], [0.0, 1.0, 0.0, 0.0]]
)
"""beta, p, r, phi of Nelson, Flight Stability and Automatic Control, example problem 5.3, as printed."""


def test_modes_are_those_that_nelson_prints_for_the_navion() -> None:
    roll, dutch_roll, spiral = modes_of(NAVION, SIDEWAYS)
    assert (roll.name, dutch_roll.name, spiral.name) == ("roll", "dutch_roll", "spiral")
    assert roll.root == pytest.approx(-8.435, rel=1e-3)
    assert spiral.root == pytest.approx(-0.00877, rel=0.02)  # of entries with three digits
    assert_allclose([dutch_roll.roots[1].real, abs(dutch_roll.roots[1].imag)], [-0.487, 2.335], rtol=2e-3)
    assert roll.time_constant == pytest.approx(1.0 / 8.435, rel=1e-3)
    assert roll.time_to_half == pytest.approx(0.0822, rel=1e-3)


def block(real: float, imaginary: float) -> np.ndarray:
    return np.array([[real, imaginary], [-imaginary, real]])


def test_coupled_roll_and_spiral_and_four_real_roots_have_their_own_names() -> None:
    coupled = np.zeros((4, 4))
    coupled[:2, :2], coupled[2:, 2:] = block(-0.2, 2.0), block(-0.5, 0.3)
    fast, slow = modes_of(coupled, SIDEWAYS)
    assert (fast.name, slow.name) == ("dutch_roll", "coupled_roll_spiral")
    assert slow.frequency == pytest.approx(np.hypot(0.5, 0.3))
    real = modes_of(np.diag([-3.0, 0.4, -0.1, -1.0]), SIDEWAYS)
    assert [mode.name for mode in real] == [f"lateral_root_{n}" for n in (1, 2, 3, 4)]
    diverging = modes_of(np.array([[-0.2, 2.0, 0, 0], [-2.0, -0.2, 0, 0], [0, 0, 0.05, 0], [0, 0, 0, -2.5]]), SIDEWAYS)
    assert {mode.name: mode.root for mode in diverging if mode.root} == pytest.approx({"spiral": 0.05, "roll": -2.5})


def test_all_five_modes_of_a_symmetric_aircraft_are_those_of_the_two_motions_alone() -> None:
    condition = FlightCondition(72.0, 1.02, 4650.0)
    six = linearise(declared_model(commuter(PITCH | SIDE), 72.0), condition)
    level = FlightCondition(72.0, 1.02, 4650.0, inputs={"alpha": six.trimmed.alpha})
    motions = [linearise(declared_model(commuter(values), 72.0), level) for values in (PITCH, SIDE)]
    apart = [mode for linear in motions for mode in modes_of(linear.A, linear.states)]
    together = modes_of(six.A, six.states)
    assert [mode.name for mode in together] == ["short_period", "phugoid", "roll", "dutch_roll", "spiral"]
    assert [mode.name for mode in together] == [mode.name for mode in apart]
    for mode, alone in zip(together, apart, strict=True):
        assert_allclose(mode.roots, alone.roots, rtol=1e-7)


@given(
    st.lists(st.floats(-4.0, 0.5), min_size=8, max_size=8, unique=True),
    st.integers(0, 2),
    st.integers(0, 2),
    st.floats(0.0, 1e-3),
    st.integers(0, 2**31),
)
def test_six_axes_hold_every_root_once(
    parts: list[float], pitching: int, swinging: int, coupling: float, seed: int
) -> None:
    A = np.zeros((8, 8))
    states = coupled_of(SIX)
    for case, oscillations, own in ((LONGITUDINAL, pitching, parts[:4]), (LATERAL, swinging, parts[4:])):
        rows = [states.index(name) for name in coupled_of(case)]
        for k in (0, 2):
            a, b = own[k], own[k + 1]
            A[np.ix_(rows[k : k + 2], rows[k : k + 2])] = block(a, b) if k // 2 < oscillations else np.diag([a, b])
    A = A + coupling * np.random.default_rng(seed).standard_normal(A.shape)
    held = sorted((root for mode in modes_of(A, states) for root in mode.roots), key=lambda r: (r.real, r.imag))
    wanted = sorted(np.linalg.eigvals(A).tolist(), key=lambda r: (r.real, r.imag))
    assert_allclose(held, wanted, rtol=1e-6, atol=1e-6)
    assert len({mode.name for mode in modes_of(A, states)}) == len(modes_of(A, states))


def test_the_ratio_of_bank_to_sideslip_is_that_of_a_free_swing() -> None:
    """Started in the real part of the mode, bank and sideslip swing with the ratio of their amplitudes."""
    dutch_roll = modes_of(NAVION, SIDEWAYS)[1]
    ratio = mode_shape_ratio(NAVION, ("beta", "p", "r", "phi"), dutch_roll, "phi", "beta")
    # By the rows of the matrix alone: phi' = p, and beta from the equations of r and p at the printed root.
    root = complex(*[(dutch_roll.roots[0].real), (dutch_roll.roots[0].imag)])
    beta, p, r = np.linalg.solve(
        [[root + 0.254, 0.0, 1.0], [16.02, root + 8.40, -2.19], [0.0, 1.0, 0.0]], [0.182, 0.0, root]
    )
    assert abs(p) == pytest.approx(abs(root))
    assert ratio == pytest.approx(1.0 / abs(beta), rel=1e-6)
    assert abs(-4.488 * beta + 0.350 * p + (root + 0.760) * r) < 1e-9


def test_longitudinal_names_do_not_change() -> None:
    linear = linearise(declared_model(commuter(PITCH), 72.0), FlightCondition(72.0, 1.02, 4650.0))
    assert modes_of(linear.A, linear.states) == longitudinal_modes(linear.A)
