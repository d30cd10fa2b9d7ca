"""A chart as SVG inside the page: colours and fonts are the style sheet's, text stays text."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
from markupsafe import Markup, escape

from aerosid.reporting.figures.chart import (
    DASHES,
    Band,
    Chart,
    Corridor,
    FloatArray,
    Line,
    Mark,
    Outline,
    Panel,
    Points,
)
from aerosid.reporting.figures.layout import ACROSS, label_lines, tick_texts
from aerosid.reporting.thinning import envelope, unbroken

FONT_SIZE = 8.0
"""Display: pt."""

_FINE = 10.0
"""Display: resolution of histories, per pt; whole numbers take two thirds of the characters of decimals."""

_SMALL_FONT = 6.5
"""Display: pt."""

_TALL = 50.0
"""Display: pt; a lower panel has smaller type, and its label across."""

_SUBSCRIPT = re.compile(r"_\{(\w+)\}((?:(?!_\{)[^<])*)")
_ANCHORS = {"left": "start", "center": "middle", "right": "end"}


def chart_svg(chart: Chart, identity: str, label: str) -> Markup:
    """The chart as an `<svg>` element.

    Parameters
    ----------
    chart : Chart
        What is drawn. Every text in it is escaped.
    identity : str
        Prefix of every id in it, different for each figure of a page.
    label : str
        Text alternative, for readers who cannot see it.
    """
    body = "".join(_panel(panel, chart.height, f"{identity}-{i}") for i, panel in enumerate(chart.panels))
    frame = Markup('<svg viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">').format(chart.width, chart.height, label)
    # Safe: numbers, and texts passed through `escape`.
    return frame + Markup(body) + Markup("</svg>")


def _panel(panel: Panel, height: float, identity: str) -> str:
    """Frame, tick values, labels and marks of one panel."""
    top = height - panel.bottom - panel.height
    # Half a point larger than the panel, so that a line along its edge is not clipped.
    clip = (
        f'<clipPath id="{identity}"><rect x="{panel.left - 0.5:g}" y="{top - 0.5:g}" width="{panel.width + 1:g}" '
        f'height="{panel.height + 1:g}"/></clipPath>'
    )
    marks = "".join(_mark(mark, panel, height) for mark in panel.marks)
    drawn = f'<g clip-path="url(#{identity})">{marks}</g>'
    return clip + (_frame(panel, height) if panel.framed else "") + drawn


def _frame(panel: Panel, height: float) -> str:
    left, right = panel.left, panel.left + panel.width
    bottom, top = height - panel.bottom, height - panel.bottom - panel.height
    across = panel.across(np.array(panel.x.ticks))
    up = height - panel.up(np.array(panel.y.ticks))
    grid = "".join(f"M{x:.1f} {top:g}V{bottom:g}" for x in across) + "".join(f"M{left:g} {y:.1f}H{right:g}" for y in up)
    parts = [f'<path class="grid" d="{grid}"/><path class="frame" d="M{left:g} {top:g}V{bottom:g}H{right:g}"/>']
    small = _SMALL_FONT if panel.height < _TALL else FONT_SIZE - 0.5
    for text, y in zip(tick_texts(panel.y.ticks), up, strict=True):
        parts.append(_words(left - 4.0, float(y) + 0.35 * small, text, "muted", "right", small))
    parts.extend(_label(panel, top, bottom))
    if not panel.x.bare:
        for text, x in zip(tick_texts(panel.x.ticks), across, strict=True):
            parts.append(_words(float(x), bottom + 11.0, text, "muted", "center", FONT_SIZE - 0.5))
        parts.append(_words(0.5 * (left + right), bottom + 24.0, panel.x.label, "ink", "center", FONT_SIZE))
    return "".join(parts)


def _label(panel: Panel, top: float, bottom: float) -> Iterator[str]:
    """The vertical axis's label: upright beside a tall panel, across in two lines beside a low one."""
    size, role = (_SMALL_FONT, "muted") if panel.quiet else (FONT_SIZE, "ink")
    middle = 0.5 * (top + bottom)
    lines = label_lines(panel.y.label)
    if panel.height >= _TALL or max(map(len, lines)) > ACROSS:
        yield _words(panel.left - 44.0, middle, panel.y.label, role, "center", size, upright=True)
        return
    for n, line in enumerate(lines):
        base = middle + 0.35 * size + (n - 0.5 * (len(lines) - 1)) * 1.35 * size
        yield _words(panel.left - 58.0, base, line, role, "left", size if n == 0 else _SMALL_FONT)


