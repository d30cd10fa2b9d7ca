"""The aircraft file: what is read, what is refused, what is written back."""

from __future__ import annotations

import math
import os
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve
from strategies import aircraft_texts

from aerosid.aircraft import (
    Aircraft,
    CompletionRecord,
    DeclaredEffect,
    LogOfCompletion,
    bundled_aircraft,
    load_aircraft,
    save_aircraft,
    warnings_about,
)
from aerosid.aircraft.bundled import bundled_folder
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.cli.main import main
from aerosid.errors import AircraftError

SEPARATION = {"alpha_star": 0.31, "sharpness": 20.0, "delay": 0.1, "relaxation": 0.3}

GOOD = """\
# Header comment
schema = 1

[aircraft]
name = "Light transport"   # who
source = "test"

[reference]
wing_area = 23.23     # m^2
mean_chord = 1.5875
airspeed = 100.0

[mass]
mass = 2280           # an integer is a number too
I_yy = 6940.0

[air]
density = 0.9077

[thrust]
force = 5661.0
incidence = 0.02
z_arm = -0.3

[derivatives.C_X]
"1" = { value = -0.054, sigma = 0.004 }   # parasite drag
alpha = { value = 0.233 }

[derivatives.C_Z]
"alpha" = { value = -5.68 }

[derivatives.C_m]
"alpha*alpha" = { value = 0.0, fixed = true }
"delta_e" = { value = -1.94, sigma = 0.1 }

[[effects]]
kind = "control_lag"
where = "delta_e"
value = 0.15
std_error = 0.01

[[effects]]
kind = "flow_separation"
where = "C_Z"
[effects.parameters]
alpha_star = { value = 0.31, std_error = 0.01, unit = "rad" }
sharpness = { value = 20.0 }
delay = { value = 0.1 }
relaxation = { value = 0.3 }

[candidates]
C_m = ["alpha*delta_e", "pos(alpha - 0.2)^2", "alpha^2"]
"""


def _write(folder: Path, text: str) -> Path:
    path = folder / "craft.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _model(aircraft: Aircraft) -> tuple[object, ...]:
    """All that the text says, without the text."""
    return (
        aircraft.name, aircraft.source, aircraft.wing_area, aircraft.mean_chord, aircraft.airspeed, aircraft.mass,
        aircraft.I_yy, aircraft.density, aircraft.thrust, aircraft.thrust_incidence, aircraft.thrust_z_arm,
        aircraft.derivatives, aircraft.candidates, aircraft.effects,
    )  # fmt: skip


def test_every_key_is_read(tmp_path: Path) -> None:
    aircraft = load_aircraft(_write(tmp_path, GOOD))
    assert (aircraft.name, aircraft.source, aircraft.wing_area) == ("Light transport", "test", 23.23)
    assert (aircraft.mean_chord, aircraft.airspeed, aircraft.mass, aircraft.I_yy) == (1.5875, 100.0, 2280.0, 6940.0)
    assert (aircraft.density, aircraft.thrust) == (0.9077, 5661.0)
    assert (aircraft.thrust_incidence, aircraft.thrust_z_arm) == (0.02, -0.3)
    rows = [(e.coefficient, str(e.term), e.value, e.sigma, e.fixed) for e in aircraft.derivatives]
    assert rows == [
        ("C_X", "1", -0.054, 0.004, False),
        ("C_X", "alpha", 0.233, None, False),
        ("C_Z", "alpha", -5.68, None, False),
        ("C_m", "alpha^2", 0.0, None, True),
        ("C_m", "delta_e", -1.94, 0.1, False),
    ]
    assert {key: [str(t) for t in terms] for key, terms in aircraft.candidates.items()} == {
        "C_m": ["alpha*delta_e", "pos(alpha - 0.2)^2"]  # alpha^2 is declared
    }
    assert aircraft.effects == (
        DeclaredEffect("control_lag", "delta_e", 0.15, std_error=0.01),
        DeclaredEffect("flow_separation", "C_Z", parameters=SEPARATION),
    )
    assert aircraft.coefficients == ("C_X", "C_Z", "C_m")


