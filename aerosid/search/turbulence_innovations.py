"""Filter-error estimate in the identified turbulence, whose innovations are the residuals of a verdict.

An open-loop simulation does not follow a flight through turbulence whatever its model: its residual is that of the air.
The innovations of a Kalman filter that knows the size and the scale of the gusts are the noise of the sensors where the
structure is complete, and exceed it where an effect is missing (Klein & Morelli, Aircraft System Identification,
section 6.3: filter error).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from aerosid.effects import NoiseEffect, at_first_trials
from aerosid.effects.disturbance import gusts_of
from aerosid.errors import EstimationError
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import INNOVATIONS
from aerosid.flight_model.axes import Axes
from aerosid.search.attribution import Attribution
from aerosid.search.disturbance_search import with_disturbance
from aerosid.search.findings import Finding
from aerosid.search.structure_search import StructureSearch


def with_turbulence_innovations(found: Attribution, search: StructureSearch) -> Attribution:
    """The attribution with the filter-error estimate of its structure, where it reports turbulence without one.

    Parameters
    ----------
    found : Attribution
        Of a regression, which reports the size of the turbulence and simulates without it.
    search : StructureSearch
        The flights that were fitted.
    """
    effect = _identified_turbulence(found.findings, found.completed.model.axes)
    if effect is None or found.completed.is_disturbed:
        return found
    structure = search.with_step_columns(found.completed)
    start = at_first_trials(effect)
    structure = replace(structure, model=with_columns_of(structure.model, [start]))
    try:
        return replace(found, in_turbulence=with_disturbance(search, structure, effect, INNOVATIONS))
    except EstimationError:
        return found


def _identified_turbulence(findings: Sequence[Finding], axes: Axes) -> NoiseEffect | None:
    """The turbulence along the axes of the findings, its parameters started from their values; None without any."""
    values: dict[str, tuple[float, float]] = {}
    for effect in gusts_of(axes):
        for finding in findings:
            if len(effect.columns) == 1 and finding.kind == effect.kind:
                sigma, length = (value for _, value, _, _ in finding.parameters)
                values[effect.columns[0]] = sigma, length
    for effect in gusts_of(axes):
        if values and set(effect.columns) == set(values):
            sizes = [values[column][0] for column in effect.columns]
            starts = (*sizes, values[effect.columns[0]][1])
            numbers = zip(effect.parameters, starts, strict=True)
            return replace(effect, parameters=tuple(replace(p, trials=(value,)) for p, value in numbers))
    return None
