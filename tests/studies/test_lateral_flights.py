"""JSBSim's flights of lateral and six-axis aircraft files, against the suite's own equations of motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from lateral_problems import PITCH, SIDE, commuter
from numpy.testing import assert_allclose
from oracles.rigid_body import Body, simulate

from aerosid.aircraft import Aircraft
from aerosid.errors import UsageError
from aerosid.flight_model.axes import SIX
from aerosid.flight_model.simulation import doublet
from aerosid.signals.delay_and_lag import lagged
from aerosid.studies.jsbsim.control_inputs import ControlInput, Manoeuvre, sequence
from aerosid.studies.jsbsim.flight import fly_jsbsim
from aerosid.studies.jsbsim.injected import parse_effect
from aerosid.studies.jsbsim.plan import FlightPlan, JsbsimFlight
from aerosid.studies.jsbsim.polynomial import CARRYING, as_flown

pytest.importorskip("jsbsim", reason="JSBSim flies here")

TIME = 0.04 * np.arange(141.0)
ALL = Manoeuvre(
    TIME,
    {
        "delta_e": doublet(TIME, 0.52, 0.6, 0.05),
        "delta_a": doublet(TIME, 0.8, 0.6, 0.08),
        "delta_r": doublet(TIME, 2.0, 0.6, 0.08),
    },
    "doublets",
)
CLIMBING = Manoeuvre(TIME, ALL.deviations | {"delta_e": doublet(TIME, 0.52, 1.4, 0.06)}, "doublets")
"""Height and airspeed vary by more than the curvature of JSBSim's planet (6e9 m) and its rounding change them."""
STILL = Manoeuvre(0.02 * np.arange(151.0), {}, "none")
COUPLED = PITCH | {
    **SIDE,
    "C_n": {**SIDE["C_n"], "1": -0.0015, "alpha*p_hat": -0.4, "beta^3": 0.4},
    "C_m": {**PITCH["C_m"], "beta^2": -0.3},
}
BODY = Body(39.0, 1.98, 19.8, (27500.0, 32600.0, 51000.0, 1600.0), None, 72.0)


def flown(aircraft: Aircraft, *effects: str, manoeuvre: Manoeuvre = ALL, frame: float = 0.004) -> JsbsimFlight:
    made = tuple(map(parse_effect, effects))
    return fly_jsbsim(FlightPlan(aircraft, manoeuvre, 72.0, effects=made, noise=0.0, longest_frame=frame))


def by_the_suite(
    flight: JsbsimFlight, terms: Mapping[tuple[str, str], float], manoeuvre: Manoeuvre = ALL
) -> dict[str, np.ndarray]:
    """The same controls from the same initial state, by the suite's own equations."""
    start = [float(flight.states[name][0]) for name in SIX.integrated]
    trim = flight.truth["trim"]
    inputs = {name: trim[name] + moved for name, moved in manoeuvre.deviations.items()}
    given = {"rho": 1.02, "mass": 4650.0, "speed_of_sound": 334.0, "thrust": trim["thrust"]}
    _, seen = simulate(SIX.integrated, start, TIME, {**given, **inputs}, terms, BODY)
    return {name: np.real([sample[name] for sample in seen]) for name in seen[0]}


def terms_of(aircraft: Aircraft) -> dict[tuple[str, str], float]:
    return {(d.coefficient, str(d.term)): d.value for d in aircraft.derivatives}


@pytest.mark.parametrize("values", [COUPLED, SIDE], ids=["six", "lateral"])
def test_jsbsim_flies_all_axes_as_the_suites_equations_do(values: Mapping[str, Mapping[str, float]]) -> None:
    """The error of its multistep integrators is quadratic in the frame: a quarter at half of it, 1e-5 at 0.001 s."""
    aircraft = commuter(values)
    flight = flown(aircraft, manoeuvre=CLIMBING, frame=0.0005)
    wanted = by_the_suite(flight, terms_of(as_flown(aircraft, 72.0, 1.02)), CLIMBING)
    for name in ("V", "alpha", "beta", "p", "q", "r", "phi", "theta", "psi", "h", "a_x", "a_y", "a_z"):
        assert np.ptp(wanted[name]) > 0.0
        assert np.abs(flight.log[name] - wanted[name]).max() < 1e-5 * np.ptp(wanted[name]), name
    assert flight.aircraft is aircraft
    assert flight.truth["trim"].keys() >= {"beta", "delta_a", "delta_r"}


def test_a_lateral_file_is_carried_by_what_the_truth_does_not_hold_against_it() -> None:
    flight = flown(commuter(SIDE), manoeuvre=STILL)
    assert {"V", "alpha", "q", "theta", "beta", "p", "r", "phi", "psi", "a_y", "delta_a", "delta_r"} <= set(
        flight.log.channels
    )
    assert not {d.coefficient for d in flight.aircraft.derivatives} & CARRYING.keys()
    rows = {(row["coefficient"], row["term"]): row for row in flight.truth["derivatives"]}
    assert rows["C_n", "delta_r"]["frozen"] == pytest.approx(SIDE["C_n"]["delta_r"], rel=1e-9)