def test_what_is_optional_may_be_missing(tmp_path: Path) -> None:
    text = """schema = 1
    aircraft = { name = "bare" }
    reference = { wing_area = 1, mean_chord = 1 }
    mass = { mass = 1, I_yy = 1 }
    derivatives = { C_L = {}, C_D = { "1" = { value = 0.1 } }, C_m = {} }
    """
    aircraft = load_aircraft(_write(tmp_path, text))
    assert (aircraft.airspeed, aircraft.density, aircraft.thrust, aircraft.source) == (None, None, None, "")
    assert aircraft.coefficients == ("C_D", "C_L", "C_m")


def _replaced(old: str, new: str) -> str:
    assert GOOD.count(old) >= 1, old
    return GOOD.replace(old, new, 1)


LIFT = '[derivatives.C_L]\n"1" = { value = 0.3 }\n'
DRAG = '[derivatives.C_D]\n"1" = { value = 0.03 }\n'

REFUSED = {
    "empty": ("", ["schema"]),
    "no toml": ("mass = = 3", ["TOML", "line 1"]),
    "key twice": (_replaced("wing_area", "mean_chord"), ["TOML", "line"]),
    "schema missing": (_replaced("schema = 1\n", ""), ["schema", "missing"]),
    "schema 1.0": (_replaced("schema = 1\n", "schema = 1.0\n"), ["schema", "1.0", "expected 1"]),
    "schema 2": (_replaced("schema = 1\n", "schema = 2\n"), ["schema", "2", "expected 1"]),
    "schema true": (_replaced("schema = 1\n", "schema = true\n"), ["schema", "true", "expected 1"]),
    "unknown key": (_replaced("mean_chord", "mean_cord"), ["reference.mean_cord", "did you mean mean_chord"]),
    "unknown table": (GOOD + "[wheels]\ncount = 3\n", ["wheels", "expected schema"]),
    "unknown key of a derivative": (
        _replaced("sigma = 0.1", "sgima = 0.1"),
        ["derivatives.C_m.delta_e.sgima", "sigma"],
    ),
    "unknown coefficient": (GOOD + '[derivatives.C_q]\n"1" = { value = 1.0 }\n', ["derivatives.C_q", "C_X"]),
    "lateral coefficient alone": (
        GOOD + '[derivatives.C_n]\n"1" = { value = 1.0 }\n',
        ["derivatives.C_Y", "missing", "C_l, C_n"],
    ),
    "rate without span": (_replaced('"delta_e" =', '"p_hat" ='), ["reference.span [m]", "missing"]),
    "missing table": (
        _replaced("[mass]\nmass = 2280           # an integer is a number too\nI_yy = 6940.0\n", ""),
        ["table mass", "missing"],
    ),
    "missing key": (_replaced("I_yy = 6940.0\n", ""), ["mass.I_yy", "kg m^2", "missing"]),
    "value missing": (_replaced("{ value = 0.233 }", "{ sigma = 0.1 }"), ["derivatives.C_X.alpha.value", "missing"]),
    "negative mass": (_replaced("mass = 2280", "mass = -2280"), ["mass.mass", "-2280", "positive", "kg"]),
    "zero chord": (_replaced("1.5875", "0.0"), ["reference.mean_chord", "positive", " m "]),
    "text for a number": (_replaced("mass = 2280 ", 'mass = "2280 m" '), ["mass.mass", "'2280 m'", "number in kg"]),
    "truth for a number": (_replaced("density = 0.9077", "density = true"), ["air.density", "true", "number"]),
    "number for a text": (_replaced('source = "test"', "source = 3"), ["aircraft.source", "3", "text"]),
    "number for a table": (_replaced("{ value = 0.233 }", "0.233"), ["derivatives.C_X.alpha", "{ value"]),
    "number for truth": (_replaced("fixed = true", "fixed = 1"), ["fixed", "true or false"]),
    "nan": (_replaced("5661.0", "nan"), ["thrust.force", "nan", "finite"]),
    "inf": (_replaced("-5.68", "-inf"), ["derivatives.C_Z.alpha.value", "inf", "finite"]),
    "beyond doubles": (_replaced("2280 ", "1" + "0" * 400 + " "), ["mass.mass"]),
    "absurd size": (_replaced("2280 ", "1e300 "), ["mass.mass", "1e+300"]),
    "sigma zero": (_replaced("sigma = 0.1", "sigma = 0.0"), ["derivatives.C_m.delta_e.sigma", "positive"]),
    "sigma negative": (_replaced("sigma = 0.1", "sigma = -0.1"), ["derivatives.C_m.delta_e.sigma", "-0.1", "positive"]),
    "incidence in degrees": (_replaced("incidence = 0.02", "incidence = 3.0"), ["thrust.incidence", "rad"]),
    "term twice": (_replaced('"delta_e" =', '"alpha^2" ='), ["derivatives.C_m", "alpha^2", '"alpha*alpha"', "twice"]),
    "term of answers": (_replaced('"delta_e" =', '"V" ='), ["derivatives.C_m", "V_hat"]),
    "term is code": (
        _replaced('"delta_e" =', "\"__import__('os').system('true')\" ="),
        ["derivatives.C_m", "cannot be read"],
    ),
    "term 3000 deep": (
        _replaced('"delta_e" =', '"' + "(" * 3000 + ")" * 3000 + '" ='),
        ["derivatives.C_m", "6000 characters"],
    ),
    "toml 3000 deep": (GOOD + "x = " + "[" * 3000 + "]" * 3000 + "\n", ["nest"]),
    "candidate is code": (_replaced('"alpha*delta_e"', '"exec(1)"'), ["candidates.C_m", "cannot be read"]),
    "candidate is a number": (_replaced('"alpha*delta_e"', "3"), ["candidates.C_m[1]", "text"]),
    "candidate twice": (_replaced('"alpha*delta_e"', '"alpha*alpha"'), ["candidates.C_m", "twice"]),
    "candidates no list": (_replaced("C_m = [", "C_Z = 3\nC_m = ["), ["candidates.C_Z", "list"]),
    "candidate of another coefficient": (GOOD + 'C_L = ["alpha^2"]\n', ["candidates.C_L", "C_X, C_Z, C_m"]),
    "lift beside normal force": (GOOD + LIFT, ["C_Z", "C_L", "remove one"]),
    "drag beside axial force": (GOOD + DRAG, ["C_X", "C_D", "remove one"]),
    "lift without drag": (_replaced("[derivatives.C_Z]", "[derivatives.C_L]"), ["derivatives.C_D", "missing"]),
    "lift and drag empty": (
        GOOD[: GOOD.index("[derivatives.C_X]")] + "[derivatives]\nC_L = {}\nC_D = {}\nC_m = {}\n",
        ["derivatives.C_L", "both empty"],
    ),
    "no moment": (_replaced("[derivatives.C_m]", "[derivatives.C_Q]"), ["derivatives.C_Q"]),
    "no moment at all": (GOOD[: GOOD.index("[derivatives.C_m]")], ["derivatives.C_m", "missing"]),
    "unknown effect": (_replaced('"control_lag"', '"control_lagg"'), ["effects[1].kind", "did you mean control_lag"]),
    "effect that is a term": (_replaced('"control_lag"', '"aero_term"'), ["effects[1].kind", "[derivatives"]),
    "effect elsewhere": (_replaced('where = "delta_e"', 'where = "q"'), ["effects[1].where", "'q'", "delta_e"]),
    "effect nowhere": (_replaced('where = "delta_e"', 'where = ""'), ["effects[1].where"]),
    "effect of another coefficient": (
        _replaced('where = "C_Z"', 'where = "C_L"'),
        ["effects[2].where", "C_X, C_Z, C_m"],
    ),
    "effect without number": (_replaced("value = 0.15\n", ""), ["effects[1]", "value"]),
    "negative lag": (_replaced("value = 0.15\n", "value = -0.15\n"), ["effects[1].value", "-0.15"]),
    "unknown key of an effect": (_replaced("std_error = 0.01\n", "error = 0.01\n"), ["effects[1].error", "unknown"]),
    "effects as one table": (
        GOOD[: GOOD.index("[[effects]]")] + '[effects]\nkind = "gust"\n',
        ["effects", "[[effects]]"],
    ),
    "wrong term of an effect": (_replaced("value = 0.15\n", 'value = 0.15\nterm = "2*alpha"\n'), ["effects[1].term"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_wrong_file_is_refused_with_one_sentence(case: str, tmp_path: Path) -> None:
    text, told = REFUSED[case]
    path = _write(tmp_path, text)
    with pytest.raises(AircraftError) as caught:
        load_aircraft(path)
    sentence = str(caught.value)
    for word in (str(path), *told):
        assert word in sentence
    assert sentence.isprintable()
    assert len(sentence.removeprefix(str(path))) < 450
    assert caught.value.exit_code == 2


def test_what_is_no_aircraft_file_is_refused(tmp_path: Path) -> None:
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)))
    large = tmp_path / "large.toml"
    large.write_text("# " + "x" * 1_100_000)
    for path, told in (
        (binary, "no UTF-8"),
        (large, "larger than"),
        (tmp_path, "a folder"),
        (tmp_path / "missing.toml", "not found"),
        (tmp_path / "name\0.toml", "no file name"),
        (tmp_path / ("x" * 300 + ".toml"), "cannot be read"),
        (Path("no_such_aircraft"), "light_transport"),
    ):
        with pytest.raises(AircraftError, match=told) as caught:
            load_aircraft(path)
        assert str(caught.value).isprintable()


