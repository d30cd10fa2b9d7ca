"""Sensitivities to the positions of accelerometers and the sideslip vane, in closed form from the simulated motion.

The motion does not depend on them, and their readings are linear in position: specific force there is f + omega' x r +
omega x (omega x r), sideslip beta + (x r - z p)/V. Klein & Morelli, Aircraft System Identification, section 10.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, PositionEffect
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.axes import Axes, input_columns_of

Array = NDArray[np.float64]

LEVERS = ("a_x", "a_y", "a_z", "beta")
"""Channels whose sensitivities are known in closed form."""


def has_closed_form(active: ActiveEffect) -> bool:
    """Whether an effect is the position of one of these sensors, or of the accelerometers together."""
    return isinstance(active.effect, PositionEffect) and any(map(active.effect.moves, LEVERS))


def write_lever_slopes(
    block: Array,
    outputs: Array,
    inputs: Array,
    manoeuvre: Manoeuvre,
    effects: Sequence[ActiveEffect],
    first: int,
) -> None:
    """Write the sensitivity to each coordinate of a sensor's position into its column, in place.

    Parameters
    ----------
    block : ndarray, shape (N, m, K)
        Column `first` is that of the first effect's first parameter.
    outputs : ndarray, shape (N, m)
        Simulated, before the sensors' errors.
    inputs : ndarray, shape (N, c)
        Of the same samples.
    effects : sequence of ActiveEffect
        In the order of their columns.
    """
    place = first
    for active in effects:
        if isinstance(active.effect, PositionEffect) and has_closed_form(active) and active.acts_on(manoeuvre.name):
            for row, channel in enumerate(manoeuvre.axes.outputs):
                if not active.effect.moves(channel):
                    continue
                slopes = _position_sensitivities(manoeuvre.axes, outputs, inputs, channel)
                for number, axis in enumerate(active.effect.axes[: active.slopes]):
                    block[:, row, place + number] = slopes["xyz".index(axis)]
        place += active.slopes


def _position_sensitivities(axes: Axes, outputs: Array, inputs: Array, channel: str) -> tuple[Array, Array, Array]:
    """Change of a sensor's reading per metre forward, right and down, (N,) each."""
    leading = input_columns_of(axes)

    def known(name: str) -> Array:
        if name in axes.outputs:
            return outputs[:, axes.outputs.index(name)]
        return inputs[:, leading.index(name)] if name in leading else np.zeros(outputs.shape[0])

    p, q, r = known("p"), known("q"), known("r")
    if channel == "beta":
        return r / known("V"), np.zeros_like(r), -p / known("V")
    p_dot, q_dot, r_dot = known("p_dot"), known("q_dot"), known("r_dot")
    rows = {
        "a_x": (-(q * q + r * r), p * q - r_dot, p * r + q_dot),
        "a_y": (p * q + r_dot, -(p * p + r * r), q * r - p_dot),
        "a_z": (p * r - q_dot, q * r + p_dot, -(p * p + q * q)),
    }
    return rows[channel]
