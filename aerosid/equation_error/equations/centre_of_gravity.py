"""Centre of gravity elsewhere than declared, and the moments that the modelled forces make about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.aerodynamics import AerodynamicModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Centre:
    """How far the centre of gravity lies ahead of, right of and below the declared one, m, (N,) each."""

    ahead: Array
    right: Array
    below: Array

    @property
    def is_moved(self) -> bool:
        """Whether it lies elsewhere at any time."""
        return bool(self.ahead.any() or self.right.any() or self.below.any())


def centre_of(model: AerodynamicModel, columns: Mapping[str, Array]) -> Centre:
    """Where the centre of gravity lies."""
    zero = np.zeros_like(columns["rho"])
    places = (model.constants.cg_x, model.constants.cg_y, model.constants.cg_z)
    return Centre(*(zero if place < 0 else columns[model.extra_columns[place]] for place in places))


def levers(forces: Mapping[str, Array], centre: Centre) -> dict[str, Array]:
    """Moment over mass that modelled forces make about a centre of gravity elsewhere, m^2/s^2, (N,) each."""
    x, y, z = (forces.get(name) for name in ("C_X", "C_Y", "C_Z"))
    found = {}
    if x is not None and z is not None:
        found["C_m"] = centre.ahead * z - centre.below * x
    if y is not None and z is not None:
        found["C_l"] = centre.below * y - centre.right * z
    if x is not None and y is not None:
        found["C_n"] = centre.right * x - centre.ahead * y
    return found