def test_a_byte_order_mark_is_no_matter(tmp_path: Path) -> None:
    path = tmp_path / "craft.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load_aircraft(path).mass == 2280.0


def test_completing_keeps_comments_and_layout(tmp_path: Path) -> None:
    given_aircraft = load_aircraft(_write(tmp_path, GOOD))
    completed = given_aircraft.completed(
        {
            ("C_X", "1"): (-0.0512345678901234, 0.00123456789),
            ("C_X", "alpha * alpha"): (3.6, 0.02),
            ("C_m", "delta_e"): (-1.9, None),
            ("C_m", "alpha^2"): (9.0, 1.0),  # fixed
        },
        [DeclaredEffect("control_lag", "delta_e", 0.2), DeclaredEffect("sensor_bias", "a_x", -0.11, std_error=0.01)],
    )
    kept = [line for line in GOOD.splitlines() if "#" in line and "parasite" not in line]
    assert [line for line in kept if line not in completed.text.splitlines()] == []
    # What was said of a number that went is no longer true beside the new one.
    assert '"1" = { value = -0.0512345678901, sigma = 0.00123457 } # declared -0.054' in completed.text
    assert "parasite" not in completed.text
    assert '"alpha^2" = { value = 3.6, sigma = 0.02 } # found by aerosid' in completed.text
    values = {(e.coefficient, str(e.term)): (e.value, e.sigma) for e in completed.derivatives}
    assert values["C_X", "alpha^2"] == (3.6, 0.02)
    assert values["C_m", "delta_e"] == (-1.9, None)
    assert values["C_m", "alpha^2"] == (0.0, None)
    assert [(e.kind, e.value) for e in completed.effects] == [
        ("control_lag", 0.2),
        ("flow_separation", None),
        ("sensor_bias", -0.11),
    ]
    assert _model(given_aircraft) == _model(load_aircraft(tmp_path / "craft.toml"))  # and the given one is untouched


