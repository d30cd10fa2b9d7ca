"""Derivatives of lateral and six-axis models from simulated flights whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lateral_problems import PITCH, SIDE, commuter, doublet

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.manoeuvre import prepare
from aerosid.estimation.maximum_likelihood import refine
from aerosid.estimation.open_loop import respond
from aerosid.flight_model.axes import state_vector
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS

NOISE = {
    "V": 0.15, "alpha": 0.0015, "beta": 0.0015, "p": 0.0015, "q": 0.001, "r": 0.001, "phi": 0.001, "theta": 0.001,
    "psi": 0.0015, "a_x": 0.02, "a_y": 0.03, "a_z": 0.05, "h": 0.3,
}  # fmt: skip


def flown(aircraft: Aircraft, seed: int) -> FlightLog:
    """Elevator, aileron and rudder doublets; measured motion with its noise, controls without."""
    model = declared_model(aircraft, 72.0)
    time = np.arange(0.0, 14.0, 0.04)
    controls = {"delta_a": doublet(time, 1.0, 0.06), "delta_r": doublet(time, 4.0, 0.05)}
    given = {"rho": 1.02, "thrust": 5000.0, "mass": 4650.0, "speed_of_sound": 340.0}
    given |= {"V": 72.0 + 0.5 * np.sin(0.3 * time), "alpha": 0.02 + 0.004 * np.sin(0.5 * time), "theta": 0.02}
    given |= controls | {"delta_e": 0.0012 + doublet(time, 7.0, 0.02)}
    inputs = np.column_stack([np.broadcast_to(given.get(name, 0.0), time.shape) for name in model.columns])
    axes = aircraft.axes
    rows = len(axes.outputs)
    flight = Flight(time, inputs, np.zeros((0, rows)), np.zeros((rows, 3)), 6, np.zeros(len(model.extra_columns)))
    start = state_vector(axes, {"u": 71.98, "w": 1.44, "theta": 0.02, "h": 1500.0})
    outputs, _ = simulate_outputs(start, flight, np.array(model.values), model.table, model.constants)
    assert np.isfinite(outputs).all()
    rng = np.random.default_rng(seed)
    channels = {name: np.array(inputs[:, model.columns.index(name)]) for name in axes.measured}
    channels |= {
        name: inputs[:, model.columns.index(name)]
        for name in ("delta_a", "delta_r", "delta_e")
        if name in model.columns
    }
    for name, values in zip(axes.outputs, outputs.T, strict=True):
        if name in NOISE:
            channels[name] = values + NOISE[name] * rng.standard_normal(time.size)
    return FlightLog("flight", time, channels, {name: CHANNELS[name].unit for name in channels})


@pytest.mark.parametrize(
    "values", [SIDE, pytest.param(PITCH | SIDE, marks=pytest.mark.slow)], ids=["lateral", "six degrees of freedom"]
)
def test_derivatives_come_back_within_their_bounds(values: dict[str, dict[str, float]]) -> None:
    truth, declared = commuter(values), commuter(values, 0.85)
    log, other = flown(truth, 1), replace(flown(truth, 2), name="other")
    model = declared_model(declared, 72.0)
    manoeuvre, unseen = (prepare(flight, declared, model.columns) for flight in (log, other))
    found = refine(model, [manoeuvre], model.entries)
    wanted = np.array([values[coefficient][str(term)] for coefficient, term in model.entries])
    deviations = np.sqrt(np.diag(found.covariance))[: wanted.size]
    assert np.max(np.abs(found.model.values - wanted) / deviations) < 4.5  # 27 numbers: 2 in 10,000 by chance
    assert np.max(deviations / np.abs(wanted)) < 0.5
    for flight in (manoeuvre, unseen):
        for channel, error in respond(found.model, flight, found.variance).rms.items():
            assert error is not None
            assert error < 1.15 * NOISE[channel]


def test_a_vane_on_a_boom_is_corrected_for_where_alpha_is_an_input() -> None:
    aircraft = commuter(SIDE)
    log = flown(aircraft, 1)
    moved = replace(log, positions={"alpha": (5.0, 0.4, 0.0)})
    columns = declared_model(aircraft, 72.0).columns
    plain, corrected = (prepare(flight, aircraft, columns).flight.inputs for flight in (log, moved))
    place = columns.index("alpha")
    wanted = plain[:, place] + (log["q"] * 5.0 - log["p"] * 0.4) / log["V"]
    np.testing.assert_allclose(corrected[:, place], wanted, rtol=0.0, atol=1e-12)
