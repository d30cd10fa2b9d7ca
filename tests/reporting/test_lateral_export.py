"""Lateral and six-axis models exported: evaluated, frozen and flown by code independent of the writers."""

from __future__ import annotations

import csv
import io
import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from lateral_problems import PITCH, SIDE, commuter
from numpy.testing import assert_allclose
from oracles.daveml import DAVEML, check_structure, evaluate, failed_checks
from oracles.terms import term_by_tree

from aerosid.aircraft import Aircraft
from aerosid.errors import AircraftError
from aerosid.reporting.export import ExportOptions, export
from aerosid.reporting.export.jsbsim_xml import ExportSettings, put_into

RICH = {
    "C_Y": {**SIDE["C_Y"], "p_hat*alpha": 0.8, "beta^3": 0.4},
    "C_l": {**SIDE["C_l"], "1": 0.001, "abs(beta)*delta_a": 0.3},
    "C_n": {**SIDE["C_n"], "pos(alpha - 0.02)*beta": -0.6, "C_T*r_hat": 0.2},
}
AIRCRAFT = {
    "lateral": commuter(RICH),
    "six": commuter(PITCH | RICH),
    "six with U0": replace(commuter(PITCH | RICH), airspeed=75.0),
}
VARIED = ("alpha", "beta", "p", "q", "r", "delta_e", "delta_a", "delta_r")


def variables(aircraft: Aircraft, given: dict[str, float]) -> dict[str, float]:
    half = 0.5 / (aircraft.airspeed or given["V"])
    rates = {
        "p_hat": (given["p"], aircraft.span),
        "q_hat": (given["q"], aircraft.mean_chord),
        "r_hat": (given["r"], aircraft.span),
    }
    pressure = 0.5 * given["rho"] * given["V"] ** 2
    return {
        **given,
        **{name: rate * float(length or 0.0) * half for name, (rate, length) in rates.items()},
        "C_T": given["thrust"] / (pressure * aircraft.wing_area),
    }


def by_the_terms(aircraft: Aircraft, given: dict[str, float]) -> dict[str, float]:
    sums = dict.fromkeys(aircraft.coefficients, 0.0)
    for entry in aircraft.derivatives:
        sums[entry.coefficient] += entry.value * term_by_tree(str(entry.term), variables(aircraft, given))
    return sums


@pytest.mark.parametrize("name", AIRCRAFT)
def test_daveml_computes_the_terms_that_the_file_declares(name: str) -> None:
    aircraft, generator = AIRCRAFT[name], np.random.default_rng(7)
    root = ET.fromstring(export(aircraft, "davem", ExportOptions(date="2024-02-29")).text)
    check_structure(root)
    assert failed_checks(root) == []
    for _ in range(20):
        given = dict(zip(VARIED, generator.uniform(-0.2, 0.2, len(VARIED)).tolist(), strict=True))
        given |= {"V": 60.0 + 40.0 * generator.random(), "rho": 0.5 + generator.random(), "thrust": 4000.0}
        values = evaluate(root, given)
        for coefficient, value in by_the_terms(aircraft, given).items():
            assert values[coefficient] == pytest.approx(value, rel=1e-12, abs=1e-14)
    names = {str(v.get("varID")): v for v in root.iter(f"{DAVEML}variableDef")}
    assert names["BSPAN"].get("initialValue") == "19.8"
    assert names["C_n"].get("name") == "aeroBodyMomentCoefficient_Yaw"
    assert "referenceWingSpan" in export(aircraft, "davem", ExportOptions(date="2024-02-29")).text


def test_check_cases_notice_every_lateral_derivative() -> None:
    aircraft = AIRCRAFT["six"]
    root = ET.fromstring(export(aircraft, "davem", ExportOptions(date="2024-02-29")).text)
    constants = [v for v in root.iter(f"{DAVEML}variableDef") if v.find(f"{DAVEML}provenanceRef") is not None]
    assert len(constants) == len(aircraft.derivatives)
    for constant in constants:
        kept = str(constant.get("initialValue"))
        constant.set("initialValue", repr(1.001 * float(kept)))
        assert failed_checks(root) != [], constant.get("varID")
        constant.set("initialValue", kept)


