"""Kinds, movements, conditions and expected standard errors of manoeuvres as texts of a table."""

from __future__ import annotations

import math

from aerosid.manoeuvres import FoundManoeuvre
from aerosid.manoeuvres.information import ExpectedDeviation
from aerosid.reporting.settings import REMARKS

__all__ = ["KIND_WORDS", "air_words", "condition_words", "moved_words", "surface_words", "worth_words"]

KIND_WORDS = {
    "doublet": "doublet",
    "211": "2-1-1",
    "3211": "3-2-1-1",
    "steps": "steps",
    "sweep": "frequency sweep",
    "multisine": "multisine",
    "elevator_pulse": "elevator pulse",
    "short_period": "short period",
    "phugoid": "phugoid",
    "dutch_roll": "Dutch roll",
    "aperiodic_roll": "roll",
    "spiral": "spiral",
    "stall_approach": "approach to stall",
    "parabola": "push-over",
    "trim": "trim point",
    "turn": "turn",
    "steady_turn": "steady turn",
}

_SURFACES = {"delta_e": "elevator", "delta_a": "aileron", "delta_r": "rudder"}

_WORTH_SHOWN = 6
"""Display: manoeuvres named in one sentence."""


def surface_words(channel: str) -> str:
    """Elevator, aileron, rudder, or the channel's name."""
    return _SURFACES.get(channel, channel)


def moved_words(manoeuvre: FoundManoeuvre) -> str:
    """`elevator -1.9 to 1.0 deg` for the surfaces that moved most."""
    parts = []
    for entry in manoeuvre.moved[:2]:
        factor, unit = (180.0 / math.pi, "deg") if entry.unit == "rad" else (1.0, entry.unit)
        parts.append(
            f"{surface_words(entry.channel)} {factor * entry.least:+.1f} to {factor * entry.greatest:+.1f} {unit}"
        )
    return ", ".join(parts) or "nothing"


def condition_words(manoeuvre: FoundManoeuvre) -> str:
    """Airspeed, altitude, angle of attack and mass, as far as known."""
    condition = manoeuvre.condition
    parts = []
    if "V" in condition:
        parts.append(f"{condition['V']:.0f} m/s")
    if "h" in condition:
        parts.append(f"{condition['h']:.0f} m")
    if "mach" in condition:
        parts.append(f"M {condition['mach']:.2f}")
    if "alpha" in condition:
        parts.append(f"alpha {math.degrees(condition['alpha']):.1f} deg")
    if "mass" in condition:
        parts.append(f"{condition['mass']:.0f} kg")
    return ", ".join(parts)


def air_words(turbulence: float) -> str:
    """Calm, light, moderate or severe, with the root-mean-square load factor."""
    if not math.isfinite(turbulence):
        return "unknown"
    names = ((REMARKS.calm, "calm"), (REMARKS.light, "light"), (REMARKS.moderate, "moderate"))
    name = next((name for limit, name in names if turbulence < limit), "severe")
    return f"{name} ({turbulence:.3f} g)"


def worth_words(expected: tuple[ExpectedDeviation, ...]) -> str:
    """Each derivative with its expected standard error in per cent; insignificant ones last, with a dash."""
    ordered = sorted(expected, key=lambda entry: entry.deviation / max(abs(entry.value), 1e-30))
    parts = []
    for entry in ordered[:_WORTH_SHOWN]:
        if not entry.shown:
            parts.append(f"{entry.coefficient} {entry.term} –")
        else:
            share = 100.0 * entry.deviation / abs(entry.value)
            parts.append(f"{entry.coefficient} {entry.term} {share:.2g} %")
    return ", ".join(parts)
