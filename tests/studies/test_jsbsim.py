"""Flights of JSBSim: against our own simulation, against published data of its aircraft, and each effect's sign."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from jsbsim_cases import PAPER_BY_HAND, configuration, freeze
from numpy.testing import assert_allclose
from problems import BOTH_SQUARES, LIGHT, SILENT, declaring

from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import EstimationError
from aerosid.flight_model.axes import SIX
from aerosid.flight_model.simulation import fly, trim
from aerosid.loop.closed_loop import close_loop
from aerosid.signals.delay_and_lag import lagged, rate_limited
from aerosid.studies.jsbsim.control_inputs import ControlInput, Manoeuvre, manoeuvre, sequence
from aerosid.studies.jsbsim.flight import fly_jsbsim
from aerosid.studies.jsbsim.injected import parse_effect
from aerosid.studies.jsbsim.injection import ICED_DRAG
from aerosid.studies.jsbsim.plan import FlightPlan, JsbsimFlight
from aerosid.studies.jsbsim.stock import stock_folder

pytest.importorskip("jsbsim", reason="JSBSim flies here")

DOUBLET = manoeuvre("doublet", 0.06, 1.02, 14.01, 0.03)
PAPER = declaring(LIGHT, BOTH_SQUARES)


def silent(**further: object) -> JsbsimFlight:
    return fly_jsbsim(FlightPlan(**({"manoeuvre": DOUBLET, "airspeed": 100.0, "noise": 0.0} | further)))  # type: ignore[arg-type]


def test_jsbsim_flies_the_papers_equations_as_we_do() -> None:
    flown = silent(aircraft=PAPER, longest_frame=0.0005)  # its integrators err by the square of the frame
    model = declared_model(PAPER, 100.0)
    level = trim(model, 100.0, LIGHT.density, LIGHT.mass)
    ours = fly(
        model, level, DOUBLET.time, DOUBLET.deviation, density=LIGHT.density, mass=LIGHT.mass, noise=SILENT, seed=0
    )
    own = {
        "u": ours["V"] * np.cos(ours["alpha"]),
        "w": ours["V"] * np.sin(ours["alpha"]),
        **{name: ours[name] for name in ("q", "theta", "a_x", "a_z", "h")},
    }
    for name, values in own.items():
        assert np.abs(flown.states[name] - values).max() < 1e-5 * np.ptp(values), name
    for name in ("V", "alpha", "delta_e"):
        assert np.abs(flown.log[name] - ours[name]).max() < 1e-5 * np.ptp(ours[name]), name
    assert flown.log["thrust"] == pytest.approx(level.thrust, rel=1e-6)


def test_effects_of_the_aircraft_file_are_flown_too() -> None:
    text = LIGHT.text + '\n[[effects]]\nkind = "control_lag"\nwhere = "delta_e"\nvalue = 0.2\n'
    declared = aircraft_from_text(text, "lagging.toml", "0" * 64)
    given = silent(aircraft=declared)
    injected = silent(aircraft=LIGHT, effects=(parse_effect("control_lag=0.2"),))
    for name, values in given.log.channels.items():
        assert (values == injected.log[name]).all(), name
    assert given.truth["effects"] == []


def test_derivatives_are_those_of_the_aircrafts_own_tables() -> None:
    """The constants are in JSBSim's file of the L410; C_m_alpha, whose lift acts at AERORP, was measured before."""
    plan = FlightPlan("L410", manoeuvre("doublet", 0.02, 1.0, 6.0, 0.02), 80.0, noise=0.0)
    flown = fly_jsbsim(plan)
    rows = {(row["coefficient"], row["term"]): row for row in flown.truth["derivatives"]}
    tables = ET.parse(stock_folder() / "L410" / "L410.xml").getroot()  # type: ignore[operator]
    constants = {
        str(function.get("name")): [float(str(value.text)) for value in function.findall("product/value")]
        for function in tables.iter("function")
    }
    damping, (downwash,) = constants["aero/coefficient/Cmq"][0], constants["aero/coefficient/Cmadot"]
    assert rows["C_m", "q_hat"]["frozen"] == pytest.approx(damping, rel=1e-4)
    assert rows["C_m", "alpha_dot_hat"]["frozen"] == pytest.approx(downwash, rel=1e-3)
    # On a level path alphadot follows q: the remainder of one adds to the other.
    assert rows["C_m", "q_hat"]["self_consistent"] == pytest.approx(damping + downwash, rel=2e-3)
    assert rows["C_m", "alpha"]["frozen"] == pytest.approx(-0.944, abs=2e-3)
    assert rows["C_m", "alpha"]["self_consistent"] == pytest.approx(-0.289, abs=2e-3)
    trimmed = flown.truth["trim"]
    declared = {(d.coefficient, str(d.term)): d.value for d in flown.aircraft.derivatives}
    for coefficient, at_trim in flown.truth["coefficients_at_trim"].items():
        slopes = (("alpha", trimmed["alpha"]), ("delta_e", trimmed["delta_e"]))
        linear = declared[coefficient, "1"] + sum(declared[coefficient, term] * x for term, x in slopes)
        assert linear == pytest.approx(at_trim, abs=1e-5)


