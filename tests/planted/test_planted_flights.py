"""The flights of benchmarks/wide_detection.py, by independent equations, agree with the package's simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lti

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.flight_model.simulation import fly, trim
from aerosid.logs.formats import read_log
from benchmarks.planted_aircraft import BODIES, Body
from benchmarks.planted_flights import NOISE, aircraft_text, csv_text, drawn, recorded, shape, simulated
from benchmarks.plants import overshooting, sticking


@pytest.mark.parametrize("body", [BODIES[1], BODIES[6]], ids=lambda body: body.name)
def test_two_simulations_agree_on_a_flight_without_anything_wrong(body: Body, tmp_path: Path) -> None:
    generator = np.random.default_rng(4)
    at = replace(drawn(generator), body=body, interval=0.02, duration=8.0, noise=0.0, elevator_noise=0.0, off=0.0)
    time = 0.02 * np.arange(401)
    asked = 0.02 * shape("3-2-1-1", time, 1.5, generator)
    motion, elevator, thrust = simulated(body, at, asked, time, (), [0])
    (tmp_path / "aircraft.toml").write_text(aircraft_text(at, thrust, False, [0]))
    (tmp_path / "log.csv").write_text(csv_text(recorded(motion, at, elevator + asked, (), [0], "log")))
    log, aircraft = read_log(tmp_path / "log.csv"), load_aircraft(tmp_path / "aircraft.toml")
    model = declared_model(aircraft, body.airspeed)
    level = trim(model, body.airspeed, body.density, body.mass)
    silent = dict.fromkeys(NOISE, 0.0)
    wanted = fly(model, level, time, asked, density=body.density, mass=body.mass, noise=silent, seed=0)
    assert thrust == pytest.approx(level.thrust, rel=1e-6)
    for name, size in NOISE.items():
        # Seven digits in the log, five in the aircraft file; a thousandth of the noise but for the altitude's digits.
        assert np.abs(log[name] - wanted[name]).max() < max(0.02 * size, 2e-4 if name == "h" else 0.0), name


def test_a_sticking_surface_and_one_that_overshoots_do_what_their_equations_say() -> None:
    time = np.arange(4001) * 0.001
    step = 0.1 * (time > 0.0)
    _, wanted = lti([81.0], [1.0, 2.0 * 0.35 * 9.0, 81.0]).step(T=time)
    # Two poles without the zeros that a sampled step has: a sample's worth of time.
    assert np.abs(overshooting(time, step, 9.0, 0.35) - 0.1 * wanted).max() < 0.1 * 9.0 * 0.001
    stuck = sticking(np.array([0.0, 0.01, 0.02, 0.031, 0.04, 0.0, 0.02]), 0.03)
    np.testing.assert_array_equal(stuck, [0.0, 0.0, 0.0, 0.031, 0.031, 0.0, 0.0])