BARE = 'schema = 1\n[aircraft]\nname = "x"\n[reference]\nwing_area = 1\nmean_chord = 1\n[mass]\nmass = 1\nI_yy = 1\n'
ODD_LAYOUTS = {
    "tables out of order": "[derivatives.C_X]\n1 = { value = 1 } # note\n"
    + BARE.removeprefix("schema = 1\n")
    + "[derivatives.C_Z]\n[air]\ndensity = 1\n[derivatives.C_m]\n",
    "tables of entries": BARE
    + "[derivatives.C_X.alpha]\nvalue = 1 # note\nsigma = 2\n[derivatives.C_Z]\n[derivatives.C_m.1]\nvalue = 3\n",
    "dotted keys": BARE + "[derivatives]\nC_X.alpha.value = 1 # note\nC_Z = {}\nC_m.1.value = 3\n",
    "dotted keys at the top": "derivatives.C_X.alpha.value = 1 # note\nderivatives.C_Z = {}\nderivatives.C_m = {}\n"
    + BARE,
    "all in one line": "derivatives = { C_X = {}, C_Z = {}, C_m = { 1 = { value = 3 } } } # note\n" + BARE,
    "a list of effects": 'effects = [\n  { kind = "control_lag", where = "delta_e", value = 1 }, # note\n]\n'
    + BARE
    + "[derivatives]\nC_X = {}\nC_Z = {}\nC_m = {}\n",
    "no effects, said so": "effects = [] \n" + BARE + "[derivatives]\nC_X = {} # note\nC_Z = {}\nC_m = {}\n",
    "no last line feed": BARE + "[derivatives] # note\nC_X = {}\nC_Z = {}\n[derivatives.C_m]\n1 = { value = 3 }",
}


