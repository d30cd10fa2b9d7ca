"""A commuter aircraft with lateral and longitudinal derivatives, and logs of its flights."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text

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
