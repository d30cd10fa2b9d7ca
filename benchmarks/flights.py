"""Long flights for timing: the light transport, elevator doublets without end, noise on every channel."""

from __future__ import annotations

import numpy as np

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.simulation import fly, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog

INTERVAL = 0.03
"""s, that of Parameswaran & Raol 1994."""

PERIOD = 14.1
"""s from one doublet to the next: as long as a sample flight."""

WIDTH = 1.02
"""s of each half of a doublet."""

AMPLITUDE = 0.06
"""rad."""

UNDECLARED = {("C_X", parse_term("alpha^2")): 3.6089, ("C_m", parse_term("alpha^2")): -1.715}

NOISE = {"V": 0.15, "alpha": 0.0015, "q": 0.0012, "theta": 0.0012, "a_x": 0.02, "a_z": 0.05, "delta_e": 0.0002}
"""Standard deviations, SI. Altitude is not recorded: in hours of doublets the aircraft would sink below the sea."""


def light_transport() -> Aircraft:
    """The aircraft as declared, without its alpha^2 terms."""
    return load_aircraft("light_transport")


def long_flight(samples: int, seed: int = 0, interval: float = INTERVAL) -> FlightLog:
    """A flight of `samples` samples every `interval` s: doublets of alternating sense every 14 s keep it near trim."""
    aircraft = light_transport()
    assert aircraft.density is not None  # the file gives it
    model = flown_model(aircraft)
    elevator = np.zeros(samples)
    width = round(WIDTH / interval)
    for number, start in enumerate(range(width, samples, round(PERIOD / interval))):
        height = AMPLITUDE if number % 2 == 0 else -AMPLITUDE
        elevator[start : start + width] = height
        elevator[start + width : start + 2 * width] = -height
    return fly(
        model,
        trim(model, 100.0, aircraft.density, aircraft.mass),
        np.arange(samples, dtype=np.float64) * interval,
        elevator,
        density=aircraft.density,
        mass=aircraft.mass,
        noise=NOISE,
        seed=seed,
        name=f"{samples} samples",
    )


def flown_model(aircraft: Aircraft) -> AerodynamicModel:
    """What is flown: the declared model with its alpha^2 terms."""
    model = declared_model(aircraft, 100.0).extended(UNDECLARED)
    values = model.values.copy()
    for entry, value in UNDECLARED.items():
        values[model.index(entry)] = value
    return model.with_values(values)
