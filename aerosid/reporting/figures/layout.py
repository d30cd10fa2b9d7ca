"""Layout of a chart's panels, and round tick values on their axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.notation import decimals, plain
from aerosid.reporting.figures.chart import Axis, Chart, FloatArray, Limits, Mark, Panel

WIDTH = 540.0
"""Display: width of every chart, pt: printed at about this size on A4."""

_LEFT, _RIGHT, _TOP, _BOTTOM = 60.0, 8.0, 6.0, 30.0
"""Display: pt, margins of a panel."""

MOST_PLACES = 5
"""Display: decimals of tick values; smaller steps are written with a power of ten."""

ACROSS = 14
"""Display: characters, including subscript braces, of a line of a label beside a low panel; longer ones are
set upright."""
_GAP_ACROSS, _GAP_UP = 60.0, 38.0
"""Display: pt between tiles."""

_GAP_SHARED = 12.0
"""Display: pt between rows of tiles of which only the lowest have the values of their common axis."""

_TILE_HEIGHT = 104.0
"""Display: pt."""

_TALL = 50.0
"""Display: pt; a lower panel has half as many tick values."""

_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Display: steps of an axis, in powers of ten."""


@dataclass(frozen=True)
class Row:
    """Specification of one strip: its height and the gap above it, pt, its label and limits in the unit shown.

    `quiet`: it belongs to the strip above and is never separated from it.
    """

    height: float
    gap: float
    label: str
    limits: Limits
    marks: tuple[Mark, ...]
    quiet: bool = False


@dataclass(frozen=True)
class Tile:
    """Specification of one panel of a grid."""

    x_label: str
    y_label: str
    x_limits: Limits
    y_limits: Limits
    marks: tuple[Mark, ...]


def stacked(rows: Sequence[Row], span: Limits, timeline: str) -> Chart:
    """Strips one above the other on one time axis.

    Parameters
    ----------
    rows : sequence of Row
        From the top.
    span : (float, float)
        First and last instant, s.
    timeline : str
        Identifies the common time axis.
    """
    height = _TOP + sum(row.height + row.gap for row in rows) - rows[0].gap + _BOTTOM
    instants = ticks(span, 8)
    panels = []
    bottom = height - _TOP + rows[0].gap
    for i, row in enumerate(rows):
        bottom -= row.gap + row.height
        time = Axis("time [s]", span, instants, bare=i < len(rows) - 1)
        levels = Axis(row.label, row.limits, _above(row.limits, 4 if row.height > _TALL else 2, row.height))
        panels.append(Panel(_LEFT, bottom, WIDTH - _LEFT - _RIGHT, row.height, time, levels, row.marks, row.quiet))
    return Chart(WIDTH, height, tuple(panels), timeline)


_FEW = 3
"""Display: channels up to which a chart may be split after the first; of more, a single one is of little use."""


def parted(chart: Chart, height: float) -> tuple[Chart, Chart] | None:
    """A chart in two: as many channels or rows of panels as fit the height, pt, and the others; None where few.

    Parameters
    ----------
    chart : Chart
        From `stacked` or `tiled`; the strips of one channel stay together, and each part has its own time axis.
    height : float
        Room for the first part, pt.
    """
    groups: list[list[Panel]] = []
    for panel in chart.panels:
        if groups and (panel.quiet or panel.bottom == groups[-1][-1].bottom):
            groups[-1].append(panel)
        else:
            groups.append([panel])
    top = chart.height
    fitting = 0
    for n, group in enumerate(groups, start=1):
        if top - group[-1].bottom + _BOTTOM <= height:
            fitting = n
    least = 1 if len(groups) <= _FEW or not chart.timeline else 2
    first = min(fitting, len(groups) - least)
    if first < least:
        return None
    return _part(chart, groups[:first]), _part(chart, groups[first:])


def _part(chart: Chart, groups: Sequence[Sequence[Panel]]) -> Chart:
    """Some panels of a chart as a chart of their own, the lowest with the tick values of a common axis."""
    panels = [panel for group in groups for panel in group]
    top = panels[0].bottom + panels[0].height
    drop = panels[-1].bottom - _BOTTOM
    moved = [
        replace(
            panel,
            bottom=panel.bottom - drop,
            x=replace(panel.x, bare=panel.x.bare and panel.bottom > panels[-1].bottom),
        )
        for panel in panels
    ]
    return Chart(chart.width, top - drop + _TOP, tuple(moved), chart.timeline)


