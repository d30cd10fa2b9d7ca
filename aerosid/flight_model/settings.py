"""Settings of simulations: where a flight has left what a model can describe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

FLOWN = MappingProxyType({"alpha": 0.6, "beta": 0.6, "phi": 0.6, "delta_e": 1.0, "delta_a": 1.0, "delta_r": 1.0})
"""rad, by name: angles and deflections in which somebody flies straight and level."""


@dataclass(frozen=True)
class SimulationSettings:
    """Limits of simulated motion; chosen.

    Attributes
    ----------
    flow_angle : float
        Angle of attack or sideslip, rad, from which on a simulation has failed: the model is not meant for tumbling.
    trim : mapping of str to float
        Angle or deflection, rad, beyond which a balance is none that anybody flies.
    """

    flow_angle: float = 1.5
    trim: Mapping[str, float] = field(default_factory=lambda: FLOWN)


SIMULATION = SimulationSettings()
