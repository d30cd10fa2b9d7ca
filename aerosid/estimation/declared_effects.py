"""The aircraft file's own effects, acting with fixed parameters."""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.aircraft import Aircraft
from aerosid.aircraft.effect_values import made_effect
from aerosid.effects import ActiveEffect, InputEffect, OutputEffect, PositionEffect, frozen
from aerosid.effects.kinds import UNIT
from aerosid.effects.step_input import is_step_change
from aerosid.errors import AircraftError
from aerosid.estimation.manoeuvre import Manoeuvre


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
        Where an effect lacks a parameter or has an impossible one, or acts on a channel that the flight model lacks.
    """
    found: list[ActiveEffect] = []
    outputs = manoeuvres[0].axes.outputs
    for number, effect in enumerate(aircraft.effects, start=1):
        key = f"{aircraft.path}: effects[{number}] ({effect.kind})"
        made, numbers = made_effect(effect, key, manoeuvres[0].interval)
        if isinstance(made, OutputEffect) and made.where not in outputs:
            raise AircraftError(
                f"{key} acts on {made.where}, which is no channel that the simulation answers with, expected one of "
                f"{', '.join(outputs)}; correct the channel map for it instead"
            )
        if isinstance(made, PositionEffect) and not any(map(made.moves, outputs)):
            raise AircraftError(
                f"{key} places {made.where}, which is no sensor of this model, expected one of {', '.join(outputs)}, "
                f"or {UNIT} for all accelerometers together; correct or strike it"
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