def test_json_csv_and_latex_hold_the_span_and_the_inertias() -> None:
    document = json.loads(export(AIRCRAFT["lateral"], "json", ExportOptions()).text)
    assert document["reference"]["span"] == {"value": 19.8, "unit": "m"}
    assert {name: row["value"] for name, row in document["mass"].items()} == {
        "mass": 4650.0, "I_yy": 32600.0, "I_xx": 27500.0, "I_zz": 51000.0, "I_xz": 1600.0,
    }  # fmt: skip
    text = export(AIRCRAFT["lateral"], "csv", ExportOptions()).text
    assert "# span [m]: 19.8\n" in text
    rows = list(csv.DictReader(io.StringIO("".join(line for line in text.splitlines(True) if line[0] != "#"))))
    assert {(row["coefficient"], row["term"]): float(row["value"]) for row in rows} == {
        (d.coefficient, str(d.term)): d.value for d in AIRCRAFT["lateral"].derivatives
    }
    latex = export(AIRCRAFT["six"], "latex", ExportOptions()).text
    assert r"$C_{n}$ & $\hat{r}$" in latex
    assert r"$C_{l}$ & $\delta_{a}$" in latex


STATES = [
    {
        "airspeed": v,
        "alpha": a,
        "q": q,
        "delta_e": e,
        "thrust": t,
        "beta": b,
        "p": p,
        "r": r,
        "delta_a": da,
        "delta_r": dr,
    }
    for v, a, q, e, t, b, p, r, da, dr in (
        (72.0, 0.03, 0.0, 0.02, 5000.0, 0.05, 0.2, -0.1, 0.08, -0.05),
        (95.0, -0.04, 0.1, -0.1, 0.0, -0.09, -0.4, 0.15, -0.1, 0.12),
        (61.0, 0.12, -0.2, 0.0, 8000.0, 0.0, 0.05, 0.2, 0.2, 0.03),
    )
]
THRUST = {"thrust": ("external_reactions/thrust/magnitude", 4.4482216152605)}


@pytest.mark.parametrize("name", AIRCRAFT)
def test_jsbsim_computes_the_terms_that_the_file_declares(name: str) -> None:
    pytest.importorskip("jsbsim", reason="only JSBSim can say what it makes of the XML")
    from jsbsim_cases import exported, freeze

    aircraft = AIRCRAFT[name]
    answer = freeze(exported(aircraft, ExportSettings(properties=THRUST)), STATES)
    for state, found, seen in zip(STATES, answer["coefficients"], answer["readings"], strict=True):
        given = {**state, "V": state["airspeed"], "rho": 0.9077}
        wanted = by_the_terms(aircraft, given)
        sideways = [seen[coefficient] for coefficient in ("C_Y", "C_l", "C_n")]
        assert_allclose(sideways, [wanted[c] for c in ("C_Y", "C_l", "C_n")], rtol=1e-9, atol=1e-12)
        in_plane = [wanted.get(c, 0.0) for c in ("C_X", "C_Z", "C_m")]
        assert_allclose(found, in_plane, rtol=1e-9, atol=1e-12)


def test_a_reference_point_elsewhere_changes_no_moment() -> None:
    pytest.importorskip("jsbsim", reason="only JSBSim can say what it makes of the XML")
    from jsbsim_cases import exported, freeze

    here = freeze(exported(AIRCRAFT["six"], ExportSettings(properties=THRUST)), STATES)
    settings = ExportSettings(properties=THRUST, aero_reference=(0.7, -0.4))
    there = freeze(exported(AIRCRAFT["six"], settings), STATES)
    assert_allclose(there["coefficients"], here["coefficients"], rtol=1e-9, atol=1e-12)
    for one, other in zip(there["readings"], here["readings"], strict=True):
        for name in ("C_Y", "C_l", "C_n", "p_dot", "r_dot"):
            assert one[name] == pytest.approx(other[name], rel=1e-9, abs=1e-12)


def written_by_hand(aircraft: Aircraft) -> ET.Element:
    """The same linear terms in JSBSim's own reference quantities: q_bar, Sw, cbarw, bw, and rates over 2 V by hand."""
    section = ET.Element("aerodynamics")
    readings = {
        "1": "",
        "alpha": "<p>aero/alpha-rad</p>",
        "alpha^2": "<pow><p>aero/alpha-rad</p><v>2</v></pow>",
        "beta": "<p>aero/beta-rad</p>",
        "p_hat": "<p>aero/bi2vel</p><p>velocities/p-aero-rad_sec</p>",
        "q_hat": "<p>aero/ci2vel</p><p>velocities/q-aero-rad_sec</p>",
        "r_hat": "<p>aero/bi2vel</p><p>velocities/r-aero-rad_sec</p>",
        "delta_e": "<p>fcs/elevator-pos-rad</p>",
        "delta_a": "<p>fcs/right-aileron-pos-rad</p>",
        "delta_r": "<p>fcs/rudder-pos-rad</p>",
    }
    lengths = {"C_l": "<p>metrics/bw-ft</p>", "C_m": "<p>metrics/cbarw-ft</p>", "C_n": "<p>metrics/bw-ft</p>"}
    for axis, coefficient in zip(
        ("X", "Y", "Z", "ROLL", "PITCH", "YAW"), ("C_X", "C_Y", "C_Z", "C_l", "C_m", "C_n"), strict=True
    ):
        element = ET.SubElement(section, "axis", name=axis)
        for n, d in enumerate(d for d in aircraft.derivatives if d.coefficient == coefficient):
            parts = f"<v>{d.value!r}</v><p>aero/qbar-psf</p><p>metrics/Sw-sqft</p>{lengths.get(coefficient, '')}"
            element.append(
                ET.fromstring(
                    f'<function name="hand/{coefficient}{n}">'
                    f"<product>{parts}{readings[str(d.term)]}</product></function>"
                )
            )
    return section