@pytest.mark.parametrize("layout", ODD_LAYOUTS)
def test_every_legal_layout_can_be_completed(layout: str, tmp_path: Path) -> None:
    text = ODD_LAYOUTS[layout] if layout != "tables out of order" else "schema = 1\n" + ODD_LAYOUTS[layout]
    values = {("C_X", "alpha"): (1.5, 0.1), ("C_Z", "alpha^2"): (2.5, 0.2), ("C_m", "1"): (3.5, None)}
    effects = [DeclaredEffect("control_lag", "delta_e", 0.2), DeclaredEffect("sensor_lag", "alpha", 0.3)]
    save_aircraft(load_aircraft(_write(tmp_path, text)).completed(values, effects), tmp_path / "completed.toml")
    loaded = load_aircraft(tmp_path / "completed.toml")
    got = {(e.coefficient, str(e.term)): (e.value, e.sigma) for e in loaded.derivatives}
    assert got.items() >= values.items()
    assert loaded.effects == tuple(effects)
    stale = layout in ("tables of entries", "dotted keys", "dotted keys at the top")
    assert ("# note" in loaded.text, "# declared 1" in loaded.text) == (not stale, stale)


def test_completing_with_nothing_changes_no_byte(tmp_path: Path) -> None:
    aircraft = load_aircraft(_write(tmp_path, GOOD))
    assert aircraft.completed({}).text == GOOD


def test_completing_refuses_what_does_not_fit(tmp_path: Path) -> None:
    aircraft = load_aircraft(_write(tmp_path, GOOD))
    with pytest.raises(AircraftError, match="C_L does not fit"):
        aircraft.completed({("C_L", "alpha"): (5.0, 0.1)})
    with pytest.raises(AircraftError, match="finite"):
        aircraft.completed({("C_m", "alpha"): (math.nan, 0.1)})


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(
    text=aircraft_texts(),
    found=st.dictionaries(
        st.tuples(st.integers(0, 2), st.sampled_from(["1", "alpha", "alpha^2", "delta_e*alpha", "pos(alpha - 0.2)"])),
        st.tuples(st.floats(-1e6, 1e6), st.one_of(st.none(), st.floats(0.0, 1e3))),
        max_size=5,
    ),
    lag=st.one_of(st.none(), st.floats(0.0, 1.0)),
)
def test_the_written_file_loads_as_the_same_model(
    tmp_path: Path, text: str, found: dict[tuple[int, str], tuple[float, float | None]], lag: float | None
) -> None:
    aircraft = load_aircraft(_write(tmp_path, text))
    values = {(aircraft.coefficients[place], term): pair for (place, term), pair in found.items()}
    effects = [] if lag is None else [DeclaredEffect("control_lag", "delta_e", lag)]
    completed = aircraft.completed(values, effects)
    save_aircraft(completed, tmp_path / "completed.toml")
    loaded = load_aircraft(tmp_path / "completed.toml")
    assert _model(loaded) == _model(completed)
    assert loaded.sha256 == completed.sha256

    # what must have come out, kept by hand: a plain dictionary from the file by tomllib and the values over it
    fixed = {(e.coefficient, str(e.term)) for e in aircraft.derivatives if e.fixed}
    expected = {(e.coefficient, str(e.term)): (e.value, e.sigma) for e in aircraft.derivatives}
    for (coefficient, term), (value, sigma) in values.items():
        key = (coefficient, "alpha*delta_e" if term == "delta_e*alpha" else term)
        if key not in fixed:
            expected[key] = (value, sigma)
    got = {(e.coefficient, str(e.term)): (e.value, e.sigma) for e in loaded.derivatives}
    assert got.keys() == expected.keys()
    for key, (value, sigma) in expected.items():
        assert got[key][0] == pytest.approx(value, rel=1e-11, abs=0.0)
        assert got[key][1] == (None if sigma is None else pytest.approx(max(sigma, 1e-12), rel=1e-5))
    assert [c for c in ("# a comment of the engineer", "# m^2", "# why C_m") if c not in completed.text] == []
    if lag is not None:
        assert [e.value for e in loaded.effects] == [pytest.approx(lag, rel=1e-11)]
    tomllib.loads(completed.text)