def test_actuator_and_sensor_effects_are_those_of_the_catalogue() -> None:
    effects = ("control_lag=0.15", "sensor_bias:alpha=0.01", "sensor_scale:V=1.05", "sensor_lag:q=0.1")
    flown = silent(aircraft=LIGHT, effects=tuple(map(parse_effect, (*effects, "sensor_delay:theta=0.06"))))
    states, log = flown.states, flown.log
    command = log["delta_e"][:, None]
    assert_allclose(states["surface"], lagged(DOUBLET.time, command, 0.15)[:, 0], atol=1e-4)
    assert_allclose(log["alpha"], states["alpha"] + 0.01, rtol=1e-9)
    assert_allclose(log["V"], 1.05 * states["V"], rtol=1e-9)
    fine = np.interp(DOUBLET.time - 0.06, DOUBLET.time, states["theta"])
    assert_allclose(log["theta"], fine, atol=2e-3 * np.ptp(fine))
    assert_allclose(log["q"], lagged(DOUBLET.time, states["q"][:, None], 0.1)[:, 0], atol=5e-3 * np.ptp(states["q"]))
    other = silent(aircraft=LIGHT, effects=tuple(map(parse_effect, ("control_rate_limit=0.1", "control_delay=0.09"))))
    fine = 0.001 * np.arange(14041.0)
    limited = rate_limited(fine, np.interp(fine, DOUBLET.time, other.log["delta_e"]), 0.1)
    assert_allclose(other.states["surface"], np.interp(DOUBLET.time - 0.09, fine, limited), atol=3e-4)
    loose = silent(aircraft=LIGHT, effects=(parse_effect("control_deadband=0.02"),))
    moved = loose.states["surface"] - loose.truth["trim"]["delta_e"]
    assert_allclose(moved, np.sign(DOUBLET.deviation) * np.maximum(np.abs(DOUBLET.deviation) - 0.02, 0.0), atol=1e-9)


STILL = Manoeuvre(0.02 * np.arange(151.0), {}, "none")
"""Trimmed flight: any motion is due to the effect."""


def test_what_changes_at_a_time_changes_the_forces_by_what_it_says() -> None:
    """The instant after each change, at a state that has not moved yet."""
    effects = ("step_change:C_m=0.01@0.5", "thrust_loss=0.3@1", "aero_term:C_Z:alpha=-2@1.5", "icing=1@2")
    flown = silent(aircraft=LIGHT, manoeuvre=STILL, effects=tuple(map(parse_effect, effects)))
    states = flown.states
    pressure = 0.5 * states["rho"] * states["V"] ** 2 * LIGHT.wing_area

    def jump(name: str, time: float) -> tuple[int, float]:
        after = round(time / 0.02) + 1
        drift = states[name][after + 1] - states[name][after]
        return after, float(states[name][after] - states[name][after - 1] - drift)

    k, change = jump("q_dot", 0.5)
    assert change == pytest.approx(0.01 * pressure[k] * LIGHT.mean_chord / LIGHT.I_yy, rel=0.05)
    k, change = jump("a_x", 1.0)
    assert change == pytest.approx(-0.3 * flown.truth["trim"]["thrust"] / LIGHT.mass, rel=0.02)
    assert (flown.log["thrust"] == flown.truth["trim"]["thrust"]).all()
    k, change = jump("a_z", 1.5)
    assert change == pytest.approx(-2.0 * states["alpha"][k] * pressure[k] / LIGHT.mass, rel=0.05)
    k, change = jump("a_x", 2.0)
    assert change == pytest.approx(ICED_DRAG * pressure[k] / LIGHT.mass, rel=0.05)
    assert [row["kind"] for row in flown.truth["effects"]] == ["step_change", "thrust_loss", "aero_term", "icing"]


