"""Sensitivities by central differences of whole simulations: numbers of the aircraft's body and of the vane's place.

What no input column carries, and no closed form gives from the simulated motion, as `lever_slopes` does where sensors
of accelerations and sideslip sit. A moment of inertia moves the motion, and the difference errs by the square of its
step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, BodyEffect, PositionEffect, StateEffect
from aerosid.estimation.effects_in_flight import OutOfRangeError, acting_flight, acting_model
from aerosid.estimation.lever_slopes import has_closed_form
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.motion_loop import self_consistent
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.flight import simulate_outputs


def slopes_by_simulation(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    values: NDArray[np.float64],
    state: NDArray[np.float64],
    effects: Sequence[ActiveEffect],
    tested: Sequence[ActiveEffect] = (),
) -> dict[int, NDArray[np.float64]]:
    """How the outputs (N, m), before the sensors' faults, move with each number of a body's or a position's effect.

    Parameters
    ----------
    values : ndarray, shape (T,)
        Of the model's terms.
    state : ndarray, shape (n,)
        The initial one, SI.
    effects : sequence of ActiveEffect
        Those that act.
    tested : sequence of ActiveEffect
        Those that do not, whose slopes are wanted as well.

    Returns
    -------
    dict of int to ndarray, shape (N, m)
        The key is the number's place among those of all effects, acting ones first.

    Raises
    ------
    OutOfRangeError
        Where a simulation leaves the model's range.
    """
    found: dict[int, NDArray[np.float64]] = {}
    place = 0
    for n, active in enumerate((*effects, *tested)):
        asked = isinstance(active.effect, PositionEffect | BodyEffect) and not has_closed_form(active)
        if asked and active.acts_on(manoeuvre.name):
            others = [other for m, other in enumerate(effects) if m != n]
            for parameter, number in enumerate(active.effect.parameters[: active.slopes]):
                sides = active.beside(parameter, number.step), active.beside(parameter, -number.step)
                upper, lower = (_outputs(model, manoeuvre, values, state, [*others, side]) for side in sides)
                width = sides[0].values[parameter] - sides[1].values[parameter]
                found[place + parameter] = (upper - lower) / width
        place += active.slopes
    return found


def _outputs(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    values: NDArray[np.float64],
    state: NDArray[np.float64],
    effects: Sequence[ActiveEffect],
) -> NDArray[np.float64]:
    """The outputs (N, m) of a simulation, before the faults of the sensors."""
    model = acting_model(model, effects)
    flight, _ = acting_flight(model, manoeuvre, effects)
    if any(isinstance(active.effect, StateEffect) for active in effects):
        flight, _ = self_consistent(model, flight, values, state, effects, manoeuvre.ground)
    outputs, _ = simulate_outputs(state, flight, values, model.table, model.constants)
    if not np.isfinite(outputs).all():
        raise OutOfRangeError
    return outputs
