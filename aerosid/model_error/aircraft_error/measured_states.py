"""The coupled states of an aircraft as measured, with the covariance of each sample.

Airspeed and the angles of the flow enter as velocity components, with the covariance that goes with them: the
observation is then linear.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.axes import LONGITUDINAL, Axes, coupled_of, fed_of, input_columns_of
from aerosid.flight_model.flight import Flight


class FedStates(NamedTuple):
    """The coupled states as measured, (N, c), NaN where missing; R^-1 and R of each sample, (N, c, c)."""

    states: NDArray[np.float64]
    weights: NDArray[np.float64]
    covariance: NDArray[np.float64]


def measured_motion(
    flight: Flight, axes: Axes = LONGITUDINAL
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The coupled states (N, c), angle of attack and sideslip (N,) as measured, the vanes' own velocity taken out."""
    columns = {name: flight.inputs[:, j] for j, name in enumerate(input_columns_of(axes))}
    columns |= {name: flight.measured[:, i] for i, name in enumerate(axes.outputs)}
    p, q, r = (np.nan_to_num(columns[name]) for name in ("p", "q", "r"))
    speed, alpha, beta = columns["V"], columns["alpha"], columns["beta"]
    if "alpha" in axes.outputs:
        arm = flight.positions[axes.outputs.index("alpha")]
        alpha = alpha + (q * arm[0] - p * arm[1]) / speed
    if "beta" in axes.outputs:
        arm = flight.positions[axes.outputs.index("beta")]
        beta = beta - (r * arm[0] - p * arm[2]) / speed
    plane = speed * np.cos(beta)
    columns |= {"u": plane * np.cos(alpha), "v": speed * np.sin(beta), "w": plane * np.sin(alpha)}
    return np.column_stack([columns[name] for name in coupled_of(axes)]), alpha, beta


def measured_states(flight: Flight, variance: NDArray[np.float64], axes: Axes = LONGITUDINAL) -> FedStates:
    """The coupled states as measured, with the covariance R of each sample from that of the outputs fed, (c,).

    All velocity components are missing where one of the air data is that they follow from.
    """
    measured, alpha, beta = measured_motion(flight, axes)
    names, fed = coupled_of(axes), fed_of(axes)
    speed = flight.measured[:, axes.outputs.index("V")] if "V" in fed else flight.inputs[:, input_place(axes, "V")]
    speed = np.nan_to_num(speed, nan=1.0)
    plane = speed * np.nan_to_num(np.cos(beta), nan=1.0)
    cos, sin = np.nan_to_num(np.cos(alpha)), np.nan_to_num(np.sin(alpha))
    lean = np.nan_to_num(np.sin(beta)) if "V" in fed and "beta" in fed else np.zeros_like(speed)
    upright = np.sqrt(1.0 - lean * lean)
    # Along the flow, across it in the plane of symmetry, and out of that plane: what V, alpha and beta measure.
    directions = {
        "V": ({"u": cos * upright, "v": lean, "w": sin * upright}, np.ones_like(speed)),
        "alpha": ({"u": -sin, "w": cos}, plane),
        "beta": ({"u": -lean * cos, "v": upright, "w": -lean * sin}, speed),
    }
    if "V" not in fed:
        directions["beta"] = ({"v": np.ones_like(speed)}, plane)
    weights = np.zeros((speed.size, len(names), len(names)))
    covariance = np.zeros_like(weights)
    for place, name in enumerate(fed):
        if name not in directions:
            weights[:, place, place], covariance[:, place, place] = 1.0 / variance[place], variance[place]
            continue
        along, length = directions[name]
        for one, first in along.items():
            for other, second in along.items():
                if one in names and other in names:
                    at = names.index(one), names.index(other)
                    weights[:, at[0], at[1]] += first * second / (length**2 * variance[place])
                    covariance[:, at[0], at[1]] += first * second * length**2 * variance[place]
    return FedStates(measured, weights, covariance)


def input_place(axes: Axes, name: str) -> int:
    """Which of the inputs a measured motion quantity is."""
    return input_columns_of(axes).index(name)
