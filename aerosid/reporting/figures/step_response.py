"""The response of the linear models to a step of the elevator."""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.loop.linear_analysis import LinearRow
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.figures.chart import Chart, Corridor, Line, Mark, Role
from aerosid.reporting.figures.layout import Tile, limits_around, tiled
from aerosid.reporting.words import shown_unit, subscripted

_HEIGHT = 70.0  # pt
_ROLES: dict[str, Role] = {"declared": "declared", "completed": "after"}


def step_response_chart(rows: Sequence[LinearRow]) -> Chart:
    """V, alpha, q and theta, deviations from trim, with a corridor of two deviations around the completed model.

    Parameters
    ----------
    rows : sequence of LinearRow
        At least one.
    """
    tiles = []
    span = (float(rows[0].step_time[0]), float(rows[0].step_time[-1]))
    for channel in rows[0].step:
        unit = shown_unit(CHANNELS[channel].unit)
        marks: list[Mark] = []
        for row in rows:
            response = unit.factor * row.step[channel]
            if row.model == "completed" and channel in row.step_deviation:
                reach = 2.0 * unit.factor * row.step_deviation[channel]
                marks.append(Corridor(row.step_time, response - reach, response + reach, "noise"))
            marks.append(Line(row.step_time, response, _ROLES[row.model]))
        limits = limits_around(*(unit.factor * row.step[channel] for row in rows))
        label = f"{subscripted(channel)} [{unit.text}]"
        tiles.append(Tile("time [s]", label, span, limits, tuple(marks)))
    return tiled(tiles, columns=2, tile_height=_HEIGHT)