def test_writing_leaves_nothing_half_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    aircraft = load_aircraft(_write(tmp_path, GOOD))
    with pytest.raises(AircraftError, match="cannot be written"):
        save_aircraft(aircraft, tmp_path / "no_such_folder" / "completed.toml")
    folder = tmp_path / "taken.toml"
    folder.mkdir()  # a folder stands where the file should go, so that the last step fails
    with pytest.raises(AircraftError, match="cannot be written"):
        save_aircraft(aircraft, folder)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["craft.toml", "taken.toml"]
    monkeypatch.chdir(tmp_path)
    save_aircraft(aircraft, "here.toml")
    assert Path("here.toml").read_bytes() == GOOD.encode()
    mask = os.umask(0)
    os.umask(mask)
    assert Path("here.toml").stat().st_mode & 0o777 == 0o666 & ~mask


BUNDLED = ("attas", "citation", "hfb320", "light_transport", "navion", "twin_otter")


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_aircraft_load_by_name_and_look_like_aircraft(name: str) -> None:
    aircraft = load_aircraft(name)
    assert aircraft.source
    # nothing is unusual; that the log has to give the thrust is said and is meant
    assert [warning for warning in warnings_about(aircraft) if "thrust.force is not given" not in warning] == []
    assert aircraft.completed({}).text == aircraft.text


def test_the_list_of_bundled_aircraft_is_complete() -> None:
    assert tuple(bundled_aircraft()) == BUNDLED


def test_the_template_is_a_legal_aircraft_that_names_every_key() -> None:
    path = bundled_folder("aircraft_models") / "_template.toml"
    aircraft = load_aircraft(path)
    assert warnings_about(aircraft) == ()
    # with its commented lines taken in, lift and drag apart, which stand in place of others
    lines = aircraft.text.splitlines()
    start = lines.index("# [[effects]]")
    inside = [line.removeprefix("# ") if number >= start else line for number, line in enumerate(lines)]
    inside = [line for line in inside if not line.startswith("Terms to screen")]
    assert tomllib.loads("\n".join(inside)).keys() >= {"effects", "candidates"}


SIDE_OF_THE_TEMPLATE = (
    "span",
    "I_xx",
    "I_zz",
    "I_xz",
    "[derivatives.C_Y]",
    "[derivatives.C_l]",
    "[derivatives.C_n]",
    '"',
)


def test_the_template_with_its_lateral_lines_taken_in_is_an_aircraft_in_six_axes() -> None:
    lines = load_aircraft(bundled_folder("aircraft_models") / "_template.toml").text.splitlines()
    wind = lines.index("# Lift and drag may be declared in place of C_Z and C_X, both together:")
    inside = [
        line.removeprefix("# ") if n < wind and line.removeprefix("# ").startswith(SIDE_OF_THE_TEMPLATE) else line
        for n, line in enumerate(lines)
    ]
    aircraft = aircraft_from_text("\n".join(inside) + "\n", "template.toml", "0" * 64)
    assert aircraft.axes.name == "six degrees of freedom"
    assert set(aircraft.coefficients) == {"C_X", "C_Y", "C_Z", "C_l", "C_m", "C_n"}


