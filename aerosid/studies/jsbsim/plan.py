"""Flight plan for JSBSim, and the result of the flight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.flight_model.axes import LATERAL, LONGITUDINAL
from aerosid.logs.flight_log import FlightLog
from aerosid.studies.jsbsim.control_inputs import Manoeuvre
from aerosid.studies.jsbsim.injected import InjectedEffect

Array = NDArray[np.float64]

USUAL_NOISE: Mapping[str, float] = MappingProxyType(
    {
        "V": 0.15,
        "alpha": 0.0015,
        "q": 0.0012,
        "theta": 0.0012,
        "a_x": 0.02,
        "a_z": 0.05,
        "h": 0.3,
        "delta_e": 0.0002,
        "beta": 0.0015,
        "p": 0.0012,
        "r": 0.0012,
        "phi": 0.0012,
        "psi": 0.0015,
        "a_y": 0.02,
        "delta_a": 0.0002,
        "delta_r": 0.0002,
    }
)
"""Standard deviations of good flight-test sensors, SI; a flight records those that its aircraft moves."""


@dataclass(frozen=True)
class FlightPlan:
    """One flight of JSBSim.

    Attributes
    ----------
    aircraft : Aircraft or str
        An aerosid aircraft, or the name of one of JSBSim's.
    manoeuvre : Manoeuvre
        The controls.
    airspeed : float
        m/s, of the trim.
    altitude : float
        m, of the trim.
    effects : tuple of InjectedEffect
        Injected effects, not declared in the aircraft file.
    noise : float
        Factor on `USUAL_NOISE`; 0: none.
    seed : int
        Of noise and turbulence.
    planes : tuple of str
        Names of the planes of motion in the declared file of an aircraft of JSBSim, as far as it flies in them.
    longest_frame : float
        s; the frames of JSBSim divide the manoeuvre's interval and are at most this long.
    """

    aircraft: Aircraft | str
    manoeuvre: Manoeuvre
    airspeed: float
    altitude: float = 1500.0
    effects: tuple[InjectedEffect, ...] = ()
    noise: float = 1.0
    seed: int = 0
    planes: tuple[str, ...] = (LONGITUDINAL.name, LATERAL.name)
    longest_frame: float = 0.001


@dataclass(frozen=True)
class JsbsimFlight:
    """Result of a simulated flight.

    Attributes
    ----------
    log : FlightLog
        As recorded.
    aircraft : Aircraft
        The declared model: the aircraft file itself, or the linear model of an aircraft of JSBSim about its trim.
    truth : mapping
        True parameters, as in the truth file.
    states : mapping of str to (N,)
        True values at the samples, SI: u, v, w, p, q, r, phi, theta, psi, V, alpha, beta, h, a_x, a_y, a_z, p_dot,
        q_dot, r_dot, surface (elevator), aileron, rudder, mass, rho.
    """

    log: FlightLog
    aircraft: Aircraft
    truth: Mapping[str, Any]
    states: Mapping[str, Array] = field(repr=False)
