"""Flights of JSBSim: against our own simulation, against published numbers of its aircraft, and each effect's sign."""

from __future__ import annotations

import numpy as np
import pytest
from problems import BOTH_SQUARES, LIGHT, SILENT, declaring

from aerosid.aerodynamics import declared_model
from aerosid.jsbsim_flight.elevator_inputs import manoeuvre
from aerosid.jsbsim_flight.flight import fly_jsbsim
from aerosid.jsbsim_flight.plan import FlightPlan, JsbsimFlight
from aerosid.simulation import fly, trim

pytest.importorskip("jsbsim", reason="JSBSim flies here")

DOUBLET = manoeuvre("doublet", 0.06, 1.02, 14.01, 0.03)
PAPER = declaring(LIGHT, BOTH_SQUARES)


def silent(**further: object) -> JsbsimFlight:
    return fly_jsbsim(FlightPlan(**({"manoeuvre": DOUBLET, "airspeed": 100.0, "noise": 0.0} | further)))  # type: ignore[arg-type]


def test_jsbsim_flies_the_papers_equations_as_we_do() -> None:
    flown = silent(aircraft=PAPER)
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
        assert np.abs(flown.states[name] - values).max() < 5e-5 * np.ptp(values), name
    for name in ("V", "alpha", "delta_e"):
        assert np.abs(flown.log[name] - ours[name]).max() < 5e-5 * np.ptp(ours[name]), name
    assert flown.log["thrust"] == pytest.approx(level.thrust, rel=1e-6)