def _coefficient(aircraft: Aircraft, coefficient: str, further: dict[str, float], given: dict[str, float]) -> float:
    """The sum value * term for the plain terms of the light transport."""
    rows = {str(e.term): e.value for e in aircraft.derivatives if e.coefficient == coefficient} | further
    terms = {"1": 1.0, "alpha^2": given["alpha"] ** 2, "q_hat": 0.0} | given
    return sum(value * terms[term] for term, value in rows.items())


def test_the_light_transport_trims_at_its_reference_speed_with_the_terms_it_lacks() -> None:
    aircraft = load_aircraft("light_transport")
    pressure = 0.5 * aircraft.density * aircraft.airspeed**2 * aircraft.wing_area
    weight = aircraft.mass * 9.80665

    def unbalanced(unknown: np.ndarray) -> list[float]:
        alpha, elevator, thrust = unknown
        at = {"alpha": alpha, "delta_e": elevator}
        return [
            _coefficient(aircraft, "C_X", {"alpha^2": 3.6089}, at) * pressure / weight + thrust - np.sin(alpha),
            _coefficient(aircraft, "C_Z", {}, at) * pressure / weight + np.cos(alpha),
            _coefficient(aircraft, "C_m", {"alpha^2": -1.715}, at),
        ]

    alpha, elevator, thrust = fsolve(unbalanced, [0.0, 0.0, 0.2])
    assert thrust * weight == pytest.approx(aircraft.thrust, abs=0.01)
    assert f"alpha = {alpha:.5f} rad, delta_e = {elevator:.5f} rad" in aircraft.text


@pytest.mark.parametrize(
    ("added", "told"),
    [
        ("[noise]\nalpha = -1\n", "noise.alpha is -1, expected a number greater than 0; correct it"),
        ("[fuel]\nused = []\n", "fuel.used is a list, expected a list of at least 2 entries, not 0"),
    ],
)
def test_a_number_or_a_list_out_of_range_is_told_its_bound(added: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "aircraft.toml"
    path.write_text((bundled_folder("aircraft_models") / "light_transport.toml").read_text() + "\n" + added)
    with pytest.raises(AircraftError) as refused:
        load_aircraft(path)
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("mass = 2280 ", "mass = 2.28 ", "wing loading"),
        ("wing_area = 23.23", "wing_area = 2.5", "aspect ratio"),
        ("I_yy = 6940.0", "I_yy = 694000.0", "I_yy/"),
        ("airspeed = 100.0", "airspeed = 2.0", "airspeed"),
        ('"delta_e" = { value = -1.94', '"delta_e" = { value = 1.94', "C_m delta_e"),
        ('"delta_e" = { value = -1.94', '"q_hat" = { value = 16.0', "C_m q_hat"),
        ('"delta_e" = { value = -1.94', '"q_hat" = { value = -1.0', "doubled"),
        ('"delta_e" = { value = -1.94', '"alpha" = { value = 0.9', "unstable"),
        ("value = -5.68", "value = 5.68", "C_Z alpha"),
        ("[air]\ndensity = 0.9077\n", "", "rho or q_bar"),
        ("force = 5661.0\n", "", "thrust channel"),
        ("[mass]", '[[effects]]\nkind = "sensor_scale"\nwhere = "alpha"\nvalue = 1000.0\n\n[mass]', "from 0.2 to 5"),
        ("[mass]", '[[effects]]\nkind = "control_lag"\nwhere = "delta_e"\nvalue = 1e9\n\n[mass]', "close-loop refuses"),
        ("[mass]", '[[effects]]\nkind = "control_lag"\nwhere = "delta_f"\nvalue = 0.1\n\n[mass]', "acts on delta_f"),
    ],
)
def test_unusual_numbers_are_warned_of(old: str, new: str, told: str, tmp_path: Path) -> None:
    assert warnings_about(load_aircraft(_write(tmp_path, GOOD))) == ()
    warnings = warnings_about(load_aircraft(_write(tmp_path, _replaced(old, new))))
    assert [warning for warning in warnings if told in warning]


