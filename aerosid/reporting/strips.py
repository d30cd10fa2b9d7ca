"""Strips that share a time axis, drawn straight into a figure: a frame of few numbers, points, lines and bands.

Matplotlib's own axes are built for everything and cost more than all else in the report together; a strip needs a
scale, a grid and labels, and nothing that a reader could change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from aerosid.reporting.inline_svg import COLOURS, FONT_SIZE
from aerosid.reporting.thinning import envelope

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.path import Path

FloatArray = NDArray[np.float64]
Limits = tuple[float, float]
Align = Literal["right", "center"]

WIDTH = 540.0
"""Width of every figure, pt."""

_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 8.0, 6.0, 30.0
_LABEL_AT = 10.0
_SMALL_FONT = 6.5
_TALL = 50.0
_DASHES: dict[str, tuple[float, tuple[float, ...]]] = {
    "declared": (0.0, (1.2, 1.6)),
    "before": (0.0, (5.0, 2.0)),
    "trimmed": (0.0, (7.0, 1.5, 1.5, 1.5)),
}


@dataclass(frozen=True)
class Row:
    """One strip as it is asked for: its height and the gap above it, pt, its label, its limits in the unit shown."""

    height: float
    gap: float
    label: str
    limits: Limits
    quiet: bool = False


@dataclass(frozen=True)
class Strip:
    """One strip in its figure: bottom and height, pt, and what its edges stand for."""

    figure: Figure
    bottom: float
    height: float
    span: Limits
    limits: Limits

    def across(self, time: FloatArray) -> FloatArray:
        """Where instants [s] stand, pt from the figure's left edge."""
        low, high = self.span
        return np.asarray(_LEFT + (WIDTH - _LEFT - _RIGHT) * (time - low) / (high - low))

    def up(self, values: FloatArray) -> FloatArray:
        """Where values stand, pt from the figure's bottom edge."""
        low, high = self.limits
        return np.asarray(self.bottom + self.height * (values - low) / (high - low))

    def line(self, time: FloatArray, values: FloatArray, role: str, width: float = 1.1) -> None:
        """A line in the colour and dashes of its role; a missing sample interrupts it."""
        from matplotlib.lines import Line2D

        instants, levels = envelope(time, values)
        line = Line2D(self.across(instants), self.up(levels), color=COLOURS[role], linewidth=width, gid=role)
        line.set_linestyle(_DASHES.get(role, "solid"))
        self._add(line)

    def points(self, time: FloatArray, values: FloatArray) -> None:
        """One dot a sample: strokes without length and with round ends, far lighter than so many markers. Of a record
        too long for that, one stroke from the smallest to the largest sample of each span.
        """
        from matplotlib.path import Path

        instants, levels = envelope(time, values)
        known = np.isfinite(levels)
        corners = np.column_stack([self.across(instants[known]), self.up(levels[known])])
        if instants.size == time.size:
            corners = np.repeat(corners, 2, axis=0)
        dots = Path(corners, np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=np.uint8), len(corners) // 2))
        dots.should_simplify = False
        self._stroke(dots, "measured", 2.2, round_ends=True)

    def band(self, low: float, high: float) -> None:
        """A band of the noise's colour across the strip."""
        from matplotlib.patches import Rectangle

        bottom, top = self.up(np.array([low, high]))
        place = (_LEFT, float(bottom))
        self._add(Rectangle(place, WIDTH - _LEFT - _RIGHT, float(top - bottom), fc=COLOURS["noise"], lw=0, gid="noise"))

    def grid(self, instants: FloatArray, levels: FloatArray) -> None:
        """Faint lines at the instants and levels, and the frame's left and lower edge."""
        left, right, top = _LEFT, WIDTH - _RIGHT, self.bottom + self.height
        upright = [((x, self.bottom), (x, top)) for x in self.across(instants)]
        level = [((left, y), (right, y)) for y in self.up(levels)]
        self._stroke(_segments([*upright, *level]), "grid", 0.5)
        self._stroke(
            _segments([((left, top), (left, self.bottom)), ((left, self.bottom), (right, self.bottom))]), "muted", 0.6
        )

    def _stroke(self, path: Path, role: str, width: float, *, round_ends: bool = False) -> None:
        from matplotlib.patches import PathPatch

        ends = "round" if round_ends else "butt"
        gid = role if role == "measured" else None
        self._add(PathPatch(path, fill=False, edgecolor=COLOURS[role], linewidth=width, capstyle=ends, gid=gid))

    def _add(self, artist: Artist) -> None:
        """Place an artist given in points; what lies outside the strip is cut off."""
        from matplotlib.transforms import Bbox, IdentityTransform

        artist.set_transform(IdentityTransform())
        # Half a point more than the strip, so that a line along its edge keeps its width.
        artist.set_clip_box(
            Bbox.from_extents(_LEFT - 0.5, self.bottom - 0.5, WIDTH - _RIGHT + 0.5, self.bottom + self.height + 0.5)
        )
        self.figure.add_artist(artist, clip=False)