def tiled(tiles: Sequence[Tile], columns: int = 2, tile_height: float = _TILE_HEIGHT, *, shared: bool = False) -> Chart:
    """Panels side by side, so many in a row; heights in pt.

    Parameters
    ----------
    tiles : sequence of Tile
        Row by row from the top.
    columns : int
        Of panels.
    tile_height : float
        Of a panel, pt.
    shared : bool
        Whether all have one horizontal axis: it is then marked below the lowest of each column alone.
    """
    gap = _GAP_SHARED if shared else _GAP_UP
    rows = -(-len(tiles) // columns)
    width = (WIDTH - columns * (_GAP_ACROSS + _RIGHT)) / columns
    height = _TOP + rows * (tile_height + gap) - gap + _BOTTOM
    panels = []
    for i, tile in enumerate(tiles):
        row, column = divmod(i, columns)
        left = _LEFT + column * (width + _GAP_ACROSS + _RIGHT)
        bottom = height - _TOP - tile_height - row * (tile_height + gap)
        above = shared and i + columns < len(tiles)
        x = Axis(tile.x_label, tile.x_limits, _beside(tile.x_limits, 4, width), bare=above)
        y = Axis(tile.y_label, tile.y_limits, scale(tile.y_limits, 4))
        panels.append(Panel(left, bottom, width, tile_height, x, y, tile.marks))
    return Chart(WIDTH, height, tuple(panels))


def ticks(limits: Limits, most: int) -> tuple[float, ...]:
    """Round numbers between the limits, at most so many intervals: multiples of 1, 2, 2.5 or 5 powers of 10."""
    low, high = limits
    least = (high - low) / most
    if not (least > 0.0 and math.isfinite(least)):
        return ()
    power = 10.0 ** math.floor(math.log10(least))
    step = next(s * power for s in _STEPS if s * power >= least * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return tuple(round(k * step, 12) + 0.0 for k in range(first, last + 1))


_DIGIT = 4.8
"""Display: width of a digit of a tick value, pt."""


def _beside(limits: Limits, most: int, width: float) -> tuple[float, ...]:
    """As `scale`, with fewer values where they would overlap within a width, pt."""
    for spaces in range(most, 0, -1):
        found = ticks(limits, spaces)
        texts = tick_texts(found)
        apart = width * (found[1] - found[0]) / (limits[1] - limits[0]) if len(found) > 1 else 0.0
        if len(found) > 1 and max(map(len, texts)) * _DIGIT + _DIGIT < apart:
            return found
    return scale(limits, 1)[:: max(len(scale(limits, 1)) - 1, 1)]


_LINE = 7.5
"""Display: height of a tick value, pt."""


def _above(limits: Limits, most: int, height: float) -> tuple[float, ...]:
    """As `scale`, only the first and the last value where more would overlap within a height, pt."""
    found = scale(limits, most)
    if len(found) > 2 and height * (found[1] - found[0]) / (limits[1] - limits[0]) < _LINE:
        return found[0], found[-1]
    return found


def scale(limits: Limits, most: int) -> tuple[float, ...]:
    """As `ticks`, with more intervals where fewer than two values would result: a single one gives no scale."""
    for spaces in range(most, most + 9):
        found = ticks(limits, spaces)
        if len(found) > 1:
            return found
    return ticks(limits, most)


def label_lines(label: str) -> tuple[str, ...]:
    """The label of a low strip across two lines, symbol and unit; one line where it is short or has no unit."""
    name, bracket, unit = label.partition(" [")
    return (name, bracket.strip() + unit) if unit else (label,)


def tick_texts(values: Sequence[float]) -> list[str]:
    """The tick values as text, all with the decimals that each of them needs: a step of 1 may lead from -0.5 to 0.5."""
    if len(values) < 2:
        return [plain(value) for value in values]
    nearest = 1e-6 * (values[1] - values[0])
    places = next((n for n in range(12) if all(abs(round(value, n) - value) < nearest for value in values)), 12)
    if places > MOST_PLACES:
        return [plain(value, 3) for value in values]
    return [decimals(value, places) for value in values]


def limits_around(reference: FloatArray, *others: FloatArray) -> Limits:
    """Limits that contain the reference, and of the others as much as leaves the reference readable."""
    known = reference[np.isfinite(reference)]
    if not known.size:
        known = np.zeros(1)
    low, high = float(known.min()), float(known.max())
    span = (high - low) or max(1e-6, 0.02 * abs(high))
    lowest, highest = low, high
    for values in others:
        finite = values[np.isfinite(values)]
        if finite.size:
            lowest = min(lowest, max(float(finite.min()), low - 0.6 * span))
            highest = max(highest, min(float(finite.max()), high + 0.6 * span))
    margin = 0.07 * (highest - lowest or span)
    return lowest - margin, highest + margin
