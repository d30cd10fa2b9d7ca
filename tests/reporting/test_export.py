"""Exported models, read back by code independent of the writers."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from oracles.daveml import DAVEML, check_structure, evaluate, failed_checks
from oracles.terms import term_by_tree
from problems import BODY_POLAR, LIFT_AND_DRAG, LIGHT, POLAR, declaring

from aerosid.aircraft import Aircraft, CompletionRecord, DeclaredEffect, LogOfCompletion
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.cli.main import main
from aerosid.errors import AerosidError
from aerosid.flight_model.terms import parse_term
from aerosid.reporting.export import FORMATS, ExportOptions, export
from aerosid.reporting.export.jsbsim_xml import aerodynamics_xml
from aerosid.reporting.export.options import NOT_SHOWN

RICH = declaring(
    LIGHT,
    {
        ("C_X", "delta_e^2*mach"): -0.4,
        ("C_X", "C_T"): 0.3,
        ("C_Z", "V_hat*alpha"): 1.7,
        ("C_Z", "abs(q_hat)*delta_e"): 2.9,
        ("C_Z", "pos(alpha - 0.05)^3"): 21.0,
        ("C_Z", "pos(alpha + 0.05)^3"): -3.0,
        ("C_Z", "alpha_dot_hat"): -3.1,
        ("C_m", "alpha*delta_e"): -2.3,
        ("C_m", "ice*abs(alpha)"): 0.7,
        ("C_m", "rho"): 0.011,
    },
)
AIRCRAFT = {
    "declared": LIGHT,
    "rich": RICH,
    "no U0": replace(RICH, airspeed=None),
    "lift and drag": LIFT_AND_DRAG,
    "polar": POLAR,
    "polar in body axes": BODY_POLAR,
    "empty coefficient": replace(LIGHT, derivatives=tuple(d for d in LIGHT.derivatives if d.coefficient != "C_X")),
}
OPTIONS = ExportOptions(date="2024-02-29")
HOSTILE = 'A & B <i>"x"</i> 100% $\\_{}^~# --> \x01 \u00e4\u00f6'


def options_for(aircraft: Aircraft) -> ExportOptions:
    return replace(OPTIONS, airspeed=95.0) if aircraft.airspeed is None else OPTIONS


def daveml(aircraft: Aircraft, options: ExportOptions | None = None) -> ET.Element:
    return ET.fromstring(export(aircraft, "davem", options or options_for(aircraft)).text)


def with_effects(*effects: DeclaredEffect) -> Aircraft:
    return replace(LIGHT, effects=effects)


def oracle_coefficients(aircraft: Aircraft, given: dict[str, float], reference: float) -> dict[str, float]:
    half = aircraft.mean_chord / (2.0 * (aircraft.airspeed or given["V"]))
    pressure = 0.5 * given["rho"] * given["V"] ** 2
    variables = given | {
        "q_hat": given["q"] * half,
        "alpha_dot_hat": given["alpha_dot"] * half,
        "V_hat": given["V"] / reference - 1.0,
        "C_T": given["thrust"] / (pressure * aircraft.wing_area),
    }
    sums = dict.fromkeys(aircraft.coefficients, 0.0)
    for entry in sorted(aircraft.derivatives, key=lambda entry: entry.coefficient not in ("C_L", "C_Z")):
        sums[entry.coefficient] += entry.value * term_by_tree(str(entry.term), variables | sums)
    return sums


@pytest.mark.parametrize("name", AIRCRAFT)
def test_daveml_has_the_published_structure_and_passes_its_own_check_cases(name: str) -> None:
    root = daveml(AIRCRAFT[name])
    check_structure(root)
    assert len(list(root.iter(f"{DAVEML}staticShot"))) >= 5
    assert failed_checks(root) == []


@pytest.mark.parametrize("name", AIRCRAFT)
def test_daveml_computes_the_terms_that_the_file_declares(name: str) -> None:
    aircraft, generator = AIRCRAFT[name], np.random.default_rng(3)
    root = daveml(aircraft)
    names = ("alpha", "q", "alpha_dot", "theta", "delta_e", "mach", "ice")
    for _ in range(20):
        given = dict(zip(names, generator.uniform(-0.2, 0.2, len(names)).tolist(), strict=True))
        given |= {"V": 60.0 + 80.0 * generator.random(), "rho": 0.5 + generator.random(), "thrust": 4000.0}
        values = evaluate(root, given)
        wanted = oracle_coefficients(aircraft, given, aircraft.airspeed or 95.0)
        for coefficient, value in wanted.items():
            assert values[coefficient] == pytest.approx(value, rel=1e-12, abs=1e-14)
        if "C_L" in wanted:
            sine, cosine = math.sin(given["alpha"]), math.cos(given["alpha"])
            assert values["C_X"] == pytest.approx(wanted["C_L"] * sine - wanted["C_D"] * cosine, rel=1e-12)
            assert values["C_Z"] == pytest.approx(-wanted["C_L"] * cosine - wanted["C_D"] * sine, rel=1e-12)


def test_check_cases_notice_every_derivative() -> None:
    root = daveml(RICH)
    constants = [v for v in root.iter(f"{DAVEML}variableDef") if v.find(f"{DAVEML}provenanceRef") is not None]
    assert len(constants) == len(RICH.derivatives)
    for variable in constants:
        right = variable.attrib["initialValue"]
        variable.set("initialValue", repr(float(right) * 1.001))
        assert failed_checks(root), variable.get("varID")
        variable.set("initialValue", right)


def test_deviations_travel_as_normal_distributions() -> None:
    root = daveml(LIGHT)
    found = {
        (variable.attrib["name"], float(variable.attrib["initialValue"])): float(bounds.text or "")
        for variable in root.iter(f"{DAVEML}variableDef")
        for bounds in variable.iter(f"{DAVEML}bounds")
    }
    assert found == {(f"{d.coefficient} of {d.term}", d.value): d.sigma for d in LIGHT.derivatives}
    for uncertainty in root.iter(f"{DAVEML}uncertainty"):
        assert uncertainty.attrib == {"effect": "additive"}
        assert uncertainty[0].attrib == {"numSigmas": "1"}
    assert not list(daveml(RICH).iter(f"{DAVEML}uncertainty"))  # none are declared in this file


def test_beyond_the_tested_range_terms_keep_their_ends_but_axes_turn() -> None:
    options = replace(OPTIONS, alpha_range=(-0.02, 0.12))
    root = daveml(LIFT_AND_DRAG, options)
    check_structure(root)
    assert failed_checks(root) == []
    beyond, end = (evaluate(root, {"alpha": a, "q": 0.1, "delta_e": -0.05}) for a in (0.2, 0.12))
    assert beyond["C_L"] == end["C_L"]
    assert beyond["C_X"] == pytest.approx(beyond["C_L"] * math.sin(0.2) - beyond["C_D"] * math.cos(0.2), rel=1e-12)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_json_and_csv_hold_the_aircraft(name: str) -> None:
    aircraft = AIRCRAFT[name]
    document = json.loads(export(aircraft, "json", OPTIONS).text)
    held = [(d.coefficient, d.term, d.value, d.sigma, d.fixed) for d in aircraft.derivatives]
    read = [
        (d["coefficient"], parse_term(d["term"]), d["value"], d["sigma"], d["fixed"]) for d in document["derivatives"]
    ]
    assert read == held
    assert document["reference"]["airspeed"]["value"] == aircraft.airspeed
    assert document["mass"]["I_yy"] == {"value": aircraft.I_yy, "unit": "kg m^2"}
    lines = export(aircraft, "csv", OPTIONS).text.splitlines(keepends=True)
    rows = csv.DictReader(io.StringIO("".join(line for line in lines if not line.startswith("#"))))
    assert held == [
        (
            row["coefficient"],
            parse_term(row["term"]),
            float(row["value"]),
            float(row["sigma"]) if row["sigma"] else None,
            row["fixed"] == "true",
        )
        for row in rows
    ]


def test_latex_sets_every_derivative_in_balanced_columns() -> None:
    text = export(RICH, "latex", OPTIONS).text
    rows = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert len(rows) == 1 + len(RICH.derivatives)
    for row in rows:
        assert len(re.findall(r"(?<!\\)&", row)) == 3
        assert row.count("$") % 2 == 0
        assert row.count("{") == row.count("}")
    assert r"$C_{X}$ & $\delta_{e}^{2}\,M$ & $-0.4$ &  \\" in text
    assert r"$\max(\alpha - 0.05, 0)^{3}$" in text
    assert r"\hat{\dot{\alpha}}" in text
    assert r"$C_{Z}$ & $\alpha$ & $-5.68$ & $0.45$ \\" in export(LIGHT, "latex", OPTIONS).text


@pytest.mark.parametrize(
    ("value", "sigma", "wanted"),
    [
        (-1.71234, 0.0193, ("$-1.712$", "$0.019$")),
        (123456.0, 1234.0, (r"$1.235 \cdot 10^{5}$", r"$1.2 \cdot 10^{3}$")),
        (0.0, 0.02, ("$0.000$", "$0.020$")),
        (1e-9, 2e-10, (r"$1 \cdot 10^{-9}$", r"$2 \cdot 10^{-10}$")),
    ],
)
def test_latex_cuts_numbers_at_their_deviation(value: float, sigma: float, wanted: tuple[str, str]) -> None:
    derivative = replace(LIGHT.derivatives[0], value=value, sigma=sigma)
    text = export(replace(LIGHT, derivatives=(derivative,)), "latex", OPTIONS).text
    assert f"& {wanted[0]} & {wanted[1]} " in text


@pytest.mark.parametrize("format_name", FORMATS)
def test_hostile_names_break_no_format_and_the_same_file_gives_the_same_text(format_name: str) -> None:
    aircraft = replace(LIGHT, name=HOSTILE, source=HOSTILE + "\nsecond line")
    text = export(aircraft, format_name, OPTIONS).text
    assert text == export(aircraft, format_name, OPTIONS).text
    if format_name in ("jsbsim", "davem"):
        ET.fromstring(text)
    elif format_name == "json":
        assert json.loads(text)["name"] == HOSTILE
    else:
        mark = "#" if format_name == "csv" else "%"
        assert sum(line.startswith(mark) for line in text.splitlines()) == text.count("\n" + mark) + 1
        assert "\nsecond" not in text


LAG = DeclaredEffect("control_lag", "delta_e", 0.15)
BIAS = DeclaredEffect("sensor_bias", "alpha", 0.01)
STALL = DeclaredEffect("flow_separation", "C_Z", None, parameters={"alpha_star": 0.2})


def test_effects_travel_where_a_format_can_hold_them() -> None:
    aircraft = with_effects(LAG, BIAS, STALL)
    document = json.loads(export(aircraft, "json", OPTIONS).text)
    assert [effect["kind"] for effect in document["effects"]] == ["control_lag", "sensor_bias", "flow_separation"]
    assert "# effect: control_lag of delta_e, value 0.15" in export(aircraft, "csv", OPTIONS).text
    assert r"control\_lag of delta\_e} & $0.15$" in export(aircraft, "latex", OPTIONS).text


@pytest.mark.parametrize("format_name", ["jsbsim", "davem"])
def test_an_effect_of_the_recording_is_left_out_and_said(format_name: str) -> None:
    exported = export(with_effects(BIAS), format_name, OPTIONS)
    (note,) = exported.notes
    assert "sensor_bias of alpha belongs to a recording" in note
    plain = export(LIGHT, format_name, OPTIONS).text
    assert [e.tag for e in ET.fromstring(exported.text).iter()] == [e.tag for e in ET.fromstring(plain).iter()]


@pytest.mark.parametrize(
    ("aircraft", "format_name", "options", "words"),
    [
        (with_effects(LAG), "davem", OPTIONS, "control_lag of delta_e"),
        (with_effects(STALL), "davem", OPTIONS, "flow_separation"),
        (with_effects(LAG), "jsbsim", OPTIONS, "--into"),
        (with_effects(STALL), "jsbsim", OPTIONS, "flow_separation"),
        (replace(RICH, airspeed=None), "davem", OPTIONS, "--airspeed"),
        (declaring(LIGHT, {("C_m", "U0"): 1.0}), "davem", OPTIONS, "channel U0"),
        (LIGHT, "davem", replace(OPTIONS, date="yesterday"), "'yesterday'"),
        (LIGHT, "davem", replace(OPTIONS, alpha_range=(0.2, 0.1)), "--alpha-range"),
        (LIGHT, "davem", replace(OPTIONS, into=Path("x.xml")), "--into"),
        (LIGHT, "csv", replace(OPTIONS, aero_reference=(0.0, 0.0)), "--aerorp"),
        (LIGHT, "latex", replace(OPTIONS, folded_thrust=0.1), "--folded-thrust"),
        (LIGHT, "json", replace(OPTIONS, properties={"ice": ("x", 1.0)}), "--property"),
        (LIGHT, "stl", OPTIONS, "jsbsim, json, csv, latex, davem"),
        (LIGHT, "jsbsim", replace(OPTIONS, into=Path("no_such.xml")), "no_such.xml"),
        (RICH, "jsbsim", OPTIONS, "channel ice"),
    ],
)
def test_what_cannot_be_exported_is_one_sentence(
    aircraft: Aircraft, format_name: str, options: ExportOptions, words: str
) -> None:
    with pytest.raises(AerosidError) as caught:
        export(aircraft, format_name, options)
    assert words in str(caught.value)
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value)


TARGET = """<?xml version="1.0"?>
<fdm_config name="target"><!-- kept --><aerodynamics><function name="aero/coefficient/x"><value>1</value></function>
<axis name="LIFT"/><axis name="SIDE"/><axis name="ROLL"/></aerodynamics></fdm_config>
"""


def test_a_jsbsim_aircraft_takes_the_model_and_its_actuator(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target, declared = tmp_path / "target.xml", tmp_path / "lagging.toml"
    target.write_text(TARGET)
    declared.write_text(LIGHT.text + '\n[[effects]]\nkind = "control_lag"\nwhere = "delta_e"\nvalue = 0.15\n')
    out = tmp_path / "made" / "new.xml"
    assert main(["export", str(declared), "--format", "jsbsim", "--into", str(target), "--out", str(out)]) == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "--aerorp" in captured.err
    moved = ["--aerorp=-0.2,0.3", "--out", str(tmp_path / "moved.xml")]
    assert main(["export", str(declared), "--format", "jsbsim", "--into", str(target), *moved]) == 0
    assert capsys.readouterr().err == ""
    assert ET.parse(tmp_path / "moved.xml").getroot().find(".//axis[@name='PITCH']//sum") is not None
    root = ET.parse(out).getroot()
    assert [axis.get("name") for axis in root.iter("axis")] == ["Y", "ROLL", "X", "Z", "PITCH"]
    assert [float(lag.text or "") for lag in root.iter("lag")] == [pytest.approx(1.0 / 0.15)]
    assert "<!-- kept -->" in out.read_text()
    for text in ("<fdm_config", "<aircraft/>"):
        target.write_text(text)
        assert main(["export", str(declared), "--format", "jsbsim", "--into", str(target), "--out", str(out)]) == 2
        error = capsys.readouterr().err
        assert "target.xml" in error
        assert error.count("\n") == 1


def test_the_command_line_writes_what_the_functions_give(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "light_transport", "--format", "jsbsim"]) == 0
    captured = capsys.readouterr()
    assert captured.out == aerodynamics_xml(aircraft_from_text(LIGHT.text, "light_transport", LIGHT.sha256))
    assert captured.err == ""
    out = tmp_path / "model.dml"
    words = ["export", "light_transport", "--format", "davem", "--out", str(out)]
    assert main([*words, "--date", "2024-02-29", "--alpha-range=-2,8"]) == 0
    root = ET.fromstring(out.read_text())
    assert root.find(f"{DAVEML}fileHeader/{DAVEML}creationDate").attrib == {"date": "2024-02-29"}  # type: ignore[union-attr]
    limited = [v for v in root.iter(f"{DAVEML}variableDef") if "maxValue" in v.attrib]
    assert [float(v.attrib["maxValue"]) for v in limited] == [pytest.approx(math.radians(8.0))]
    before = out.read_bytes()
    assert main([*words, "--date", "29 February"]) == 2
    assert out.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["model.dml"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["light_transport"], "--format"),
        (["no_such_aircraft", "--format", "json"], "no_such_aircraft"),
        (["light_transport", "--format", "xml"], "'xml'"),
        (["light_transport", "--format", "jsbsim", "--aerorp", "1"], "'1'"),
        (["light_transport", "--format", "jsbsim", "--aerorp", "nan,0"], "'nan,0'"),
        (["light_transport", "--format", "jsbsim", "--airspeed", "-3"], "-3"),
        (["light_transport", "--format", "jsbsim", "--property", "delta_f"], "'delta_f'"),
        (["light_transport", "--format", "jsbsim", "--property", "delta_f=a,b"], "'delta_f=a,b'"),
        (["light_transport", "--format", "json", "--out", "{folder}"], "{folder}"),
    ],
)
def test_wrong_usage_is_one_sentence(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    assert main(["export", *(word.format(folder=folder) for word in words)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert message.format(folder="folder") in captured.err
    assert list(folder.iterdir()) == []


RECORD = CompletionRecord(
    "aerosid 0.1.0",
    "2026-11-22",
    "partly_explained",
    logs=(LogOfCompletion("dou--blet.csv", "identification", "b" * 64, 3.0, 12.5),),
    not_shown=("C_Z q_hat",),
)
COMPLETED = LIGHT.completed({("C_m", "alpha^2"): (-1.7, 0.02)}, (), [("C_Z", "q_hat")], RECORD)


def test_every_export_says_what_made_the_numbers_and_marks_what_is_not_shown() -> None:
    texts = {name: export(COMPLETED, name, OPTIONS).text for name in FORMATS}
    for name, text in texts.items():
        assert "not significant in the flights" in text or '"shown": false' in text, name
        assert "2026-11-22" in text, name
        assert "b" * 64 in text, name
        assert "not significant" not in export(LIGHT, name, OPTIONS).text, name
    document = json.loads(texts["json"])
    assert [d["term"] for d in document["derivatives"] if not d["shown"]] == ["q_hat"]
    assert document["completed"]["verdict"] == "partly_explained"
    rows = [line for line in texts["csv"].splitlines() if line.endswith(",false")]
    assert len(rows) == 1
    assert rows[0].startswith("C_Z,q_hat,-4.32,")
    assert r"$\hat{q}$ & $-4.32$$^{a}$" in texts["latex"]
    jsbsim = ET.fromstring(texts["jsbsim"], parser=ET.XMLParser(target=ET.TreeBuilder(insert_comments=True)))
    comments = [element.text for element in jsbsim.iter(ET.Comment)]
    assert next(text for text in comments if text and text.startswith(" C_Z q_hat")).endswith(
        "not significant in the flights "
    )
    root = daveml(COMPLETED)
    check_structure(root)
    variables = root.iter(f"{DAVEML}variableDef")
    marked = [each.get("name") for each in variables if each.findtext(f"{DAVEML}description") == NOT_SHOWN]
    assert marked == ["C_Z of q_hat"]
