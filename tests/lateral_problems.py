"""A commuter aircraft with lateral and longitudinal derivatives, and logs of its flights."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.flight_model.axes import state_vector
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS

HEAD = """
schema = 1
aircraft = { name = "commuter" }
reference = { wing_area = 39.0, mean_chord = 1.98, span = 19.8 }
mass = { mass = 4650.0, I_xx = 27500.0, I_yy = 32600.0, I_zz = 51000.0, I_xz = 1600.0 }
air = { density = 1.02 }
thrust = { force = 5000.0 }
"""
SIDE = {
    "C_Y": {"beta": -0.92, "r_hat": 0.67, "delta_r": 0.36},
    "C_l": {"beta": -0.13, "p_hat": -0.56, "r_hat": 0.2, "delta_a": -0.23, "delta_r": 0.04},
    "C_n": {"beta": 0.079, "p_hat": -0.064, "r_hat": -0.2, "delta_r": -0.15},
}
PITCH = {
    "C_X": {"1": -0.055, "alpha": 0.2, "alpha^2": 2.0},
    "C_Z": {"1": -0.31, "alpha": -5.4, "q_hat": -5.0, "delta_e": -0.4},
    "C_m": {"1": 0.02, "alpha": -0.9, "q_hat": -20.0, "delta_e": -1.7},
}


def commuter(values: Mapping[str, Mapping[str, float]], factor: float = 1.0) -> Aircraft:
    lines = [HEAD]
    for coefficient, terms in values.items():
        lines.append(f"[derivatives.{coefficient}]")
        lines += [f'"{term}" = {{ value = {factor * value} }}' for term, value in terms.items()]
    return aircraft_from_text("\n".join(lines) + "\n", "commuter.toml", "0" * 64)


def doublet(time: NDArray[np.float64], begin: float, size: float) -> NDArray[np.float64]:
    early, late = (time >= begin) & (time < begin + 0.8), (time >= begin + 0.8) & (time < begin + 1.6)
    return size * (1.0 * early - 1.0 * late)


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
