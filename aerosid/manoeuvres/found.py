"""A stretch of flight that a detector found: kind, span and the evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

__all__ = ["CONDITIONS", "KINDS", "Rejected", "Stretch"]

KINDS: dict[str, str] = {
    "doublet": "two opposite pulses of one width",
    "211": "pulses of alternating sign, widths 2-1-1",
    "3211": "pulses of alternating sign, widths 3-2-1-1",
    "steps": "steps of a surface in no standard order",
    "sweep": "oscillation of a surface whose frequency goes one way",
    "multisine": "sum of sines, from rest to rest",
    "elevator_pulse": "elevator moved, held and released: excitation of the phugoid",
    "short_period": "elevator step and the response in pitch rate and angle of attack",
    "phugoid": "exchange of speed and height, elevator at rest",
    "dutch_roll": "rudder pulses and the oscillation in yaw and roll after them",
    "aperiodic_roll": "aileron step held through a change of bank",
    "spiral": "free response in bank, surfaces at rest",
    "stall_approach": "slow deceleration until the nose drops or is lowered, and the recovery",
    "parabola": "pull-up and push-over to low load factor",
    "trim": "speed, height rate, attitude and surfaces constant",
    "turn": "bank held away from level",
    "steady_turn": "constant bank within a turn",
}
"""What can be found, and what each is."""

CONDITIONS = ("trim", "turn", "steady_turn")
"""Kinds that are a condition and no motion."""


@dataclass(frozen=True)
class Stretch:
    """A find, in samples of its record.

    Attributes
    ----------
    kind : str
        One of KINDS.
    first, last : int
        First sample at which the input (without one, the condition) is seen; last of the answer or the condition.
    surface : str
        What was moved; empty where nothing was.
    detail : mapping of str to float or str
        The evidence, SI: what the kind is told by.
    strength : float
        Largest answer over that from which on one is clear: where two finds overlap, the stronger stays.
    """

    kind: str
    first: int
    last: int
    surface: str = ""
    detail: Mapping[str, float | str | tuple[float, ...]] = field(default_factory=dict)
    strength: float = 1.0


@dataclass(frozen=True)
class Rejected:
    """A lively stretch that is no manoeuvre.

    Attributes
    ----------
    first, last : int
        Samples of the record.
    surface : str
        What moved.
    reason : str
        Why, as a sentence's end: 'the elevator does not come back ...'.
    """

    first: int
    last: int
    surface: str
    reason: str
