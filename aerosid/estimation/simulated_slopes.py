"""Sensitivities by central differences of whole simulations: moments of inertia and the vane's position.

For parameters without an input column and without a closed form from the simulated motion, as `lever_slopes` has for
positions of accelerometers and the sideslip vane. The motion depends on a moment of inertia; the error of the
difference is of second order in its step.
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
    """Sensitivities of the outputs (N, m), before the sensors' errors, to the parameters of body and position effects.

    Parameters
    ----------
    values : ndarray, shape (T,)
        Of the model's terms.
    state : ndarray, shape (n,)
        The initial one, SI.
    effects : sequence of ActiveEffect
        Those that act.
    tested : sequence of ActiveEffect
        Those that do not, whose sensitivities are computed as well.

    Returns
    -------
    dict of int to ndarray, shape (N, m)
        The key is the parameter's index among those of all effects, acting ones first.

    Raises
    ------
    OutOfRangeError
        Where a simulation leaves the model's range.
    """
    found: dict[int, NDArray[np.float64]] = {}
    place = 0
    for n, active in enumerate((*effects, *tested)):
        is_simulated = isinstance(active.effect, PositionEffect | BodyEffect) and not has_closed_form(active)
        if is_simulated and active.acts_on(manoeuvre.name):
            others = [other for m, other in enumerate(effects) if m != n]
            for parameter, number in enumerate(active.effect.parameters[: active.slopes]):
                sides = active.perturbed(parameter, number.step), active.perturbed(parameter, -number.step)
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
    """The outputs (N, m) of a simulation, before the sensors' errors."""
    model = acting_model(model, effects)
    flight, _ = acting_flight(model, manoeuvre, effects)
    if any(isinstance(active.effect, StateEffect) for active in effects):
        flight, _ = self_consistent(model, flight, values, state, effects, manoeuvre.ground)
    outputs, _ = simulate_outputs(state, flight, values, model.table, model.constants)
    if not np.isfinite(outputs).all():
        raise OutOfRangeError
    return outputs