@pytest.mark.parametrize("moved", [(0.0, 0.0), (0.5, 0.3)])
def test_exported_equations_fly_as_those_written_by_hand(moved: tuple[float, float]) -> None:
    pytest.importorskip("jsbsim", reason="JSBSim flies here")
    from jsbsim_cases import configuration, exported, job

    from aerosid.studies.jsbsim.process import run_job
    from aerosid.studies.jsbsim.properties import DEVIATIONS, THRUST

    aircraft = commuter(PITCH | SIDE)
    time = 0.002 * np.arange(3001)
    drives = {THRUST: np.ones(time.size)}
    for begin, (control, name) in zip((0.5, 1.0, 2.5), DEVIATIONS.items(), strict=True):
        size = {"delta_e": 0.02}.get(control, 0.06)
        drives[name] = size * ((time > begin) & (time <= begin + 0.6)) - size * (
            (time > begin + 0.6) & (time <= begin + 1.2)
        )
    task = job(airspeed=72.0, sideways=True)
    _, by_hand = run_job({"case": configuration(aircraft, written_by_hand(aircraft))}, task, drives)
    _, ours = run_job({"case": exported(aircraft, ExportSettings(aero_reference=moved))}, task, drives)
    for channel in ("u", "v", "w", "p", "q", "r", "phi", "theta", "psi", "force_x", "force_y", "force_z"):
        spread = np.ptp(np.unwrap(by_hand[channel]))
        assert spread > 0.0
        apart = ours[channel] - by_hand[channel]
        if channel == "psi":  # north is 0 or a full turn
            apart = apart - 2.0 * np.pi * np.round(apart / (2.0 * np.pi))
        assert np.abs(apart).max() < 1e-9 * spread, channel


def target(*axes: str) -> ET.Element:
    inside = "".join(
        f'<axis name="{name}"><function name="own/{name}"><value>1</value></function></axis>' for name in axes
    )
    return ET.fromstring(f'<fdm_config name="target"><aerodynamics>{inside}</aerodynamics></fdm_config>')


def test_a_lateral_model_takes_the_place_of_the_lateral_axes_alone() -> None:
    made = put_into(target("X", "Z", "PITCH", "SIDE", "ROLL", "YAW"), AIRCRAFT["lateral"], ExportSettings())
    names = [axis.get("name") for axis in made.iter("axis")]
    assert names == ["X", "Z", "PITCH", "Y", "ROLL", "YAW"]
    own = {str(function.get("name")) for axis in made.iter("axis") for function in axis}
    assert {"own/X", "own/Z", "own/PITCH"} < own
    assert not {"own/SIDE", "own/ROLL", "own/YAW"} & own
    whole = put_into(target("LIFT", "DRAG", "SIDE", "PITCH", "ROLL", "YAW"), AIRCRAFT["six"], ExportSettings())
    assert not any(name.startswith("own/") for axis in whole.iter("axis") for name in [str(axis[0].get("name"))])
    with pytest.raises(AircraftError, match="keeps its axis LIFT, and JSBSim does not mix the two"):
        put_into(target("LIFT", "DRAG", "PITCH", "SIDE"), AIRCRAFT["lateral"], ExportSettings())


def test_beyond_the_tested_range_lateral_terms_keep_their_ends() -> None:
    root = ET.fromstring(export(AIRCRAFT["lateral"], "davem", ExportOptions(alpha_range=(-0.02, 0.1))).text)
    given = {
        "alpha": 0.1,
        "beta": 0.1,
        "p": 0.1,
        "r": 0.2,
        "delta_a": 0.1,
        "delta_r": 0.1,
        "V": 70.0,
        "rho": 1.0,
        "thrust": 1.0,
    }
    at_end, beyond = evaluate(root, given), evaluate(root, {**given, "alpha": 0.3})
    assert all(math.isclose(at_end[c], beyond[c], rel_tol=1e-12) for c in ("C_Y", "C_l", "C_n"))
