"""Aircraft as JSBSim XML: the coefficients computed by JSBSim against terms and equations evaluated by hand."""

from __future__ import annotations

import math
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from oracles.terms import term_by_tree
from problems import BODY_POLAR, BOTH_SQUARES, LIFT_AND_DRAG, LIGHT, POLAR, POLAR_EXPANDED, declaring

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError
from aerosid.reporting.export.jsbsim_xml import ExportSettings, actuator_xml, aerodynamics_xml, as_text, put_into

RICH = declaring(
    LIGHT,
    {
        ("C_X", "alpha^2"): 3.6089,
        ("C_X", "delta_e^2*mach"): -0.4,
        ("C_X", "C_T"): 0.3,
        ("C_Z", "V_hat*alpha"): 1.7,
        ("C_Z", "abs(q_hat)*delta_e"): 2.9,
        ("C_Z", "pos(alpha - 0.05)^3"): 21.0,
        ("C_Z", "alpha_dot_hat"): -3.1,
        ("C_m", "alpha*delta_e"): -2.3,
        ("C_m", "pos(delta_e + 0.1)"): 0.2,
        ("C_m", "delta_f"): -0.3,
        ("C_m", "ice*abs(alpha)"): 0.7,
        ("C_m", "rho"): 0.011,
    },
)
CHANNELS = {"delta_f": ("aerosid/channel/delta_f", 1.0), "ice": ("aerosid/channel/ice", 1.0)}
THRUST = ("external_reactions/thrust/magnitude", 4.4482216152605)
STATES = [
    {"airspeed": v, "alpha": a, "q": q, "delta_e": e, "thrust": t}
    for v, a, q, e, t in (
        (100.0, 0.03, 0.0, 0.02, 5000.0),
        (72.0, 0.17, -0.21, -0.15, 0.0),
        (131.0, -0.08, 0.33, 0.21, 9000.0),
    )
]


def in_jsbsim() -> None:
    pytest.importorskip("jsbsim", reason="only JSBSim can say what it makes of the XML")


@pytest.mark.parametrize(
    "aircraft",
    [RICH, LIFT_AND_DRAG, replace(RICH, airspeed=None), POLAR, BODY_POLAR],
    ids=["rich", "C_L", "no U0", "polar", "polar in body axes"],
)
def test_jsbsim_computes_the_terms_that_the_file_declares(aircraft: Aircraft) -> None:
    in_jsbsim()
    from jsbsim_cases import exported, freeze

    settings = ExportSettings(airspeed=93.0, properties={**CHANNELS, "thrust": THRUST})
    further = {"delta_f": 0.4, "ice": 0.7}
    properties = {CHANNELS[name][0]: value for name, value in further.items()}
    answer = freeze(exported(aircraft, settings), [state | {"properties": properties} for state in STATES])
    for state, found, seen in zip(STATES, answer["coefficients"], answer["readings"], strict=True):
        speed, alpha = float(state["airspeed"]), float(state["alpha"])
        rate = aircraft.mean_chord / 2.0 / (aircraft.airspeed or speed)
        variables = further | {
            "alpha": alpha,
            "theta": seen["theta"],
            "q_hat": state["q"] * rate,
            "alpha_dot_hat": seen["alpha_dot"] * rate,
            "delta_e": state["delta_e"],
            "V_hat": speed / (aircraft.airspeed or 93.0) - 1.0,
            "mach": seen["mach"],
            "rho": 0.9077,
            "C_T": state["thrust"] / (0.5 * 0.9077 * speed**2 * aircraft.wing_area),
        }
        total = dict.fromkeys(("C_X", "C_Z", "C_m", "C_L", "C_D"), 0.0)
        for entry in sorted(aircraft.derivatives, key=lambda entry: entry.coefficient not in ("C_L", "C_Z")):
            total[entry.coefficient] += entry.value * term_by_tree(str(entry.term), variables | total)
        expected = [
            total["C_X"] + total["C_L"] * math.sin(alpha) - total["C_D"] * math.cos(alpha),
            total["C_Z"] - total["C_L"] * math.cos(alpha) - total["C_D"] * math.sin(alpha),
            total["C_m"],
        ]
        assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
        assert abs(seen["alpha_dot"]) > 1e-3


