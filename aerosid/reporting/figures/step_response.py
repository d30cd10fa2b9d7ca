"""The response of the linear models to a step of a control."""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.loop.flying_qualities.linear_analysis import LinearRow
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.figures.chart import Chart, Corridor, Line, Mark, Role
from aerosid.reporting.figures.layout import Tile, limits_around, tiled
from aerosid.reporting.words import shown_unit, subscripted

_HEIGHT = 70.0
"""Display: pt, of a panel."""

_ROLES: dict[str, Role] = {"declared": "declared", "completed": "after"}


def step_response_chart(rows: Sequence[LinearRow], control: str) -> Chart:
    """Deviations from trim after a step of one control, with a corridor of two deviations around the completed model.

    Parameters
    ----------
    rows : sequence of LinearRow
        At least one, all with a step of this control.
    control : str
        Channel of the surface.
    """
    steps = [(row.model, step) for row in rows for step in row.steps if step.control == control]
    time = steps[0][1].time
    tiles = []
    span = (float(time[0]), float(time[-1]))
    for channel in steps[0][1].response:
        unit = shown_unit(CHANNELS[channel].unit)
        marks: list[Mark] = []
        for model, step in steps:
            response = unit.factor * step.response[channel]
            if model == "completed" and channel in step.deviation:
                reach = 2.0 * unit.factor * step.deviation[channel]
                marks.append(Corridor(time, response - reach, response + reach, "noise"))
            marks.append(Line(time, response, _ROLES[model]))
        limits = limits_around(*(unit.factor * step.response[channel] for _, step in steps))
        label = f"{subscripted(channel)} [{unit.text}]"
        tiles.append(Tile("time [s]", label, span, limits, tuple(marks)))
    return tiled(tiles, columns=4 if len(tiles) > 2 else 2, tile_height=_HEIGHT)
