"""Force equations without accelerometers: forces from air data, compared behind a low-pass.

    a_x = u' + q w - r v + g sin theta,   a_y = v' + r u - p w - g cos theta sin phi,
    a_z = w' - q u + p v - g cos theta cos phi

(Klein & Morelli, Aircraft System Identification, eqs. 10.3, solved for the specific forces). Their noise is that of the
air data differentiated: little at low frequencies, where drag acts, and much at the end of the band. An autoregression
of low order cannot represent noise whose power vanishes at frequency zero. Every column of such an equation therefore
passes

    F(s) = 1/(1 + T s),   T F(s) u' = u - F(s) u,

which turns the derivative into the measured velocity itself above 1/(2 pi T), and its noise white again: the Poisson
moment functional of first order (Unbehauen & Rao, Automatica 26 (1990) 23). Relations between columns remain linear.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.angular_rates import Rates
from aerosid.equation_error.equations.channels import MEASURED_BY, equations_of
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.running_integral import derivative
from aerosid.flight_model.axes import ACCELERATIONS
from aerosid.flight_model.constants import GRAVITY
from aerosid.signals.recursive_filter import butterworth_sections, filtered

Array = NDArray[np.float64]


def with_derived_forces(
    recording: Recording,
    forces: Mapping[str, Array],
    velocities: tuple[Array, Array, Array],
    rates: Rates,
    attitude: tuple[Array, Array],
) -> dict[str, Array]:
    """The specific forces, m/s^2, (N,) each, those that no accelerometer measures from the air data.

    Parameters
    ----------
    forces : mapping of str to ndarray, shape (N,)
        Measured ones at the centre of gravity.
    velocities : tuple of ndarray, shape (N,)
        u, v, w, m/s.
    attitude : tuple of ndarray, shape (N,)
        Bank and pitch angle, rad.
    """
    missing = [name for name in equations_of(recording.manoeuvre.axes).accelerometers if name not in forces]
    if not missing:
        return dict(forces)
    (u, v, w), (phi, theta) = velocities, attitude
    velocity_and_rest = {
        "a_x": (u, rates.q * w - rates.r * v + GRAVITY * np.sin(theta)),
        "a_y": (v, rates.r * u - rates.p * w - GRAVITY * np.cos(theta) * np.sin(phi)),
        "a_z": (w, rates.p * v - rates.q * u - GRAVITY * np.cos(theta) * np.cos(phi)),
    }
    derived = {
        name: derivative(velocity_and_rest[name][0], recording.interval) + velocity_and_rest[name][1]
        for name in missing
    }
    return {**forces, **derived}


def is_derived(recording: Recording, equation: str) -> bool:
    """Whether a coefficient's equation is formed from differentiated air data, for lack of its accelerometer."""
    channel = MEASURED_BY[equation]
    return channel in ACCELERATIONS and channel not in recording.channels


def low_passed(columns: Array, interval: float, time_constant: float) -> Array:
    """Columns (N, K) behind the low-pass, (N, K), from their means: a start at the first sample would hold its noise.

    `time_constant`: T, s.
    """
    section = butterworth_sections(1, 0.5 / (np.pi * time_constant), interval)
    means = columns.mean(axis=0)
    at_rest = np.zeros((section.shape[0], 2, columns.shape[1]))
    return np.asarray(filtered(section, np.ascontiguousarray(columns - means), at_rest) + means)
