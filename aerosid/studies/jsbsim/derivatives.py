"""Derivatives of JSBSim's own aerodynamics by central differences, with alphadot frozen and self-consistent.

A force that depends on alphadot varies with alpha, q and the elevator as soon as the aircraft is free to respond. A
model without alphadot can only find the self-consistent derivative; with alphadot it finds the frozen one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.axes import LATERAL
from aerosid.studies.jsbsim.executive import Executive, State

Array = NDArray[np.float64]

COEFFICIENTS = ("C_X", "C_Z", "C_m")
VARIABLES = ("alpha", "q_hat", "delta_e", "V_hat")
_CLIMB = 0.6
"""Numerical: rad; a flight-path angle that changes only alphadot."""

_STEPS = {"alpha": 0.0026, "q": 0.005, "delta_e": 0.0026, "airspeed": 0.5}
"""Numerical: rad, rad/s and m/s, of central differences."""


LATERAL_COEFFICIENTS = LATERAL.coefficients
LATERAL_VARIABLES = ("beta", "p_hat", "r_hat", "delta_a", "delta_r")
_LATERAL_STEPS = {"beta": 0.0026, "p": 0.01, "r": 0.005, "delta_a": 0.0026, "delta_r": 0.0026}
"""Numerical: rad and rad/s, of central differences."""


@dataclass(frozen=True)
class Slopes:
    """Derivatives (3, 4) of `COEFFICIENTS` with respect to `VARIABLES` about a state.

    `at` (3,) the coefficients there; `self_consistent`, `frozen` (3, 4); `chord` (3, 4) self-consistent between the
    ends of the flown range, NaN where a variable did not move; `alpha_dot_hat` (3,).
    """

    at: Array
    self_consistent: Array
    frozen: Array
    chord: Array
    alpha_dot_hat: Array

    def as_lists(self) -> dict[str, Any]:
        """For JSON; NaN becomes None."""
        return {
            name: [[None if not math.isfinite(x) else x for x in row] for row in np.atleast_2d(getattr(self, name))]
            for name in ("at", "self_consistent", "frozen", "chord", "alpha_dot_hat")
        }


def differentiate(executive: Executive, trimmed: State, flown: Mapping[str, tuple[float, float]]) -> Slopes:
    """Derivatives about a trim.

    Parameters
    ----------
    executive : Executive
        The aircraft.
    trimmed : State
        Trim condition.
    flown : mapping of str to (float, float)
        Least and greatest alpha [rad], q [rad/s], delta_e [rad] and airspeed [m/s] of the manoeuvre.
    """
    rate_scale = executive.mean_chord / (2.0 * trimmed.airspeed)
    to_variable = {"alpha": 1.0, "q": rate_scale, "delta_e": 1.0, "airspeed": 1.0 / trimmed.airspeed}

    def settled(state: State) -> tuple[Array, float]:
        executive.freeze(state)
        return executive.coefficients(), executive["aero/alphadot-rad_sec"] * rate_scale

    at, rate = settled(trimmed)
    climbing, slower = settled(replace(trimmed, path_angle=_CLIMB))
    alpha_dot_hat = (climbing - at) / (slower - rate)
    consistent, frozen, chord = (np.zeros((3, 4)) for _ in range(3))
    for column, (name, step) in enumerate(_STEPS.items()):
        here = getattr(trimmed, name)
        above, rate_above = settled(replace(trimmed, **{name: here + step}))
        below, rate_below = settled(replace(trimmed, **{name: here - step}))
        width = 2.0 * step * to_variable[name]
        consistent[:, column] = (above - below) / width
        frozen[:, column] = consistent[:, column] - alpha_dot_hat * (rate_above - rate_below) / width
        low, high = flown.get(name, (here, here))
        if high - low < step:
            chord[:, column] = np.nan
            continue
        top, _ = settled(replace(trimmed, **{name: high}))
        bottom, _ = settled(replace(trimmed, **{name: low}))
        chord[:, column] = (top - bottom) / ((high - low) * to_variable[name])
    return Slopes(at, consistent, frozen, chord, alpha_dot_hat)


def differentiate_sideways(
    executive: Executive, trimmed: State, flown: Mapping[str, tuple[float, float]]
) -> dict[str, list[list[float]]]:
    """Derivatives (3, 5) of `LATERAL_COEFFICIENTS` with respect to `LATERAL_VARIABLES`: local, and over a range.

    Parameters
    ----------
    executive : Executive
        The aircraft.
    trimmed : State
        Trim state.
    flown : mapping of str to (float, float)
        Least and greatest beta, delta_a and delta_r [rad], p and r [rad/s] of the manoeuvre.
    """
    half = executive.span / (2.0 * trimmed.airspeed)

    def settled(**changed: float) -> Array:
        executive.freeze(replace(trimmed, **changed))
        return executive.lateral_coefficients()

    local, chord = np.zeros((3, 5)), np.zeros((3, 5))
    for column, (name, step) in enumerate(_LATERAL_STEPS.items()):
        here, scale = getattr(trimmed, name), half if name in ("p", "r") else 1.0
        rise = settled(**{name: here + step}) - settled(**{name: here - step})
        local[:, column] = rise / (2.0 * step * scale)
        low, high = flown[name]
        chord[:, column] = local[:, column]
        if high - low >= step:
            chord[:, column] = (settled(**{name: high}) - settled(**{name: low})) / ((high - low) * scale)
    return {"at": [settled().tolist()], "local": local.tolist(), "chord": chord.tolist()}
