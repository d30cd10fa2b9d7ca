"""Values of the effects that an aircraft file declares: those that a kind needs, within what any aircraft shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from aerosid.aircraft.model import DeclaredEffect
from aerosid.effects import KINDS
from aerosid.effects.kinds import Effect, EffectParameter
from aerosid.errors import AircraftError
from aerosid.notation import si_unit


def made_effect(effect: DeclaredEffect, key: str, interval: float) -> tuple[Effect, dict[str, float]]:
    """A declared effect as one of its kind, and its parameters by name, SI.

    Parameters
    ----------
    key : str
        File and key, for messages.
    interval : float
        Sampling interval, s, of the log that it acts on.

    Raises
    ------
    AircraftError
        Where a parameter is missing, or no aircraft shows its value.
    """
    numbers = _numbers(effect, key)
    made = KINDS[effect.kind].made(effect.where, numbers, interval)
    _require(tuple(parameter.name for parameter in made.parameters), numbers, key)
    _require_possible(made.parameters, numbers, key)
    return made, numbers


def _numbers(effect: DeclaredEffect, key: str) -> dict[str, float]:
    """The effect's parameters by name; result.json and aircraft files call the first one `value`."""
    kind = KINDS[effect.kind]
    numbers = dict(effect.parameters)
    if effect.value is not None:
        numbers.setdefault(kind.leading, effect.value)
    if effect.time is not None:
        numbers["time"] = effect.time
    _require(kind.required, numbers, key)
    return numbers


FARTHEST = 10.0
"""Physical: times the end of the range, 1, in which an effect's parameter is sought; beyond it no aircraft flies."""


def _require_possible(parameters: Sequence[EffectParameter], numbers: Mapping[str, float], key: str) -> None:
    for parameter in parameters:
        value = numbers[parameter.name]
        if not FARTHEST * min(parameter.lowest, 0.0) <= value <= FARTHEST * max(parameter.highest, 0.0):
            shown = f"{value:g} {si_unit(parameter.unit)}".rstrip()
            raise AircraftError(
                f"{key} has {parameter.name} = {shown}, expected from {parameter.lowest:g} "
                f"to {parameter.highest:g}; correct the value or its unit"
            )


def _require(names: Sequence[str], numbers: Mapping[str, float], key: str) -> None:
    missing = [name for name in names if name not in numbers]
    if missing:
        how = "time = ..." if missing == ["time"] else f"{missing[0]} = {{ value = ... }} to its parameters"
        raise AircraftError(f"{key} lacks {', '.join(missing)}, expected {', '.join(names)}; add {how}")