def test_a_point_mass_moves_mass_centre_of_gravity_and_inertia() -> None:
    """A mass 2 m aft reduces static stability: C_m_alpha rises by |C_Z_alpha| times the shift over the chord."""
    aft = silent(aircraft=LIGHT, effects=(parse_effect("cg_shift=200,-2.0"),))
    assert aft.states["mass"] == pytest.approx(LIGHT.mass + 200.0, rel=1e-6)
    shift = 200.0 * -2.0 / (LIGHT.mass + 200.0)
    trimmed, before = aft.truth["trim"], silent(aircraft=LIGHT, manoeuvre=STILL).truth["trim"]
    value = {(d.coefficient, str(d.term)): d.value for d in LIGHT.derivatives}
    # The old reference lies `-shift` ahead of the new centre; thrust passes through both.
    force = LIGHT.wing_area * 0.5 * 0.9077 * 100.0**2
    c_z = value["C_Z", "1"] + value["C_Z", "alpha"] * trimmed["alpha"] + value["C_Z", "delta_e"] * trimmed["delta_e"]
    c_m = value["C_m", "1"] + value["C_m", "alpha"] * trimmed["alpha"] + value["C_m", "delta_e"] * trimmed["delta_e"]
    assert c_m * LIGHT.mean_chord == pytest.approx(-shift * c_z, rel=1e-4)
    assert force * -c_z == pytest.approx((LIGHT.mass + 200.0) * 9.80665 * np.cos(trimmed["alpha"]), rel=1e-4)
    assert trimmed["delta_e"] > before["delta_e"]


def test_flap_gear_ground_and_stall_do_what_they_are_for() -> None:
    stock = FlightPlan("c310", STILL, 72.0, noise=0.0, effects=tuple(map(parse_effect, ("flap=1@0.5", "gear=1@1.5"))))
    states = fly_jsbsim(stock).states
    lift, drag = -states["a_z"], states["a_x"]
    assert lift[27] - lift[25] > 0.5  # m/s^2, due to a step of the flaps
    assert drag[77] - drag[75] < -0.05
    near = silent(aircraft=LIGHT, manoeuvre=STILL, altitude=2.0, effects=(parse_effect("ground_effect=0.1"),))
    far = silent(aircraft=LIGHT, manoeuvre=STILL, altitude=300.0, effects=(parse_effect("ground_effect=0.1"),))
    value = {(d.coefficient, str(d.term)): d.value for d in LIGHT.derivatives}
    share = []
    for flown in (near, far):
        trimmed = flown.truth["trim"]
        c_z = (
            value["C_Z", "1"] + value["C_Z", "alpha"] * trimmed["alpha"] + value["C_Z", "delta_e"] * trimmed["delta_e"]
        )
        share.append(c_z / np.cos(trimmed["alpha"]))
    span = LIGHT.wing_area / LIGHT.mean_chord
    assert share[1] / share[0] == pytest.approx(1.0 + 0.1 * np.exp(-2.48 * (2.0 * 2.0 / span) ** 0.768), rel=1e-3)
    stall = silent(aircraft=LIGHT, effects=(parse_effect("stall_hysteresis=0.0,0.1,0.3,-0.02"),))
    alpha, a_z = stall.states["alpha"], stall.states["a_z"]
    rates = value["C_Z", "q_hat"] * stall.states["q"] * LIGHT.mean_chord / 200.0
    linear = (
        value["C_Z", "1"] + value["C_Z", "alpha"] * alpha + rates + value["C_Z", "delta_e"] * stall.states["surface"]
    )
    excess = a_z * LIGHT.mass / (0.5 * 0.9077 * stall.states["V"] ** 2 * LIGHT.wing_area) - linear
    stalled = excess > 0.15
    assert_allclose(excess[stalled], 0.3, atol=1e-3)
    assert_allclose(excess[~stalled], 0.0, atol=1e-3)
    between = (alpha > 0.01) & (alpha < 0.09)
    assert (stalled & between).any()
    assert (~stalled & between).any()


