"""Time histories as plotly's figures: data and layout as JSON, without importing plotly.

Each array is stored once, in base64 of its bytes; figures refer to arrays by number. Colours are defined by the page:
every trace and shape gives its role in `meta` or `name`, and interactive.js applies the style sheet's colour.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from aerosid.reporting.figures.chart import (
    DASHES,
    WORDS,
    Axis,
    Band,
    Chart,
    Corridor,
    FloatArray,
    Line,
    Mark,
    Panel,
    Points,
)
from aerosid.reporting.figures.numbered import Figure
from aerosid.reporting.script_data import safe_inside_element
from aerosid.reporting.thinning import envelope

DRAWN_WHOLE = 3000
"""Display: samples up to which a history is not thinned; a browser pans so many points of every strip smoothly."""

BINS = 1000
"""Display: intervals into which a longer one is thinned."""

_PIXELS_PER_POINT = 2.3
"""Display: pixels per point: enough to separate the labels of a strip and of its residual."""
_SUBSCRIPT = re.compile(r"_\{(\w+)\}")


def figures_json(figures: Sequence[Figure]) -> str:
    """The figures as JSON that is safe in a `<script type="application/json">` element.

    Parameters
    ----------
    figures : sequence of Figure
        Of one page; those without a timeline cannot be zoomed and are left out.
    """
    arrays = _Arrays()
    drawn = [
        {"id": figure.identity, "timeline": figure.chart.timeline, **_figure(figure.chart, arrays)}
        for figure in figures
        if figure.chart.timeline
    ]
    text = json.dumps({"arrays": arrays.encoded, "figures": drawn}, ensure_ascii=False, separators=(",", ":"))
    return safe_inside_element(text)


class _Arrays:
    """Arrays by number, each stored once."""

    def __init__(self) -> None:
        self.encoded: list[dict[str, str]] = []
        self._places: dict[bytes, int] = {}

    def add(self, values: FloatArray, dtype: str) -> int:
        """The number of the array: f8 for times, which may count from 1970, f4 for displayed values."""
        # A missing sample and a value beyond single precision both leave a gap.
        with np.errstate(over="ignore"):
            packed = np.ascontiguousarray(values, dtype="<" + dtype)
        raw = np.where(np.isfinite(packed), packed, np.nan).astype(packed.dtype).tobytes()
        place = self._places.setdefault(dtype.encode() + raw, len(self.encoded))
        if place == len(self.encoded):
            self.encoded.append({"dtype": dtype, "bytes": base64.b64encode(raw).decode("ascii")})
        return place


def _figure(chart: Chart, arrays: _Arrays) -> dict[str, Any]:
    traces: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    layout: dict[str, Any] = {"height": round(_PIXELS_PER_POINT * chart.height), "shapes": shapes}
    for i, panel in enumerate(chart.panels):
        y = "y" if i == 0 else f"y{i + 1}"
        edges = [round(edge / chart.height, 5) for edge in (panel.bottom, panel.bottom + panel.height)]
        layout[y.replace("y", "yaxis")] = _axis(panel.y, edges, "x", 5, quiet=panel.quiet)
        if not panel.x.bare:
            layout["xaxis"] = _axis(panel.x, [0, 1], y, 10)
        for mark in panel.marks:
            if isinstance(mark, Band):
                place = {"xref": "x domain", "yref": y, "x0": 0, "x1": 1, "y0": mark.low, "y1": mark.high}
                shapes.append({"type": "rect", "layer": "below", "line": {"width": 0}, "name": mark.role, **place})
            else:
                traces.extend({**trace, "xaxis": "x", "yaxis": y} for trace in _traces(mark, panel, arrays))
    return {"data": traces, "layout": layout}


def _axis(axis: Axis, domain: Sequence[float], anchor: str, most: int, *, quiet: bool = False) -> dict[str, Any]:
    title, small = (10, 9) if quiet else (12, 11)
    # A low strip has the tick values of the still figure: the browser's own may be a single one, or overlap.
    fixed = {"tickmode": "array", "tickvals": list(axis.ticks)} if quiet else {"nticks": most}
    return {
        "title": {"text": label_html(axis.label), "font": {"size": title}},
        "tickfont": {"size": small},
        "domain": list(domain),
        "range": list(axis.limits),
        "anchor": anchor,
        **fixed,
    }


def _traces(mark: Mark, panel: Panel, arrays: _Arrays) -> list[dict[str, Any]]:
    """The traces of a mark; none for marks that only still pictures show."""
    if isinstance(mark, Line):
        x, y = envelope(mark.x, mark.y, DRAWN_WHOLE, BINS)
        line: dict[str, Any] = {"width": 1.4 * mark.width}
        if mark.role in DASHES:
            line["dash"] = ",".join(f"{1.4 * length:g}px" for length in DASHES[mark.role])
        return [{**_trace(mark.role, panel, arrays, x, y), "mode": "lines", "line": line}]
    if isinstance(mark, Points):
        x, y = envelope(mark.x, mark.y, DRAWN_WHOLE, BINS)
        return [{**_trace(mark.role, panel, arrays, x, y), "mode": "markers", "marker": {"size": 3.5}}]
    if isinstance(mark, Corridor):
        edges = [envelope(mark.x, edge, DRAWN_WHOLE, BINS) for edge in (mark.low, mark.high)]
        hidden = {"mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
        return [
            {**_trace(mark.role, panel, arrays, x, y), **hidden, **({"fill": "tonexty"} if i else {})}
            for i, (x, y) in enumerate(edges)
        ]
    return []


def _trace(role: str, panel: Panel, arrays: _Arrays, x: FloatArray, y: FloatArray) -> dict[str, Any]:
    words = WORDS.get(role, "")
    name = f"{panel.y.label}, {words}" if words else panel.y.label
    return {
        "type": "scatter",
        "x": arrays.add(x, "f8"),
        "y": arrays.add(y, "f4"),
        "name": label_html(name),
        "meta": role,
    }


def label_html(text: str) -> str:
    """The label with the few tags that plotly interprets; everything else that it might interpret is escaped."""
    return _SUBSCRIPT.sub(r"<sub>\1</sub>", html.escape(text, quote=False))