@pytest.mark.parametrize("moved", [(0.0, 0.0), (0.5, 0.3)])
def test_exported_equations_fly_as_those_written_by_hand(moved: tuple[float, float]) -> None:
    in_jsbsim()
    from jsbsim_cases import PAPER_BY_HAND, configuration, exported, fly

    time = 0.002 * np.arange(3001)
    deviation = 0.06 * ((time > 1.0) & (time <= 2.0)) - 0.06 * ((time > 2.0) & (time <= 3.0))
    by_hand = fly(configuration(LIGHT, ET.fromstring(PAPER_BY_HAND)), deviation)
    ours = fly(exported(declaring(LIGHT, BOTH_SQUARES), ExportSettings(aero_reference=moved)), deviation)
    for channel in ("u", "w", "q", "theta", "force_x", "force_z"):
        spread = np.ptp(by_hand[channel])
        assert spread > 0.0
        assert np.abs(ours[channel] - by_hand[channel]).max() < 1e-9 * spread, channel


def test_an_exported_polar_flies_as_the_same_drag_written_in_alpha() -> None:
    in_jsbsim()
    from jsbsim_cases import exported, fly

    time = 0.002 * np.arange(3001)
    deviation = 0.06 * ((time > 1.0) & (time <= 2.0)) - 0.06 * ((time > 2.0) & (time <= 3.0))
    polar, expanded = (fly(exported(aircraft), deviation) for aircraft in (POLAR, POLAR_EXPANDED))
    for channel in ("u", "w", "q", "theta", "force_x", "force_z"):
        spread = np.ptp(expanded[channel])
        assert spread > 0.0
        assert np.abs(polar[channel] - expanded[channel]).max() < 1e-9 * spread, channel


def test_outside_the_tested_range_alpha_is_held_but_the_axes_turn() -> None:
    in_jsbsim()
    from jsbsim_cases import exported, freeze

    settings = ExportSettings(alpha_range=(-0.02, 0.10))
    states = [dict(STATES[0], alpha=alpha) for alpha in (-0.3, -0.02, 0.05, 0.10, 0.4)]
    for aircraft in (LIGHT, LIFT_AND_DRAG):
        clipped = np.array(freeze(exported(aircraft, settings), states)["coefficients"])
        free = np.array(freeze(exported(aircraft), states)["coefficients"])
        assert_allclose(clipped[1:4], free[1:4], rtol=1e-12)
        assert_allclose(clipped[[0, 4], 2], free[[1, 3], 2], rtol=1e-12)
        lift = [
            -c_z * math.cos(s["alpha"]) + c_x * math.sin(s["alpha"])
            for (c_x, c_z, _), s in zip(clipped, states, strict=True)
        ]
        if aircraft is LIFT_AND_DRAG:
            assert lift[4] == pytest.approx(lift[3], rel=1e-12)
            assert lift[0] == pytest.approx(lift[1], rel=1e-12)


def test_thrust_that_the_coefficients_hold_is_taken_out() -> None:
    in_jsbsim()
    from jsbsim_cases import exported, freeze

    aircraft = replace(LIGHT, thrust_incidence=0.05, thrust_z_arm=0.4)
    with_thrust = np.array(freeze(exported(aircraft), STATES)["coefficients"])
    without = np.array(freeze(exported(aircraft, ExportSettings(folded_thrust=0.07)), STATES)["coefficients"])
    chord = LIGHT.mean_chord
    expected = [0.07 * math.cos(0.05), -0.07 * math.sin(0.05), 0.07 * 0.4 / chord]
    assert_allclose(with_thrust - without, np.tile(expected, (3, 1)), rtol=1e-9)


SEVEN_THREE_SEVEN = """
import sys, jsbsim
jsbsim.FGJSBBase().debug_lvl = 0
fdm = jsbsim.FGFDMExec(sys.argv[1], None)
fdm.set_debug_level(0)
root = jsbsim.get_default_root_dir()
fdm.set_engine_path(root + "/engine")
fdm.set_systems_path(root + "/systems")
fdm.set_aircraft_path(sys.argv[1])
assert fdm.load_model("737")
for name, value in (("h-sl-ft", 20000.0), ("vt-fps", 560.0), ("gamma-deg", 0.0)):
    fdm["ic/" + name] = value
fdm.run_ic()
fdm["propulsion/set-running"] = -1
fdm.do_trim(1)
for axis in "uvw":
    assert abs(fdm[f"accelerations/{axis}dot-ft_sec2"]) < 0.05, axis
assert abs(fdm["accelerations/qdot-rad_sec2"]) < 1e-3
assert abs(fdm["forces/fbz-aero-lbs"] - fdm["aero/qbar-psf"] * fdm["aero/aerosid/C_Z"] * %r) < 1.0
print("trimmed at", fdm["aero/alpha-rad"])
"""


