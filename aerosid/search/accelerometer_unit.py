"""Accelerometers in one unit in pitch, in place of the sensor that a search found ahead of or behind its place.

A unit x ahead of its declared place takes x q' from a_z and x q^2 from a_x. The first looks like a vane behind its
place, and C_X q_hat^2 would stand for the second. Klein & Morelli, Aircraft System Identification, section 10.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from aerosid.effects import ActiveEffect, PositionEffect
from aerosid.effects.kinds import UNIT
from aerosid.effects.sensor_position import AHEAD, READ_AS_UNIT, are_beside_each_other, sensor_place
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.fit_settings import TRIAL
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.search.backward_elimination import eliminate_insignificant
from aerosid.search.structure_search import StructureSearch


def with_unit_if_likelier(search: StructureSearch, current: Refinement) -> Refinement:
    """The estimate with the unit in place of a displaced vane or a_z, and without the terms that stood for the rest.

    The search itself does not offer the unit: entering first it took the place of late vanes (Citation, short period).
    """
    found = [active for active in current.effects if active.values and _is_ahead(active)]
    if not found or any(manoeuvre.axes != LONGITUDINAL for manoeuvre in search.manoeuvres):
        return current
    held = [active for active in current.effects if active.held and isinstance(active.effect, PositionEffect)]
    if not all(_are_declared_together(manoeuvre, held, current) for manoeuvre in search.manoeuvres):
        return current
    (single, *_) = found
    unit = ActiveEffect(sensor_place(UNIT, AHEAD), tuple(READ_AS_UNIT[single.effect.where] * x for x in single.values))
    effects = tuple(unit if active is single else active for active in current.effects)
    trial = refine_on(replace(current, effects=effects), search.manoeuvres, TRIAL)
    trial = eliminate_insignificant(search, trial)
    return trial if search.penalised_cost(trial) < search.penalised_cost(current) else current


def _is_ahead(active: ActiveEffect) -> bool:
    """Whether an effect is the position along x of the vane, or of a_z."""
    effect = active.effect
    return isinstance(effect, PositionEffect) and effect.where in READ_AS_UNIT and effect.axes == AHEAD


def _are_declared_together(manoeuvre: Manoeuvre, held: Sequence[ActiveEffect], current: Refinement) -> bool:
    """Whether a flight has both accelerometers, declared at one distance ahead, with the declared effects `held`."""
    positions = acting_flight(current.model, manoeuvre, held)[0].positions
    ahead = {name: float(positions[manoeuvre.row(name), "xyz".index(AHEAD)]) for name in manoeuvre.outputs}
    return are_beside_each_other(ahead)