def stacked(rows: Sequence[Row], span: Limits) -> tuple[Figure, list[Strip]]:
    """A figure with the strips below one another on one time axis, framed and labelled.

    Parameters
    ----------
    rows : sequence of Row
        From the top.
    span : (float, float)
        First and last instant, s.
    """
    from matplotlib.figure import Figure

    height = _TOP + sum(row.height + row.gap for row in rows) - rows[0].gap + _BOTTOM
    figure = Figure((WIDTH / 72.0, height / 72.0), dpi=72)
    instants = _ticks(span, 8)
    strips = []
    bottom = height - _TOP + rows[0].gap
    for row in rows:
        bottom -= row.gap + row.height
        strip = Strip(figure, bottom, row.height, span, row.limits)
        levels = _ticks(row.limits, 4 if row.height > _TALL else 2)
        strip.grid(instants, levels)
        small = _SMALL_FONT if row.height < _TALL else FONT_SIZE - 0.5
        for level, y in zip(levels, strip.up(levels), strict=True):
            _write(figure, _LEFT - 4.0, float(y) - 0.35 * small, _plain(level), small, "muted", "right")
        middle = bottom + 0.5 * row.height
        size, colour = (_SMALL_FONT, "muted") if row.quiet else (FONT_SIZE, "ink")
        _write(figure, _LABEL_AT, middle, row.label, size, colour, "center", rotation=90.0)
        strips.append(strip)
    for instant, x in zip(instants, strips[-1].across(instants), strict=True):
        _write(figure, float(x), bottom - 11.0, _plain(instant), FONT_SIZE - 0.5, "muted", "center")
    _write(figure, 0.5 * (_LEFT + WIDTH - _RIGHT), 6.0, "time [s]", FONT_SIZE, "ink", "center")
    return figure, strips


def _write(
    figure: Figure, x: float, y: float, words: str, size: float, role: str, align: Align, rotation: float = 0.0
) -> None:
    """A text with its baseline at x, y [pt]."""
    from matplotlib.text import Text
    from matplotlib.transforms import IdentityTransform

    text = Text(
        x,
        y,
        words,
        fontsize=size,
        color=COLOURS[role],
        horizontalalignment=align,
        verticalalignment="baseline",
        rotation=rotation,
        rotation_mode="anchor",
        parse_math=False,
        transform=IdentityTransform(),
    )
    figure.add_artist(text, clip=False)


def _segments(ends: Sequence[tuple[tuple[float, float], tuple[float, float]]]) -> Path:
    from matplotlib.path import Path

    codes = np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=np.uint8), len(ends))
    path = Path(np.array(ends, dtype=np.float64).reshape(-1, 2), codes)
    path.should_simplify = False
    return path


def _ticks(limits: Limits, most: int) -> FloatArray:
    """Round numbers between the limits."""
    from matplotlib.ticker import MaxNLocator

    levels = np.asarray(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(*limits), dtype=np.float64)
    return levels[(levels >= limits[0]) & (levels <= limits[1])]


def _plain(value: float) -> str:
    return f"{0.0 if abs(value) < 1e-12 else value:.6g}".replace("-", "−")
