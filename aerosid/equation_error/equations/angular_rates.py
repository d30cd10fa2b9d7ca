"""Angular rates and their derivatives, and the lever-arm accelerations of accelerometers off the centre of gravity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.equation_error.equations.inertial_coupling import levers
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.sensors import position
from aerosid.flight_model.axes import ACCELEROMETERS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rates:
    """Angular rates and their derivatives, (N,), rad/s and rad/s^2.

    The derivatives of rates that the case does not integrate are taken as zero.
    """

    p: Array
    q: Array
    r: Array
    p_dot: Array
    q_dot: Array
    r_dot: Array


def rates_of(recording: Recording, true: Mapping[str, Array]) -> Rates:
    """The rates, as measured and corrected, with their derivatives."""
    known: dict[str, Array] = {}
    for name in ("p", "q", "r"):
        if name in true:
            known[name] = true[name]
            known[f"{name}_dot"] = recording.derivative_of(name, true[name])
        else:
            known[name] = recording.measured_input(name)
            known[f"{name}_dot"] = np.zeros_like(known[name])
    return Rates(**known)


def lever_accelerations(channel: str, location: Sequence[float], rates: Rates) -> Array:
    """Additional acceleration of an accelerometer at a position, m from the centre of gravity, (N,) m/s^2."""
    x, y, z = map(float, location)
    return np.asarray(levers(ACCELEROMETERS.index(channel), x, y, z, *map(np.ascontiguousarray, vars(rates).values())))


def forces_at_centre(
    recording: Recording, effects: Sequence[ActiveEffect], true: Mapping[str, Array], rates: Rates
) -> dict[str, Array]:
    """Specific forces at the centre of gravity from the accelerometers that there are, m/s^2, (N,) each."""
    return {
        name: true[name] - lever_accelerations(name, position(recording, effects, name).tolist(), rates)
        for name in ACCELEROMETERS
        if name in recording.channels and name in true
    }
