"""The aircraft file's own effects, acting with fixed parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from aerosid.aircraft import Aircraft, DeclaredEffect
from aerosid.effects import KINDS, ActiveEffect, InputEffect, OutputEffect, frozen
from aerosid.effects.kinds import EffectParameter
from aerosid.effects.step_input import is_step_change
from aerosid.errors import AircraftError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.notation import si_unit


def declared_effects(
    aircraft: Aircraft, controls: Sequence[str], manoeuvres: Sequence[Manoeuvre]
) -> tuple[ActiveEffect, ...]:
    """The declared effects with their parameters held.

    A step change acts on the log that the file names, or on every identification log where it names none.

    Parameters
    ----------
    aircraft : Aircraft
        The file as read.
    controls : sequence of str
        The input channels that the declared terms use.
    manoeuvres : sequence of Manoeuvre
        The identification flights.

    Raises
    ------
    AircraftError
        Where an effect lacks a parameter, or acts on a channel that the flight model does not have.
    """
    found: list[ActiveEffect] = []
    outputs = manoeuvres[0].axes.outputs
    for number, effect in enumerate(aircraft.effects, start=1):
        key = f"{aircraft.path}: effects[{number}] ({effect.kind})"
        numbers = _numbers(effect, key)
        interval = manoeuvres[0].interval
        made = KINDS[effect.kind].made(effect.where, numbers, interval)
        _require(tuple(parameter.name for parameter in made.parameters), numbers, key)
        _require_possible(made.parameters, numbers, key)
        if isinstance(made, OutputEffect) and made.where not in outputs:
            raise AircraftError(
                f"{key} acts on {made.where}, which is no channel that the simulation answers with, expected one of "
                f"{', '.join(outputs)}; correct the channel map for it instead"
            )
        if isinstance(made, InputEffect) and not made.column and made.where not in controls:
            raise AircraftError(
                f"{key} acts on {made.where}, which no declared term uses, expected one of "
                f"{', '.join(controls) or 'none'}; add a term in {made.where} or strike the effect"
            )
        active = ActiveEffect(made, tuple(numbers[parameter.name] for parameter in made.parameters))
        if is_step_change(active):
            logs = [effect.log] if effect.log else [manoeuvre.name for manoeuvre in manoeuvres]
            found.extend(frozen(ActiveEffect(made, active.values, log)) for log in logs)
        else:
            found.append(frozen(active))
    return tuple(found)


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
            raise AircraftError(
                f"{key} has {parameter.name} = {value:g} {si_unit(parameter.unit)}, expected from {parameter.lowest:g} "
                f"to {parameter.highest:g}; correct the value or its unit"
            )


def _require(names: Sequence[str], numbers: Mapping[str, float], key: str) -> None:
    missing = [name for name in names if name not in numbers]
    if missing:
        how = "time = ..." if missing == ["time"] else f"{missing[0]} = {{ value = ... }} to its parameters"
        raise AircraftError(f"{key} lacks {', '.join(missing)}, expected {', '.join(names)}; add {how}")