def test_turbulence_is_air_that_moves_and_the_seed_repeats_it() -> None:
    plan = FlightPlan(LIGHT, STILL, 100.0, noise=1.0, seed=5, effects=(parse_effect("turbulence=3"),))
    one, again, other = fly_jsbsim(plan), fly_jsbsim(plan), fly_jsbsim(replace(plan, seed=6))
    for name in ("V", "alpha", "q", "delta_e"):
        assert (one.log[name] == again.log[name]).all()
    assert np.abs(one.states["alpha"] - other.states["alpha"]).max() > 1e-3
    # Gusts of the order of 1 m/s at 100 m/s, and the response of the aircraft to them.
    assert 2e-3 < np.std(one.states["alpha"]) < 0.1
    assert np.std(one.states["a_z"]) > 0.3


def test_an_aircraft_that_jsbsim_breaks_down_on_is_one_sentence() -> None:
    broken = ET.fromstring(PAPER_BY_HAND)
    axis = broken.find("axis")
    assert axis is not None
    ET.SubElement(axis, "function", name="hand/broken").append(ET.fromstring("<interpolate1d><v>1</v></interpolate1d>"))
    with pytest.raises(EstimationError) as caught:
        freeze(configuration(LIGHT, broken), [])
    assert str(caught.value).startswith("JSBSim ")
    assert "\n" not in str(caught.value)
    with pytest.raises(EstimationError, match=r"no level flight at 20 m/s and 1500 m"):
        silent(aircraft=LIGHT, airspeed=20.0)
    with pytest.raises(EstimationError, match=r"leaves \|alpha\| < 1.5 rad after"):
        silent(aircraft=declaring(LIGHT, {("C_m", "alpha"): 0.6}))


@pytest.mark.slow
def test_noise_free_polynomial_flight_gives_back_its_twelve_derivatives() -> None:
    handbook = declaring(PAPER, {(d.coefficient, str(d.term)): 0.85 * d.value for d in PAPER.derivatives})
    result = close_loop([silent(aircraft=PAPER).log], handbook)
    found = {(row.coefficient, row.term): row.value for row in result.derivatives}
    for entry in PAPER.derivatives:
        tolerance = 1e-2 if (entry.coefficient, str(entry.term)) == ("C_Z", "q_hat") else 1e-3
        assert found[entry.coefficient, str(entry.term)] == pytest.approx(entry.value, rel=tolerance), entry


def test_lateral_derivatives_are_those_of_the_aircrafts_own_tables() -> None:
    """The constants are in JSBSim's file of the L410; no part of C_Y varies with rate or surface, whatever AERORP."""
    moves = (ControlInput("delta_a", "doublet", 0.03, 0.6), ControlInput("delta_r", "doublet", 0.03, 0.6))
    plan = FlightPlan("L410", sequence(moves, None, 0.04), 80.0, noise=0.0, longest_frame=0.004)
    flown = fly_jsbsim(plan)
    rows = {(row["coefficient"], row["term"]): row for row in flown.truth["derivatives"]}
    tables = ET.parse(stock_folder() / "L410" / "L410.xml").getroot()  # type: ignore[operator]
    constants = {
        str(function.get("name")).rpartition("/")[2]: [float(str(v.text)) for v in function.findall("product/value")]
        for function in tables.iter("function")
    }
    assert rows["C_l", "p_hat"]["frozen"] == pytest.approx(constants["Clp"][0], rel=1e-6)
    assert rows["C_n", "r_hat"]["frozen"] == pytest.approx(constants["Cnr"][0], rel=1e-6)
    declared = {(d.coefficient, str(d.term)): d.value for d in flown.aircraft.derivatives}
    assert declared["C_l", "p_hat"] == pytest.approx(-0.5, rel=1e-5)
    assert flown.aircraft.axes is SIX
    assert np.ptp(flown.log["p"]) > 0.03
