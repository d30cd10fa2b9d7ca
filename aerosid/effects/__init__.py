"""Catalogue of effects that may be missing from a declared model: one file per family, each with equation and source.

A new effect is one file with its `FAMILY`, like `control.py`, and one line in `CATALOGUE`. Hypotheses, the kinds that
an aircraft file may declare, the words of the report and the planted tests are taken from there.
"""

from aerosid.effects import (
    cg_shift,
    control,
    disturbance,
    flow_separation,
    ground_effect,
    inertia,
    sensor,
    sensor_position,
    step_change,
    thrust,
)
from aerosid.effects.family import Family, FlightData, Kind, Offer, Planted, at_null
from aerosid.effects.kinds import (
    ActiveEffect,
    BodyEffect,
    Effect,
    EffectParameter,
    InputEffect,
    NoiseEffect,
    OutputEffect,
    PositionEffect,
    StateEffect,
    at_first_trials,
    frozen,
    with_all_parameters,
    with_numbers,
)

CATALOGUE: tuple[Family, ...] = (
    sensor.FAMILY,
    sensor_position.FAMILY,
    control.FAMILY,
    step_change.FAMILY,
    cg_shift.FAMILY,
    inertia.FAMILY,
    thrust.FAMILY,
    ground_effect.FAMILY,
    disturbance.FAMILY,
    flow_separation.FAMILY,
)
"""Every family, in the order in which its effects are tested."""

KINDS: dict[str, Kind] = {kind.name: kind for family in CATALOGUE for kind in family.kinds}
"""Every kind by its name in result.json."""

__all__ = [
    "CATALOGUE",
    "KINDS",
    "ActiveEffect",
    "BodyEffect",
    "Effect",
    "EffectParameter",
    "Family",
    "FlightData",
    "InputEffect",
    "Kind",
    "NoiseEffect",
    "Offer",
    "OutputEffect",
    "Planted",
    "PositionEffect",
    "StateEffect",
    "at_first_trials",
    "at_null",
    "frozen",
    "with_all_parameters",
    "with_numbers",
]
