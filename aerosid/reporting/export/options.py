"""Options of an export in addition to the aircraft file, and its result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from aerosid.aircraft import Aircraft, DeclaredEffect
from aerosid.errors import UsageError

NOT_SHOWN = "declared value, not significant in the flights"
"""Remark on a derivative of a completed file on which the flights contain too little information."""


def origin(aircraft: Aircraft) -> str:
    """Origin of a completed file's values, in one line; empty for any other file."""
    made = aircraft.completion
    if made is None:
        return ""
    logs = "; ".join(
        f"{log.name} {log.start:g} to {log.stop:g} s ({log.role.replace('_', '-')}, SHA-256 {log.sha256})"
        for log in made.logs
    )
    kept = f"; {NOT_SHOWN}: {', '.join(made.not_shown)}" if made.not_shown else ""
    return f"completed by {made.program} on {made.date}, verdict {made.verdict.replace('_', ' ')}, from {logs}{kept}"


@dataclass(frozen=True)
class ExportOptions:
    """Data that an aircraft file does not contain.

    Attributes
    ----------
    into : Path or None
        JSBSim aircraft whose aerodynamics the model replaces in its axes; None: the `<aerodynamics>` section alone.
    aero_reference : (float, float) or None
        JSBSim's AERORP from the centre of gravity of the model, x forward and z down, m; None: at it.
    alpha_range : (float, float) or None
        Tested angles of attack, rad; beyond them the terms keep their values at the ends.
    airspeed : float or None
        U0 of V_hat, m/s, where the aircraft file gives none.
    folded_thrust : float or None
        Thrust over dynamic pressure and wing area included in the coefficients, for an aircraft with engines.
    properties : mapping of str to (str, float)
        Channel -> JSBSim property and the factor from its unit to SI.
    date : str
        Date of creation that a format with such a field states, YYYY-MM-DD.
    """

    into: Path | None = None
    aero_reference: tuple[float, float] | None = None
    alpha_range: tuple[float, float] | None = None
    airspeed: float | None = None
    folded_thrust: float | None = None
    properties: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    date: str = "1970-01-01"

    def only(self, format_name: str, *allowed: str) -> None:
        """Refuse options that do not apply to the format.

        Raises
        ------
        UsageError
            Naming the option.
        """
        words = {
            "into": "--into",
            "aero_reference": "--aerorp",
            "alpha_range": "--alpha-range",
            "airspeed": "--airspeed",
            "folded_thrust": "--folded-thrust",
            "properties": "--property",
        }
        for name, word in words.items():
            if name not in allowed and getattr(self, name) not in (None, {}):
                raise UsageError(f"{word} does not belong to --format {format_name}; leave it out.")


@dataclass(frozen=True)
class Exported:
    """The text of an export, and a sentence on each item that it does not contain."""

    text: str
    notes: tuple[str, ...] = ()


def left_out(aircraft: Aircraft) -> tuple[str, ...]:
    """A sentence on each declared effect that is a property of a recording and not of the aircraft."""
    return tuple(
        f"{aircraft.path}: the effect {named(effect)} belongs to a recording and is left out."
        for effect in aircraft.effects
        if of_the_recording(effect)
    )


def of_the_recording(effect: DeclaredEffect) -> bool:
    """Whether an effect is one of the sensors, of the air, or of an instant of one flight."""
    return effect.kind.startswith("sensor_") or effect.kind in ("step_change", "gust")


def named(effect: DeclaredEffect) -> str:
    """`control_lag of delta_e`."""
    return f"{effect.kind} of {effect.where}" if effect.where else effect.kind