def test_the_command_lists_the_bundled_aircraft(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["aircraft", "list"]) == 0
    printed = capsys.readouterr().out
    assert [name for name in BUNDLED if name not in printed] == []


def test_the_command_shows_what_was_understood(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _write(tmp_path, _replaced('"delta_e" = { value = -1.94', '"delta_e" = { value = 1.94'))
    assert main(["aircraft", "check", str(path), "light_transport"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    for word in ("23.23 m^2", "6940 kg m^2", "alpha^2", "no, fixed", "control lag delta_e 0.15", "alpha_star = 0.31"):
        assert word in printed
    assert printed.count(" check: ") == 1
    assert "nothing unusual" in printed


def test_the_command_says_in_one_line_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _write(tmp_path, _replaced("mass = 2280", "mass = -2280"))
    assert main(["aircraft", "check", "light_transport", str(path)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert "mass.mass is -2280" in told.err


SOURCED = GOOD.replace('"1" = {', '# measured in the tunnel of 1978\n"1" = {', 1)
RECORD = CompletionRecord(
    program="aerosid 0.1.0",
    date="2026-11-22",
    verdict="partly_explained",
    declared_file="craft.toml",
    declared_sha256="a" * 64,
    declared_source="test",
    logs=(
        LogOfCompletion('dou"blet.csv', "identification", "b" * 64, 3.0, 12.5),
        LogOfCompletion("other.csv", "hold_out", "c" * 64, 0.0, 9.0),
    ),
    settings={"priors": "True", "attribution.price": "9.0"},
    not_shown=("C_m delta_e",),
    bounds="one standard error",
)


def test_a_completed_file_says_what_made_it_and_what_is_not_shown(tmp_path: Path) -> None:
    given_aircraft = load_aircraft(_write(tmp_path, SOURCED))
    values = {("C_X", "1"): (-0.05, 0.001)}
    completed = given_aircraft.completed(values, (), [("C_m", "delta_e")], RECORD)
    save_aircraft(completed, tmp_path / "completed.toml")
    loaded = load_aircraft(tmp_path / "completed.toml")
    assert loaded.completion == RECORD
    assert tomllib.loads(loaded.text)["completed"]["logs"][0]["sha256"] == "b" * 64
    declared = {(e.coefficient, str(e.term)): e for e in given_aircraft.derivatives}
    for entry in loaded.derivatives:
        key = entry.coefficient, str(entry.term)
        assert entry.shown is (key != ("C_m", "delta_e"))
        wanted = (-0.05, 0.001) if key == ("C_X", "1") else (declared[key].value, declared[key].sigma)
        assert (entry.value, entry.sigma) == wanted
    assert "tunnel" not in loaded.text
    for word in ("aerosid 0.1.0", "2026-11-22", 'dou"blet.csv', "craft.toml", "C_m delta_e", "test"):
        assert word in loaded.source
    # A second time: another record takes the first one's place, and what is shown now is no longer marked.
    again = loaded.completed({("C_m", "delta_e"): (-1.9, 0.1)}, (), (), replace(RECORD, not_shown=()))
    assert again.text.count("[completed]") == 1
    assert all(entry.shown for entry in again.derivatives)


@pytest.mark.parametrize("layout", ODD_LAYOUTS)
def test_what_is_not_shown_is_marked_in_every_layout(layout: str, tmp_path: Path) -> None:
    text = ODD_LAYOUTS[layout] if layout != "tables out of order" else "schema = 1\n" + ODD_LAYOUTS[layout]
    given_aircraft = load_aircraft(_write(tmp_path, text))
    keys = [(entry.coefficient, str(entry.term)) for entry in given_aircraft.derivatives]
    completed = given_aircraft.completed({}, (), keys, RECORD)
    assert [entry.value for entry in completed.derivatives] == [entry.value for entry in given_aircraft.derivatives]
    assert not any(entry.shown for entry in completed.derivatives)
    assert completed.completion == RECORD
