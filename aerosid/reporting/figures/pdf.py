"""A chart on paper: drawn onto a reportlab canvas in the style sheet's light colours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

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
from aerosid.reporting.figures.pdf_path import PathOfLines
from aerosid.reporting.thinning import envelope, unbroken

if TYPE_CHECKING:
    from reportlab.lib.colors import Color
    from reportlab.pdfgen.canvas import Canvas

_SMALL_FONT, _FONT = 6.5, 8.0
"""Display: pt."""

_TALL = 50.0
"""Display: pt; a lower panel has its label across."""

_PART = re.compile(r"_\{(\w+)\}|([^_]+|_)")


class Paper:
    """Draws charts onto one canvas, its origin at the chart's lower left corner.

    Parameters
    ----------
    canvas : reportlab.pdfgen.canvas.Canvas
    colours : mapping of str to Color
        By role.
    typeface : str
        A registered font.
    """

    def __init__(self, canvas: Canvas, colours: Mapping[str, Color], typeface: str) -> None:
        self.canvas, self.colours, self.typeface = canvas, colours, typeface

    def draw(self, chart: Chart) -> None:
        """The chart at its own size."""
        for panel in chart.panels:
            if panel.framed:
                self._frame(panel)
            self.canvas.saveState()
            clip = self.canvas.beginPath()
            clip.rect(panel.left - 0.5, panel.bottom - 0.5, panel.width + 1.0, panel.height + 1.0)
            self.canvas.clipPath(clip, stroke=0, fill=0)
            for mark in panel.marks:
                self._mark(mark, panel)
            self.canvas.restoreState()

    def key(self, role: str, x: float, y: float, length: float) -> None:
        """A sample of the role's line or area for a legend."""
        ends = np.array([[x, y], [x + length, y]])
        if role in ("noise", "tolerance"):
            below = np.array([0.0, 2.5])
            self._fill([ends - below, ends[::-1] + below], role)
            if role == "tolerance":
                self._stroke([ends - below, ends + below], "tolerance-edge", 0.5)
        elif role == "measured":
            self._dots(np.linspace(ends[0], ends[1], 5), role)
        else:
            self._stroke([ends], role, 1.2)

    def words(self, x: float, y: float, text: str, role: str, align: str, size: float) -> None:
        """A text with its baseline at x, y; `_{x}` in it is set as a subscript."""
        parts = [(sub or plain, bool(sub)) for sub, plain in _PART.findall(text)]
        widths = [self.canvas.stringWidth(part, self.typeface, size * (0.75 if low else 1.0)) for part, low in parts]
        x -= {"left": 0.0, "center": 0.5, "right": 1.0}[align] * sum(widths)
        self.canvas.setFillColor(self.colours[role])
        for (part, low), width in zip(parts, widths, strict=True):
            self.canvas.setFont(self.typeface, size * (0.75 if low else 1.0))
            self.canvas.drawString(x, y - (2.0 if low else 0.0), part)
            x += width

    def _frame(self, panel: Panel) -> None:
        left, right, bottom, top = panel.left, panel.left + panel.width, panel.bottom, panel.bottom + panel.height
        across, up = panel.across(np.array(panel.x.ticks)), panel.up(np.array(panel.y.ticks))
        upright = [np.array([[x, bottom], [x, top]]) for x in across]
        self._stroke([*upright, *(np.array([[left, y], [right, y]]) for y in up)], "grid", 0.5)
        self._stroke([np.array([[left, top], [left, bottom], [right, bottom]])], "muted", 0.6)
        small = _SMALL_FONT if panel.height < _TALL else _FONT - 0.5
        for text, y in zip(tick_texts(panel.y.ticks), up, strict=True):
            self.words(left - 4.0, float(y) - 0.35 * small, text, "muted", "right", small)
        self._label(panel)
        if not panel.x.bare:
            for text, x in zip(tick_texts(panel.x.ticks), across, strict=True):
                self.words(float(x), bottom - 11.0, text, "muted", "center", _FONT - 0.5)
            self.words(0.5 * (left + right), bottom - 24.0, panel.x.label, "ink", "center", _FONT)

    def _label(self, panel: Panel) -> None:
        """The vertical axis's label: upright beside a tall panel, across in two lines beside a low one."""
        size, role = (_SMALL_FONT, "muted") if panel.quiet else (_FONT, "ink")
        middle = panel.bottom + 0.5 * panel.height
        lines = label_lines(panel.y.label)
        if panel.height >= _TALL or max(map(len, lines)) > ACROSS:
            self.canvas.saveState()
            self.canvas.translate(panel.left - 44.0, middle)
            self.canvas.rotate(90)
            self.words(0.0, 0.0, panel.y.label, role, "center", size)
            self.canvas.restoreState()
            return
        for n, line in enumerate(lines):
            base = middle - 0.35 * size - (n - 0.5 * (len(lines) - 1)) * 1.35 * size
            self.words(panel.left - 58.0, base, line, role, "left", size if n == 0 else _SMALL_FONT)

    def _mark(self, mark: Mark, panel: Panel) -> None:
        if isinstance(mark, Line):
            x, y = envelope(mark.x, mark.y)
            self._stroke(list(unbroken(panel.across(x), panel.up(y))), mark.role, mark.width)
        elif isinstance(mark, Points):
            x, y = envelope(mark.x, mark.y) if mark.ordered else (mark.x, mark.y)
            present = np.isfinite(x) & np.isfinite(y)
            places = np.column_stack([panel.across(x[present]), panel.up(y[present])])
            if x.size == mark.x.size:
                self._dots(places, mark.role)
            else:  # one stroke from the smallest to the largest sample of each span
                self._stroke(list(places[: places.shape[0] // 2 * 2].reshape(-1, 2, 2)), mark.role, 1.6)
        elif isinstance(mark, Band):
            bottom, top = panel.up(np.array([mark.low, mark.high]))
            left, right = panel.left, panel.left + panel.width
            self._fill([np.array([[left, bottom], [right, bottom], [right, top], [left, top]])], mark.role)
        elif isinstance(mark, Corridor):
            present = np.isfinite(mark.low) & np.isfinite(mark.high)
            edges = [envelope(mark.x[present], edge[present]) for edge in (mark.low, mark.high)]
            low, high = (np.column_stack([panel.across(x), panel.up(y)]) for x, y in edges)
            self._fill([low, high[::-1]], mark.role)
        elif isinstance(mark, Outline):
            self._fill([np.column_stack([panel.across(mark.x), panel.up(mark.y)])], mark.role)
        else:
            place = panel.across(np.array(mark.x)), panel.up(np.array(mark.y))
            self.words(float(place[0]), float(place[1]), mark.text, mark.role, mark.align, mark.size)

    def _stroke(self, lines: list[FloatArray], role: str, width: float) -> None:
        self.canvas.setStrokeColor(self.colours[role])
        self.canvas.setLineWidth(width)
        self.canvas.setLineCap(0)
        self.canvas.setLineJoin(1)
        self.canvas.setDash(list(DASHES.get(role, ())))
        path = PathOfLines()
        for line in lines:
            path.line(line)
        self.canvas.drawPath(path, stroke=1, fill=0)

    def _fill(self, sides: list[FloatArray], role: str) -> None:
        places = np.concatenate(sides)
        if not places.size:
            return
        path = PathOfLines()
        path.line(places)
        path.close()
        self.canvas.setFillColor(self.colours[role])
        self.canvas.drawPath(path, stroke=0, fill=1)

    def _dots(self, places: FloatArray, role: str) -> None:
        """Strokes of no length with round ends."""
        self.canvas.setStrokeColor(self.colours[role])
        self.canvas.setLineWidth(1.6)
        self.canvas.setLineCap(1)
        self.canvas.setDash([])
        path = PathOfLines()
        path.dots(places)
        self.canvas.drawPath(path, stroke=1, fill=0)
