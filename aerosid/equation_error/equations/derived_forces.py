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
from aerosid.signals.recursive_filter import butterworth_sections, filtered_from_rest

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
    (u, v, w), (phi, theta) = velocities, attitude
    found = dict(forces)
    for name in equations_of(recording.manoeuvre.axes).accelerometers:
        if name not in found:
            velocity, known = {
                "a_x": (u, rates.q * w - rates.r * v + GRAVITY * np.sin(theta)),
                "a_y": (v, rates.r * u - rates.p * w - GRAVITY * np.cos(theta) * np.sin(phi)),
                "a_z": (w, rates.p * v - rates.q * u - GRAVITY * np.cos(theta) * np.cos(phi)),
            }[name]
            found[name] = derivative(velocity, recording.interval) + known
    return found


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
    return np.column_stack(
        [filtered_from_rest(section, column - mean) + mean for column, mean in zip(columns.T, means, strict=True)]
    )
