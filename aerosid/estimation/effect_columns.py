"""Input columns of a model that are filled by effects and not by channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from aerosid.effects import ActiveEffect, Effect, InputEffect, OutputEffect
from aerosid.effects.cg_shift import centre_column
from aerosid.effects.control import THRUST_COLUMN
from aerosid.effects.disturbance import GUST_COLUMN, SIDE_GUST_COLUMN, gusts_of
from aerosid.effects.kinds import BodyEffect, PositionEffect
from aerosid.effects.step_change import offset_column, offset_term
from aerosid.effects.thrust import ARM_COLUMN, arm_term
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import Axes, loads_of
from aerosid.flight_model.constants import Constants

FILLED = {
    GUST_COLUMN: "gust",
    THRUST_COLUMN: "thrust_change",
    centre_column("x"): "cg_x",
    centre_column("z"): "cg_z",
    centre_column("y"): "cg_y",
    SIDE_GUST_COLUMN: "side_gust",
}
"""Input columns that no channel fills and no term holds, with the field of `Constants` that gives their place."""


def with_moving_air(model: AerodynamicModel) -> AerodynamicModel:
    """The model with an input column for the gust along each velocity across the path that it integrates."""
    return _with_columns(model, air_columns(model.axes), ())


def air_columns(axes: Axes) -> tuple[str, ...]:
    """Input columns of the air's velocity across the flight path in a case."""
    return tuple(dict.fromkeys(column for effect in gusts_of(axes) for column in effect.columns))


def with_offsets(model: AerodynamicModel, coefficients: Sequence[str]) -> AerodynamicModel:
    """The model with an input column that adds to each coefficient directly; zero until an effect fills it."""
    return _with_columns(model, (), coefficients)


def with_columns_of(model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> AerodynamicModel:
    """The model with the input columns that some effects fill."""
    wanted = {column for active in effects for column in _columns(active.effect)}
    offsets = [name for name in loads_of(model.axes) if offset_column(name) in wanted]
    filled = [column for column in FILLED if column in wanted]
    return _with_columns(model, filled, offsets, thrust_arm=ARM_COLUMN in wanted)


def _with_columns(
    model: AerodynamicModel, filled: Sequence[str], offsets: Sequence[str], *, thrust_arm: bool = False
) -> AerodynamicModel:
    """The model with columns of `FILLED`, columns added directly to some coefficients, and that of the thrust arm."""
    if not filled and not offsets and not thrust_arm:
        return model
    further = {("C_n", arm_term()): 1.0 / model.constants.span} if thrust_arm else {}
    further |= {(name, offset_term(name)): 1.0 for name in offsets}
    columns = [*((ARM_COLUMN,) if thrust_arm else ()), *filled, *map(offset_column, offsets)]
    extended = model.with_columns(columns).extended(further)
    values = extended.values.copy()
    values[[extended.index(entry) for entry in further]] = list(further.values())
    constants = extended.constants._asdict() | {FILLED[column]: extended.extra_place(column) for column in filled}
    return replace(extended, values=values, constants=Constants(**constants))


def _columns(effect: Effect) -> tuple[str, ...]:
    if isinstance(effect, InputEffect):
        return (effect.where_acts,)
    return () if isinstance(effect, OutputEffect | PositionEffect | BodyEffect) else effect.columns
