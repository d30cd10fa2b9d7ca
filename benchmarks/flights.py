"""Long flights for timing: the light transport, elevator doublets without end, noise on every channel."""

from __future__ import annotations

import numpy as np

from aerosid.aerodynamics import AerodynamicModel, declared_model
from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.flight_log import FlightLog
from aerosid.simulation import fly, trim
from aerosid.terms import parse_term

INTERVAL = 0.03
"""s, that of Parameswaran & Raol 1994."""

PERIOD = 470
"""Samples from one doublet to the next: 14 s, as long as a sample flight."""

WIDTH = 34
"""Samples of each half of a doublet: 1 s."""

AMPLITUDE = 0.06
"""rad."""

UNDECLARED = {("C_X", parse_term("alpha^2")): 3.6089, ("C_m", parse_term("alpha^2")): -1.715}

NOISE = {"V": 0.15, "alpha": 0.0015, "q": 0.0012, "theta": 0.0012, "a_x": 0.02, "a_z": 0.05, "delta_e": 0.0002}
"""Standard deviations, SI. Altitude is not recorded: in hours of doublets the aircraft would sink below the sea."""


def light_transport() -> Aircraft:
    """The aircraft as declared, without its alpha^2 terms."""
    return load_aircraft("light_transport")


def long_flight(samples: int, seed: int = 0) -> FlightLog:
    """A flight of `samples` samples, doublets of alternating sense every 14 s so that it stays near trim."""
    aircraft = light_transport()
    assert aircraft.density is not None  # the file gives it
    model = _flown(aircraft)
    elevator = np.zeros(samples)
    for number, start in enumerate(range(WIDTH, samples, PERIOD)):
        height = AMPLITUDE if number % 2 == 0 else -AMPLITUDE
        elevator[start : start + WIDTH] = height
        elevator[start + WIDTH : start + 2 * WIDTH] = -height
    return fly(
        model,
        trim(model, 100.0, aircraft.density, aircraft.mass),
        np.arange(samples, dtype=np.float64) * INTERVAL,
        elevator,
        density=aircraft.density,
        mass=aircraft.mass,
        noise=NOISE,
        seed=seed,
        name=f"{samples} samples",
    )


def _flown(aircraft: Aircraft) -> AerodynamicModel:
    model = declared_model(aircraft, 100.0).extended(UNDECLARED)
    values = model.values.copy()
    for entry, value in UNDECLARED.items():
        values[model.index(entry)] = value
    return model.with_values(values)
