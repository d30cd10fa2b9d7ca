"""Planted effects of a study: `C_m:alpha^2=-1.715`, `control_lag:delta_e=0.15`, and the like."""

from __future__ import annotations

import math
from dataclasses import dataclass

from aerosid.effects import KINDS, ActiveEffect, NoiseEffect, OutputEffect
from aerosid.errors import AircraftError, UsageError
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.axes import COEFFICIENTS, OUTPUTS
from aerosid.flight_model.terms import parse_term
from aerosid.nomenclature import is_surface

_HOW = (
    "write COEFFICIENT:TERM=VALUE as in C_m:alpha^2=-1.715, or KIND:CHANNEL=VALUE as in control_lag:delta_e=0.15 or "
    "sensor_bias:alpha=0.01, or step_change:COEFFICIENT=JUMP@TIME"
)


@dataclass(frozen=True)
class Planted:
    """One effect of the flown aircraft that its file does not declare.

    Attributes
    ----------
    kind, where, term : str
        As in result.json.
    value : float
        In the unit of the kind, SI.
    time : float or None
        Start of a step change, s.
    """

    kind: str
    where: str
    term: str
    value: float
    time: float | None = None

    @property
    def label(self) -> tuple[str, str, str]:
        """Kind, place and term: the criterion for its identification."""
        return self.kind, self.where, self.term

    @property
    def entry(self) -> Entry | None:
        """The term, where it is an aerodynamic term."""
        return (self.where, parse_term(self.term)) if self.kind == "aero_term" else None

    def active(self, interval: float, log: str) -> ActiveEffect:
        """The effect with its parameters, for a flight with samples every `interval` s.

        Raises
        ------
        UsageError
            Where it needs more parameters, or cannot be flown because its motion is random.
        """
        kind = KINDS[self.kind]
        numbers = {kind.leading: self.value} | ({} if self.time is None else {"time": self.time})
        if not set(kind.required) <= set(numbers):
            raise UsageError(
                f"--effect {self.kind}:{self.where}: it needs {', '.join(kind.required)}; declare it in the aircraft "
                "file's [[effects]] to fly with it."
            )
        effect = kind.made(self.where, numbers, interval)
        if isinstance(effect, NoiseEffect) or (isinstance(effect, OutputEffect) and effect.where not in OUTPUTS):
            raise UsageError(f"--effect {self.kind}:{self.where}: no such effect can be flown; {_HOW}.")
        values = tuple(numbers[parameter.name] for parameter in effect.parameters)
        return ActiveEffect(effect, values, log if "time" in numbers else "")


def parse_planted(text: str) -> Planted:
    """The effect written as in the command line.

    Raises
    ------
    UsageError
        Where the text is not an effect.
    """
    head, equals, number = text.partition("=")
    number, at, moment = number.partition("@")
    kind, colon, rest = head.strip().partition(":")
    try:
        value = float(number)
        time = float(moment) if at else None
    except ValueError:
        value, time = math.nan, None
    if not (equals and colon and math.isfinite(value)) or (time is not None and not math.isfinite(time)):
        raise UsageError(f"--effect {text!r} cannot be read; {_HOW}.")
    if kind in COEFFICIENTS:
        try:
            term = parse_term(rest)
        except AircraftError as error:
            raise UsageError(f"--effect {text!r}: {error}") from None
        return Planted("aero_term", kind, str(term), value)
    if kind not in KINDS or ("time" in KINDS[kind].required) != (time is not None):
        raise UsageError(f"--effect {text!r} cannot be read; {_HOW}. Kinds: {', '.join(KINDS)}.")
    place = rest.strip()
    if KINDS[kind].place == "coefficient" and place not in COEFFICIENTS:
        raise UsageError(f"--effect {text!r}: {place or 'nothing'} is not a coefficient; {_HOW}.")
    if KINDS[kind].place == "input" and not is_surface(place):
        raise UsageError(f"--effect {text!r}: {place or 'nothing'} is not a control surface; {_HOW}.")
    return Planted(kind, place, "", value, time)
