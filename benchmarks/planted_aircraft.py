"""Eight aircraft from glider to jet transport, with derivatives of the usual size for their kind."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

STRUCTURE = {
    "C_X": ("1", "alpha"),
    "C_Z": ("1", "alpha", "q_hat", "delta_e"),
    "C_m": ("1", "alpha", "q_hat", "delta_e"),
}


@dataclass(frozen=True)
class Body:
    """An aircraft: SI, and its derivatives in the order of `STRUCTURE`; that of C_m is stick-fixed."""

    name: str
    mass: float
    I_yy: float
    wing_area: float
    mean_chord: float
    airspeed: float
    density: float
    C_X: tuple[float, float]
    C_Z: tuple[float, float, float, float]
    C_m: tuple[float, float, float, float]

    @property
    def terms(self) -> dict[tuple[str, str], float]:
        """Every declared term with its value."""
        return {(c, t): v for c, names in STRUCTURE.items() for t, v in zip(names, getattr(self, c), strict=True)}

    @property
    def short_period(self) -> float:
        """Undamped, rad/s, from C_m_alpha alone."""
        pressure = 0.5 * self.density * self.airspeed**2
        return math.sqrt(max(-self.C_m[1], 0.1) * pressure * self.wing_area * self.mean_chord / self.I_yy)


BODIES = (
    Body(
        "single",
        1040.0,
        1820.0,
        16.2,
        1.49,
        55.0,
        1.1,
        (-0.035, 0.28),
        (-0.28, -4.9, -4.2, -0.42),
        (0.03, -0.85, -13.0, -1.2),
    ),
    Body(
        "glider",
        380.0,
        620.0,
        11.0,
        0.74,
        32.0,
        1.05,
        (-0.014, 0.45),
        (-0.42, -5.6, -5.5, -0.38),
        (0.06, -0.7, -17.0, -1.1),
    ),
    Body(
        "twin",
        4200.0,
        27500.0,
        27.9,
        1.98,
        88.0,
        0.95,
        (-0.03, 0.24),
        (-0.2, -5.3, -7.5, -0.55),
        (0.04, -1.6, -24.0, -1.7),
    ),
    Body(
        "turboprop trainer",
        2650.0,
        7300.0,
        16.3,
        1.8,
        105.0,
        0.9,
        (-0.028, 0.21),
        (-0.13, -4.8, -5.0, -0.5),
        (0.03, -0.6, -15.0, -1.35),
    ),
    Body(
        "business jet",
        5900.0,
        25600.0,
        21.6,
        2.14,
        150.0,
        0.7,
        (-0.027, 0.19),
        (-0.12, -5.6, -6.0, -0.46),
        (0.04, -0.68, -16.0, -1.24),
    ),
    Body(
        "jet trainer",
        4400.0,
        23500.0,
        18.8,
        2.15,
        135.0,
        0.85,
        (-0.025, 0.17),
        (-0.1, -4.6, -4.0, -0.4),
        (0.02, -0.5, -11.0, -1.0),
    ),
    Body(
        "airliner",
        52000.0,
        1.85e6,
        105.4,
        3.9,
        150.0,
        0.65,
        (-0.03, 0.22),
        (-0.25, -5.4, -7.0, -0.42),
        (0.07, -1.3, -23.0, -1.25),
    ),
    Body(
        "heavy",
        255000.0,
        4.4e7,
        511.0,
        8.3,
        160.0,
        0.7,
        (-0.032, 0.25),
        (-0.26, -5.7, -5.8, -0.36),
        (0.08, -1.2, -21.0, -1.4),
    ),
)


def declared_derivatives(
    terms: Mapping[tuple[str, str], float], coefficients: Sequence[str], off: float, generator: np.random.Generator
) -> list[str]:
    """Lines of an aircraft file that declare derivatives, each `off` by a share at random."""
    lines = []
    for coefficient in coefficients:
        lines.append(f"[derivatives.{coefficient}]")
        for (name, term), value in terms.items():
            if name == coefficient:
                lines.append(f'"{term}" = {{ value = {value * (1.0 + off * generator.standard_normal())!r} }}')
    return lines