def test_the_model_drops_into_the_737_which_still_trims(tmp_path: Path) -> None:
    jsbsim = pytest.importorskip("jsbsim", reason="the 737 is JSBSim's")
    source = Path(jsbsim.get_default_root_dir()) / "aircraft" / "737" / "737.xml"
    linear = declaring(LIGHT, {("C_m", "q_hat"): -20.0, ("C_Z", "alpha"): -4.4, ("C_m", "alpha"): -1.1})
    boeing = replace(linear, wing_area=108.789, mean_chord=3.752, airspeed=170.0)
    place = tmp_path / "737"
    place.mkdir()
    target = ET.parse(source).getroot()
    for socket in [*target.findall("output"), *target.findall("input")]:
        target.remove(socket)
    (place / "737.xml").write_text(as_text(put_into(target, boeing)))
    axes = [axis.get("name") for axis in ET.parse(place / "737.xml").getroot().findall("aerodynamics/axis")]
    assert sorted(map(str, axes)) == ["PITCH", "ROLL", "X", "Y", "YAW", "Z"]
    script = SEVEN_THREE_SEVEN % (108.789 / 0.3048**2)
    run = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout[-1000:] + run.stderr[-1000:]
    assert "trimmed at" in run.stdout


def test_the_text_is_the_same_each_time_and_holds_deviations_and_any_name() -> None:
    wild = replace(LIGHT, name='<!-- Transport -- \u0000 & "mate" -->')
    text = aerodynamics_xml(wild)
    assert text == aerodynamics_xml(wild)
    section = ET.fromstring(text)
    assert [axis.get("name") for axis in section.findall("axis")] == ["X", "Z", "PITCH"]
    sigma = next(d.sigma for d in LIGHT.derivatives if d.coefficient == "C_m" and str(d.term) == "alpha")
    assert f"<!-- C_m alpha, standard deviation {sigma:g} -->" in text


EFFECT = """
[[effects]]
kind = "{kind}"
where = "{where}"
value = 0.125
"""


def with_effect(kind: str, where: str) -> Aircraft:
    return aircraft_from_text(LIGHT.text + EFFECT.format(kind=kind, where=where), "effects.toml", "0" * 64)


def test_a_declared_lag_stands_between_the_command_and_the_aerodynamics() -> None:
    lagging = with_effect("control_lag", "delta_e")
    assert "fcs/elevator-pos-rad" not in aerodynamics_xml(lagging)
    system = ET.fromstring(str(actuator_xml(lagging)))
    actuator = system.find("channel/actuator")
    assert actuator is not None
    assert actuator.findtext("input") == "fcs/elevator-pos-rad"
    assert float(str(actuator.findtext("lag"))) == 8.0
    assert f"<property>{actuator.findtext('output')}</property>" in aerodynamics_xml(lagging)
    assert actuator_xml(LIGHT) is None


@pytest.mark.parametrize(
    ("aircraft", "settings", "words"),
    [
        (declaring(LIGHT, {("C_m", "vane_2"): 0.1}), ExportSettings(), "vane_2, which JSBSim does not know"),
        (replace(RICH, airspeed=None), ExportSettings(properties=CHANNELS), "V_hat, but no airspeed U0 is given"),
        (LIGHT, ExportSettings(alpha_range=(0.1, -0.1)), "from 0.1 to -0.1 rad"),
        (with_effect("flow_separation", "C_Z"), ExportSettings(), "declares flow_separation"),
        (with_effect("control_deadband", "delta_e"), ExportSettings(), "declares control_deadband"),
    ],
    ids=["channel", "V_hat", "range", "separation", "dead band"],
)
def test_what_jsbsim_cannot_carry_is_one_sentence(aircraft: Aircraft, settings: ExportSettings, words: str) -> None:
    with pytest.raises(AircraftError, match=words) as caught:
        aerodynamics_xml(aircraft, settings)
    assert str(caught.value).count(". ") == 0


def test_an_aircraft_without_aerodynamics_is_refused() -> None:
    with pytest.raises(AircraftError, match="'hollow' holds no <aerodynamics>"):
        put_into(ET.Element("fdm_config", name="hollow"), LIGHT)
