"""Flights through moving air and with a separating flow: plain Runge-Kutta loops over the textbook's equations."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from oracles.flight import GRAVITY, Airframe, Terms, state_rates

Array = NDArray[np.float64]


def fly_through_air(
    start: Sequence[float],
    time: Array,
    inputs: Mapping[str, Array | float],
    terms: Terms,
    frame: Airframe,
    wind: Array,
    substeps: int = 3,
) -> Array:
    """Outputs (N, 8) of symmetric flight through air that moves down with `wind` (N,) m/s, linear between samples.

    u, w are inertial. Forces, V and the vane see the air-relative w; rotation of axes and climb the inertial one.
    """
    held = {name: np.broadcast_to(np.asarray(value, dtype=float), time.shape) for name, value in inputs.items()}

    def at(t: float) -> dict[str, float]:
        return {name: float(np.interp(t, time, values)) for name, values in held.items()}

    def rates(t: float, x: Array) -> Array:
        u, w, q, theta, h = x
        relative = w - float(np.interp(t, time, wind))
        slopes = state_rates((u, relative, q, theta, h), at(t), terms, frame)
        slopes[0] += q * relative - q * w
        slopes[4] = u * math.sin(theta) - w * math.cos(theta)
        return slopes

    states = runge_kutta(rates, np.array(start, dtype=float), time, substeps)
    rows = []
    for t, x, air in zip(time, states, wind, strict=True):
        u, w, q, theta, h = x
        slopes = rates(float(t), x)
        forces = slopes[0] + GRAVITY * math.sin(theta) + q * w, slopes[1] - GRAVITY * math.cos(theta) - q * u
        rows.append([math.hypot(u, w - air), math.atan2(w - air, u), q, theta, *forces, slopes[2], h])
    return np.array(rows)


def fly_separating(
    start: Sequence[float],
    time: Array,
    inputs: Mapping[str, Array | float],
    terms: Terms,
    frame: Airframe,
    separation: Mapping[str, float],
) -> tuple[Array, Array]:
    """Outputs (N, 8) and the separation point (N,), itself a state.

    relaxation X' + X = {1 - tanh[sharpness (alpha - delay alpha' - alpha_star)]}/2. `separation` gives these four
    numbers, and in C_X and C_m what the coefficients gain with 1 - X. Lift keeps the share ((1 + sqrt X)/2)^2 of
    C_Z_alpha alpha. The flow starts in its steady state.
    """
    held = {name: np.broadcast_to(np.asarray(value, dtype=float), time.shape) for name, value in inputs.items()}
    terms = {**terms, ("C_X", "extra_X"): 1.0, ("C_Z", "extra_Z"): 1.0, ("C_m", "extra_m"): 1.0}
    slope = terms["C_Z", "alpha"]

    def aircraft(t: float, x: Array) -> Array:
        point = min(max(x[5], 0.0), 1.0)
        lost = (0.5 * (1.0 + math.sqrt(point))) ** 2 - 1.0
        given = {name: float(np.interp(t, time, values)) for name, values in held.items()}
        given["extra_Z"] = slope * math.atan2(x[1], x[0]) * lost
        given["extra_X"] = separation["C_X"] * (1.0 - point)
        given["extra_m"] = separation["C_m"] * (1.0 - point)
        return state_rates(x[:5], given, terms, frame)

    def static(alpha: float, rate: float) -> float:
        effective = alpha - separation["delay"] * rate - separation["alpha_star"]
        return 0.5 * (1.0 - math.tanh(separation["sharpness"] * effective))

    def rates(t: float, x: Array) -> Array:
        slopes = aircraft(t, x)
        rate = (x[0] * slopes[1] - x[1] * slopes[0]) / (x[0] ** 2 + x[1] ** 2)
        moved = (static(math.atan2(x[1], x[0]), rate) - x[5]) / separation["relaxation"]
        return np.append(slopes, moved)

    steady = static(math.atan2(start[1], start[0]), 0.0)
    states = runge_kutta(rates, np.array([*start, steady]), time)
    rows = []
    for t, x in zip(time, states, strict=True):
        u, w, q, theta, h, _ = x
        slopes = aircraft(float(t), x)
        forces = slopes[0] + GRAVITY * math.sin(theta) + q * w, slopes[1] - GRAVITY * math.cos(theta) - q * u
        rows.append([math.hypot(u, w), math.atan2(w, u), q, theta, *forces, slopes[2], h])
    return np.array(rows), states[:, 5]


def runge_kutta(rates: Callable[[float, Array], Array], start: Array, time: Array, substeps: int = 3) -> Array:
    """The classical fourth-order solution at the samples, (N, states); no step crosses one."""
    states = [start]
    for first, last in itertools.pairwise(time):
        step = (last - first) / substeps
        x = states[-1]
        for n in range(substeps):
            t = first + n * step
            a = rates(t, x)
            b = rates(t + step / 2.0, x + step / 2.0 * a)
            c = rates(t + step / 2.0, x + step / 2.0 * b)
            d = rates(t + step, x + step * c)
            x = x + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        states.append(x)
    return np.array(states)
