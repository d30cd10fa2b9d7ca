"""Check cases of an exported model: inputs within their usual range, and the resulting coefficients."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from aerosid.aircraft import Aircraft
from aerosid.flight_model.terms import LIFT, Factor

_NOMINAL = {"alpha": 0.05, "V": 70.0, "rho": 1.0, "thrust": 2000.0, "mass": 2000.0, "mach": 0.3}
"""Design: SI; initial values of the check cases, zero for the other variables."""

_MOVED = {"alpha": 0.11, "V": 84.0, "rho": 0.8, "thrust": 5000.0, "mass": 1800.0, "mach": 0.42}
"""Design: SI; values of these variables when moved."""

_SMALL, _NEGATIVE = 0.07, -0.06
"""Design: SI; values of all other variables when moved, some of them also with the opposite sign."""


@dataclass(frozen=True)
class CheckCase:
    """One check case.

    Attributes
    ----------
    name : str
        The inputs that are moved.
    inputs : mapping of str to float
        Channel -> value, SI.
    references : tuple of (str, str, float)
        Name, unit and value of the constants among the model's outputs.
    outputs : mapping of str to float
        Coefficient -> value.
    """

    name: str
    inputs: Mapping[str, float]
    references: tuple[tuple[str, str, float], ...]
    outputs: Mapping[str, float]


def check_cases(
    aircraft: Aircraft, inputs: tuple[str, ...], alpha_range: tuple[float, float] | None, airspeed: float | None
) -> tuple[CheckCase, ...]:
    """A nominal case, one with each input moved alone to either side, and one with all of them moved.

    Parameters
    ----------
    aircraft : Aircraft
        The model.
    inputs : tuple of str
        Input channels of the model.
    alpha_range : (float, float) or None
        Limit beyond which alpha is held, rad.
    airspeed : float or None
        U0 of V_hat, m/s, where the aircraft file gives none.
    """
    nominal = {name: _NOMINAL.get(name, 0.0) for name in inputs}
    moved = {name: _MOVED.get(name, _SMALL) for name in inputs}
    lowered = {name: 0.9 * nominal[name] if name in _NOMINAL and name != "alpha" else _NEGATIVE for name in inputs}
    chosen = {"nominal": nominal}
    for name in inputs:
        chosen[f"{name} raised"] = {**nominal, name: moved[name]}
        chosen[f"{name} lowered"] = {**nominal, name: lowered[name]}
    chosen["skewed inputs"] = moved
    if alpha_range is not None and "alpha" in inputs:
        chosen["alpha beyond the tested range"] = {**moved, "alpha": alpha_range[1] + 0.05}
        chosen["alpha below the tested range"] = {**moved, "alpha": alpha_range[0] - 0.05}
    references = [("referenceWingArea", "m2", aircraft.wing_area), ("referenceWingChord", "m", aircraft.mean_chord)]
    if aircraft.span is not None:
        references.append(("referenceWingSpan", "m", aircraft.span))
    return tuple(
        CheckCase(name, values, tuple(references), coefficients(aircraft, values, alpha_range, airspeed))
        for name, values in chosen.items()
    )


def coefficients(
    aircraft: Aircraft,
    inputs: Mapping[str, float],
    alpha_range: tuple[float, float] | None = None,
    airspeed: float | None = None,
) -> dict[str, float]:
    """The model's coefficients, including C_X and C_Z where it is written in lift and drag.

    Parameters
    ----------
    inputs : mapping of str to float
        Channels needed by the terms and their variables, SI; alpha_dot in rad/s.
    """
    variables = {**inputs, **_derived(aircraft, inputs, airspeed)}
    if alpha_range is not None and "alpha" in variables:
        variables["alpha"] = min(max(variables["alpha"], alpha_range[0]), alpha_range[1])
    sums = dict.fromkeys(aircraft.coefficients, 0.0)
    for entry in sorted(aircraft.derivatives, key=lambda entry: entry.coefficient not in LIFT):
        known = {**variables, **{name: sums[name] for name in LIFT if name in sums}}
        sums[entry.coefficient] += entry.value * math.prod(
            _power(factor, known[factor.variable]) for factor in entry.term.factors
        )
    if "C_L" in sums:
        sine, cosine = math.sin(inputs["alpha"]), math.cos(inputs["alpha"])
        sums["C_X"] = sums["C_L"] * sine - sums["C_D"] * cosine
        sums["C_Z"] = -sums["C_L"] * cosine - sums["C_D"] * sine
    return sums


def _derived(aircraft: Aircraft, inputs: Mapping[str, float], airspeed: float | None) -> dict[str, float]:
    derived = {}
    speed = aircraft.airspeed or inputs.get("V", 0.0)
    reference = aircraft.airspeed or airspeed
    for name, rate, length in (
        ("p_hat", "p", aircraft.span),
        ("q_hat", "q", aircraft.mean_chord),
        ("r_hat", "r", aircraft.span),
        ("alpha_dot_hat", "alpha_dot", aircraft.mean_chord),
    ):
        if rate in inputs and length is not None and speed > 0.0:
            derived[name] = inputs[rate] * length / (2.0 * speed)
    if reference and "V" in inputs:
        derived["V_hat"] = inputs["V"] / reference - 1.0
    if {"V", "rho", "thrust"} <= inputs.keys():
        derived["C_T"] = inputs["thrust"] / (0.5 * inputs["rho"] * inputs["V"] ** 2 * aircraft.wing_area)
    return derived


def _power(factor: Factor, value: float) -> float:
    if factor.shape == "abs":
        value = abs(value)
    elif factor.shape == "pos":
        value = max(value - factor.offset, 0.0)
    return value**factor.power