def test_lateral_effects_change_what_they_say() -> None:
    """At the instant after each jump the accelerations are due to the jump, with I_xz."""
    aircraft = commuter(PITCH | SIDE)
    flight = flown(aircraft, "step_change:C_l=0.002@0.5", "step_change:C_n=-0.003@1", "C_Y:1=0.01@1.5", manoeuvre=STILL)
    states = flight.states
    force = 0.5 * 1.02 * states["V"] ** 2 * 39.0
    tensor = np.array([[27500.0, -1600.0], [-1600.0, 51000.0]])
    for time, moment in ((0.5, (0.002, 0.0)), (1.0, (0.0, -0.003))):
        k = round(time / 0.02)
        jump = np.array([states[n][k + 1] - states[n][k] for n in ("p_dot", "r_dot")])
        assert_allclose(jump, np.linalg.solve(tensor, force[k] * 19.8 * np.array(moment)), rtol=0.1, atol=4e-3)
    k = 75
    assert states["a_y"][k + 1] - states["a_y"][k] == pytest.approx(0.01 * force[k] / 4650.0, rel=0.15)


def test_sensors_and_surfaces_of_the_lateral_channels_err_as_told() -> None:
    arms = "sensor_position:a_y=1.2,0.3,-0.4", "sensor_position:beta=5,0,0.2", "sensor_bias:r=0.01"
    flight = flown(commuter(PITCH | SIDE), *arms, "control_lag:delta_r=0.12", "sensor_scale:phi=0.95")
    s, log = flight.states, flight.log
    x, y, z = 1.2, 0.3, -0.4
    felt = x * (s["r_dot"] + s["p"] * s["q"]) - y * (s["p"] ** 2 + s["r"] ** 2) + z * (s["q"] * s["r"] - s["p_dot"])
    assert_allclose(log["a_y"], s["a_y"] + felt, atol=1e-12)
    assert_allclose(log["beta"], s["beta"] + (5.0 * s["r"] - 0.2 * s["p"]) / s["V"], atol=1e-12)
    assert_allclose(log["r"], s["r"] + 0.01, rtol=1e-9)
    assert_allclose(log["phi"], 0.95 * s["phi"], rtol=1e-9)
    assert_allclose(s["rudder"], lagged(TIME, log["delta_r"][:, None], 0.12)[:, 0], atol=5e-4)
    assert_allclose(s["aileron"], log["delta_a"], atol=1e-12)


def test_an_inertia_that_flies_is_not_the_files() -> None:
    """Rudder alone: p' over r' at the first motion follows from the inertia tensor with the flown I_xz."""
    rudder = Manoeuvre(STILL.time, {"delta_r": 0.05 * np.clip((STILL.time - 0.5) / 0.02, 0.0, 1.0)}, "step")
    for i_xz in (1600.0, -4000.0):
        states = flown(commuter(PITCH | SIDE), f"inertia:I_xz={i_xz}", manoeuvre=rudder).states
        tensor = np.array([[27500.0, -i_xz], [-i_xz, 51000.0]])
        moment = np.array([SIDE["C_l"]["delta_r"], SIDE["C_n"]["delta_r"]])
        p_dot, r_dot = np.linalg.solve(tensor, moment)
        k = 26  # one sample into the step
        assert states["p_dot"][k] / states["r_dot"][k] == pytest.approx(
            p_dot / r_dot, rel=0.12
        )  # after a fifteenth of the roll mode's time constant


@pytest.mark.parametrize(
    ("effect", "words"),
    [("control_lag:delta_a=0.1", "delta_a"), ("sensor_bias:beta=0.1", "beta"), ("step_change:C_n=0.1", "C_n")],
)
def test_an_effect_that_the_aircraft_has_no_place_for_is_one_sentence(effect: str, words: str) -> None:
    with pytest.raises(UsageError, match=f"names {words}, but this aircraft's flight has"):
        flown(commuter(PITCH), effect)


def test_inputs_follow_one_another_unless_told() -> None:
    def given(control: str, shape: str, start: float | None = None) -> Any:
        return ControlInput(control, shape, 0.05, 0.5, start)

    made = sequence((given("delta_a", "doublet"), given("delta_r", "211")), None, 0.02)
    moved = {name: made.time[np.flatnonzero(values)] for name, values in made.deviations.items()}
    assert moved["delta_a"][[0, -1]] == pytest.approx([1.0, 1.98])
    assert moved["delta_r"][[0, -1]] == pytest.approx([6.0, 7.98])
    assert made.time[-1] == pytest.approx(12.0)
    twice = sequence((given("delta_a", "doublet"), given("delta_a", "doublet", 3.0)), 8.0, 0.02)
    assert np.flatnonzero(np.abs(twice.deviations["delta_a"])).size == 100
    with pytest.raises(UsageError, match="--duration 7 s ends before the 211 of delta_r that begins at 6 s"):
        sequence((given("delta_a", "doublet"), given("delta_r", "211")), 7.0, 0.02)
