"""Numbers with units: the same notation in options and in aircraft files."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aerosid.aircraft.quantities import per_term
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.cli.main import main
from aerosid.errors import AircraftError
from aerosid.logs.formats.quantity import read_quantity
from aerosid.logs.formats.units import UnitProblem

FOOT, POUND, KNOT = 0.3048, 0.45359237, 1852.0 / 3600.0
SLUG = POUND * 9.80665 / FOOT


@pytest.mark.parametrize(
    ("text", "unit", "wanted"),
    [
        ("0.06", "rad", 0.06),
        ("3.5deg", "rad", math.radians(3.5)),
        ("180 kt", "m/s", 180.0 * KNOT),
        ("5000ft", "m", 5000.0 * FOOT),
        ("-2.5e-1 min", "s", -15.0),
        ("250 ft^2", "m^2", 250.0 * FOOT**2),
        ("5000 lb", "kg", 5000.0 * POUND),
        ("5120 slug ft^2", "kg m^2", 5120.0 * SLUG * FOOT**2),
        ("0.0023769 slug/ft^3", "kg/m^3", 0.0023769 * SLUG / FOOT**3),
        ("1200 lbf", "N", 1200.0 * POUND * 9.80665),
        ("-0.0127 1/deg", "1/rad", -0.0127 * 180.0 / math.pi),
        ("1e-4 1/deg^2", "1/rad^2", 1e-4 * (180.0 / math.pi) ** 2),
    ],
)
def test_a_number_with_its_unit(text: str, unit: str, wanted: float) -> None:
    assert read_quantity(text, unit) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(
    "text", ["", "deg", "1 2", "1 parsec", "1 kg", "nan", "inf", "0x10", "1e999", "1__0", "9" * 99]
)
def test_what_is_no_such_quantity_is_refused(text: str) -> None:
    with pytest.raises(UnitProblem):
        read_quantity(text, "rad")


@given(st.floats(-1e6, 1e6, allow_nan=False))
def test_a_bare_number_is_itself(value: float) -> None:
    assert read_quantity(repr(value), "m/s") == value


SI = """schema = 1
[aircraft]
name = "x"
[reference]
wing_area = {area}
mean_chord = {chord}
airspeed = {speed}
[mass]
mass = {mass}
I_yy = {inertia}
[thrust]
incidence = {angle}
[limits]
alpha = {limit}
[derivatives.C_X]
[derivatives.C_Z]
"alpha" = {{ value = {slope}, sigma = {sigma} }}
[derivatives.C_m]
"q_hat" = {{ value = {damping} }}
"alpha^2" = {{ value = {bend} }}
"""
PLAIN = {
    "area": 250.0 * FOOT**2,
    "chord": 5.0 * FOOT,
    "speed": 180.0 * KNOT,
    "mass": 5000.0 * POUND,
    "inertia": 5120.0 * SLUG * FOOT**2,
    "angle": math.radians(2.0),
    "limit": [math.radians(-2.0), 0.2],
    "slope": -0.1 * 180.0 / math.pi,
    "sigma": 0.01 * 180.0 / math.pi,
    "damping": -16.0,
    "bend": -1e-3 * (180.0 / math.pi) ** 2,
}
WORDS = {
    "area": '"250 ft^2"',
    "chord": '"5 ft"',
    "speed": '"180 kt"',
    "mass": '"5000 lb"',
    "inertia": '"5120 slug ft^2"',
    "angle": '"2 deg"',
    "limit": '["-2 deg", 0.2]',
    "slope": '"-0.1 1/deg"',
    "sigma": '"0.01 1/deg"',
    "damping": "-16.0",
    "bend": '"-1e-3 1/deg^2"',
}


def test_an_aircraft_file_in_imperial_units_is_the_same_aircraft() -> None:
    one, two = (aircraft_from_text(SI.format(**numbers), "x.toml", "") for numbers in (PLAIN, WORDS))
    for name in ("wing_area", "mean_chord", "airspeed", "mass", "I_yy", "thrust_incidence"):
        assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-9)
    assert two.limits["alpha"] == pytest.approx(one.limits["alpha"])
    for a, b in zip(one.derivatives, two.derivatives, strict=True):
        assert (b.coefficient, b.term, b.value) == (a.coefficient, a.term, pytest.approx(a.value, rel=1e-9))
        assert (a.sigma is None) == (b.sigma is None)
        assert (b.sigma or 0.0) == pytest.approx(a.sigma or 0.0)
    completed = two.completed({("C_Z", "alpha"): (-5.5, 0.1)})
    assert next(d.value for d in completed.derivatives if d.coefficient == "C_Z") == -5.5


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("mass", '"5000 ft"', "mass.mass"),
        ("speed", '"fast"', "reference.airspeed"),
        ("slope", '"-5 1/m"', "derivatives.C_Z.alpha.value"),
        ("damping", '"-16 1/deg"', "derivatives.C_m.q_hat.value"),
        ("limit", '["-2 kg", 0.2]', "limits.alpha"),
    ],
)
def test_a_wrong_unit_names_file_and_key(key: str, text: str, message: str) -> None:
    with pytest.raises(AircraftError, match=r"x\.toml") as caught:
        aircraft_from_text(SI.format(**(WORDS | {key: text})), "x.toml", "")
    assert message in str(caught.value)


def test_the_unit_of_a_derivative_follows_from_its_term() -> None:
    assert per_term("alpha") == "1/rad"
    assert per_term("alpha*delta_e") == "1/rad^2"
    assert per_term("alpha^2*q_hat*mach") == "1/rad^2"
    assert per_term("1") == per_term("V_hat") == "1"


def test_an_option_takes_degrees_and_refuses_feet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", "light_transport", "--format", "jsbsim", "--airspeed"]
    texts = []
    for airspeed in ("100.0", f"{100.0 / KNOT!r}kt"):
        assert main([*words, airspeed]) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1]
    assert main([*words, "100 ft"]) == 2
    error = capsys.readouterr().err
    assert "--airspeed" in error
    assert "See `aerosid export --help`." in error