def _mark(mark: Mark, panel: Panel, height: float) -> str:
    if isinstance(mark, Line):
        x, y = envelope(mark.x, mark.y)
        dashes = " ".join(f"{_FINE * dash:g}" for dash in DASHES.get(mark.role, ()))
        dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
        data = _path(panel.across(x), height - panel.up(y))
        width = f' stroke-width="{_FINE * mark.width:g}"'
        return f'<path class="line {mark.role}" transform="scale({1 / _FINE:g})"{width}{dashed} d="{data}"/>'
    if isinstance(mark, Points):
        return _dots(mark, panel, height)
    if isinstance(mark, Band):
        bottom, top = (height - float(edge) for edge in panel.up(np.array([mark.low, mark.high])))
        box = f'x="{panel.left:g}" y="{top:.2f}" width="{panel.width:g}" height="{bottom - top:.2f}"'
        return f'<rect class="area {mark.role}" {box}/>'
    if isinstance(mark, Corridor):
        present = np.isfinite(mark.low) & np.isfinite(mark.high)
        x, high = envelope(mark.x[present], mark.high[present])
        back, low = envelope(mark.x[present], mark.low[present])
        across, levels = np.concatenate([x, back[::-1]]), np.concatenate([high, low[::-1]])
        return _area(panel.across(across), height - panel.up(levels), mark.role)
    if isinstance(mark, Outline):
        return _area(panel.across(mark.x), height - panel.up(mark.y), mark.role)
    place_x, place_y = float(panel.across(np.array(mark.x))), height - float(panel.up(np.array(mark.y)))
    return _words(place_x, place_y, mark.text, mark.role, mark.align, mark.size)


def _area(x: FloatArray, y: FloatArray, role: str) -> str:
    return f'<path class="area {role}" transform="scale({1 / _FINE:g})" d="{_path(x, y)}z"/>'


def _dots(mark: Points, panel: Panel, height: float) -> str:
    """Strokes of zero length with round ends, far smaller in the file than circles. For a record too long for that,
    one stroke from the smallest to the largest sample of each span.
    """
    x, y = envelope(mark.x, mark.y) if mark.ordered else (mark.x, mark.y)
    whole = x.size == mark.x.size
    present = np.isfinite(x) & np.isfinite(y)
    places = _whole(np.column_stack([panel.across(x[present]), height - panel.up(y[present])]))
    if whole:
        moves = np.diff(places, axis=0, prepend=np.zeros((1, 2), dtype=np.int64))
        data = "".join(f"m{across} {down}h0" for across, down in moves.tolist())
    else:
        data = "".join(f"M{x0} {y0}L{x1} {y1}" for x0, y0, x1, y1 in places[: places.shape[0] // 2 * 2].reshape(-1, 4))
    return f'<path class="dots {mark.role}" transform="scale({1 / _FINE:g})" d="{data}"/>'


def _path(x: FloatArray, y: FloatArray) -> str:
    """The lines through the samples, relative and in tenths of a point; NaN interrupts them."""
    parts = []
    for stretch in unbroken(x, y):
        places = _whole(stretch)
        moves = np.diff(places, axis=0)
        moves = moves[(moves != 0).any(axis=1)]
        parts.append(f"M{places[0, 0]} {places[0, 1]}l" + " ".join(map(str, moves.ravel().tolist() or [0, 0])))
    return "".join(parts).replace(" -", "-")


def _whole(places: FloatArray) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """Positions in whole tenths of a point; far outside the chart they are limited to the range of browsers."""
    return np.rint(np.clip(_FINE * places, -1e5, 1e5)).astype(np.int64)


def _words(x: float, y: float, text: str, role: str, align: str, size: float, *, upright: bool = False) -> str:
    """A text with its baseline at x, y, its `_{x}` as subscripts."""
    turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if upright else ""
    body = _SUBSCRIPT.sub(r'<tspan class="sub" dy="2">\1</tspan><tspan dy="-2">\2</tspan>', str(escape(text)))
    anchor = _ANCHORS[align]
    place = f'x="{x:.1f}" y="{y:.1f}"'
    return f'<text class="{role}" {place} font-size="{size:g}" text-anchor="{anchor}"{turned}>{body}</text>'
