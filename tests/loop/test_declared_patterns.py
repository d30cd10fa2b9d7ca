"""Patterns between declared and estimated derivatives, each planted, and none in what is right."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.loop.declared_patterns import notes_on_patterns
from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.search.settings import DeclaredInertiaSettings

DECLARED = {
    ("C_X", "alpha"): 0.3,
    ("C_Z", "1"): -0.2,
    ("C_Z", "alpha"): -5.0,
    ("C_Z", "q_hat"): -9.0,
    ("C_Z", "delta_e"): -0.5,
    ("C_m", "alpha"): -0.7,
    ("C_m", "q_hat"): -16.0,
    ("C_m", "delta_e"): -1.5,
}


def notes(
    table: Sequence[DerivativeRow], errors: Sequence[ErrorRow], aircraft: Aircraft | None = None
) -> tuple[str, ...]:
    return notes_on_patterns(table, errors, aircraft, DeclaredInertiaSettings())


def rows(**factors: float) -> list[DerivativeRow]:
    """The derivatives with some off by a factor, known to 2 %: `C_m_alpha = 57.3`, or all of one as `C_m = 1.4`."""
    found = []
    for (coefficient, term), declared in DECLARED.items():
        factor = factors.get(f"{coefficient}_{term}", factors.get(coefficient, 1.0) if term != "1" else 1.0)
        value = factor * declared
        error = 0.02 * abs(value)
        found.append(
            DerivativeRow(coefficient, term, declared, value, value, error, error, None, None, None, shown=True)
        )
    return found


def test_what_is_as_declared_says_nothing() -> None:
    assert notes(rows(), []) == ()


def test_common_factors_of_lift_and_moment_are_told_apart() -> None:
    said = notes(rows(C_Z=1.25, C_m=1.6), [])
    assert len(said) == 2
    assert said[0].startswith("All derivatives of C_Z are 1.25 times")
    assert "mass, wing area or air density" in said[0]
    assert said[1].startswith("All derivatives of C_m are 1.60 times")
    assert "moment of inertia, mean chord" in said[1]


@pytest.mark.parametrize(
    ("speed", "words"),
    [
        (1.0 / 0.514444, "an airspeed in knots read as m/s (0.265)"),
        (3.6, "an airspeed in km/h read as m/s (0.0772)"),
        (1.0 / 0.3048, "an airspeed in ft/s read as m/s (0.0929)"),
        (0.514444, "an airspeed in m/s read as knots (3.78)"),
    ],
)
def test_an_airspeed_in_another_unit_is_one_pattern_of_all_coefficients(speed: float, words: str) -> None:
    """Dynamic pressure is off by the square; rates over the airspeed, and what else is wrong, hide in the others."""
    off = {"C_X": 1.1, "C_Z": 0.9, "C_m": 1.0}
    (said,) = notes(rows(**{name: factor / speed**2 for name, factor in off.items()}, C_Z_q_hat=1.1), [])
    assert words in said
    assert "The static derivatives of C_X, C_Z and C_m are" in said


def test_a_factor_of_forces_alone_or_of_no_unit_is_no_airspeed() -> None:
    for factors in ({"C_X": 0.265, "C_Z": 0.265}, {"C_X": 0.5, "C_Z": 0.5, "C_m": 0.5}):
        assert not any("airspeed" in sentence for sentence in notes(rows(**factors), []))
    uncertain = [replace(row, std_error=0.3 * abs(row.value)) for row in rows(C_X=0.265, C_Z=0.265, C_m=0.265)]
    assert not any("airspeed" in sentence for sentence in notes(uncertain, []))


@pytest.mark.parametrize(
    ("name", "factor", "words"),
    [
        ("C_m_alpha", math.degrees(1.0), "C_m alpha is 57.3 times the declared value: is it declared per degree?"),
        ("C_m_alpha", 56.0, "per degree"),
        ("C_m_q_hat", 2.0, "per q c/V"),
        ("C_Z_alpha", 10.0, "unit and decimal point"),
        ("C_Z_delta_e", -1.0, "C_Z delta_e has the opposite sign to the declared value"),
    ],
)
def test_a_single_derivative_is_told_with_its_factor(name: str, factor: float, words: str) -> None:
    (said,) = notes(rows(**{name: factor}), [])
    assert words in said


def test_what_the_record_does_not_show_is_not_asked() -> None:
    hidden = [replace(row, shown=False) for row in rows(C_m_alpha=57.3, C_Z=1.3)]
    assert notes(hidden, []) == ()


def test_a_derivative_that_contradicts_its_a_priori_deviation_is_told() -> None:
    aircraft = load_aircraft("light_transport")
    (derivative,) = [d for d in aircraft.derivatives if (d.coefficient, str(d.term)) == ("C_m", "alpha")]
    assert derivative.sigma is not None

    def told(value: float) -> tuple[str, ...]:
        row = DerivativeRow("C_m", "alpha", derivative.value, value, value, 0.01, 0.01, None, None, None, shown=True)
        return notes([row], [], aircraft)

    both = math.hypot(derivative.sigma, 0.01)
    (said,) = told(derivative.value - 6.0 * both)
    assert "contradicts its declared value" in said
    assert "by 6.0 standard deviations" in said
    assert told(derivative.value - 4.5 * both) == ()


def test_worse_on_its_own_data_is_said() -> None:
    def row(channel: str, before: float, after: float, role: str = "identification") -> ErrorRow:
        return ErrorRow("flight", role, channel, "rad", 1.0, before, after, after, 0.001)

    (said,) = notes([], [row("q", 0.01, 0.012), row("alpha", 0.02, 0.03)])
    assert "worse than the declared structure" in said
    assert "1.50 in alpha" in said
    assert notes([], [row("q", 0.01, 0.009), row("alpha", 0.02, 0.0201)]) == ()
    assert notes([], [row("q", 0.01, 0.03, "validation")]) == ()


def test_a_vague_factor_near_a_half_is_not_asked_after() -> None:
    for share, asked in ((0.02, True), (0.09, False)):
        off = [
            dataclasses.replace(row, std_error=share * abs(row.declared or 0.0)) if row.term == "q_hat" else row
            for row in rows(C_m_q_hat=0.55 if asked else 0.664)
        ]
        assert bool(notes(off, [])) is asked


def test_a_damping_that_shares_its_part_with_alphadot_is_not_asked_after_its_unit() -> None:
    """Half of the declared C_m q_hat in q_hat and half in alpha_dot_hat: their sum is as declared."""
    halved = rows(C_m_q_hat=0.5)
    assert any("converted from q c/V twice" in sentence for sentence in notes(halved, []))
    found = DerivativeRow("C_m", "alpha_dot_hat", None, None, -8.0, 0.2, 0.2, None, None, None, shown=True)
    assert notes([*halved, found], []) == ()


def test_a_control_that_is_turned_in_every_coefficient_is_said_once_with_the_remedy() -> None:
    (said,) = notes(rows(C_Z_delta_e=-1.0, C_m_delta_e=-0.9), [])
    assert said.startswith("delta_e has the opposite sign to the declared one in C_Z and C_m")
    assert "sign = -1" in said


def test_lift_of_the_other_sign_asks_where_the_accelerometer_is() -> None:
    """A unit 5 m ahead in the nose shows the pitching acceleration of its own place as a force."""
    aircraft = load_aircraft("citation")
    declared = {(d.coefficient, str(d.term)): d.value for d in aircraft.derivatives}
    lift, moment = declared["C_Z", "delta_e"], declared["C_m", "delta_e"]
    # Per q_bar, of one radian of elevator: pitching acceleration, what the unit shows of it, as a force coefficient.
    q_dot = aircraft.wing_area * aircraft.mean_chord * moment / aircraft.I_yy
    seen = lift + aircraft.mass * (-5.0 * q_dot) / aircraft.wing_area
    assert seen > 0.5
    a_z = ErrorRow("flight", "identification", "a_z", "m/s^2", 1.0, 0.1, 0.09, 0.09, 0.001)

    def told(name: str, value: float, given: float) -> tuple[str, ...]:
        table = [
            DerivativeRow("C_m", "delta_e", moment, moment, moment, 0.01, 0.01, None, None, None, shown=True),
            DerivativeRow(name, "delta_e", given, value, value, 0.02, 0.02, None, None, None, shown=True),
        ]
        return notes(table, [a_z], aircraft)

    for said in (told("C_Z", seen, lift), told("C_L", -seen, -lift)):
        assert len(said) == 1
        assert "has the opposite sign to the declared value" in said[0]
        assert "a_z measured 5.00 m ahead of its declared position" in said[0]
    # No aircraft reaches so far, and without the accelerometer there is nothing to ask.
    assert "accelerometer" not in told("C_Z", 10.0, lift)[0]
    hidden = [replace(a_z, channel="alpha")]
    rows_of = [DerivativeRow("C_Z", "delta_e", lift, seen, seen, 0.02, 0.02, None, None, None, shown=True)]
    assert "accelerometer" not in notes(rows_of, hidden, aircraft)[0]
