"""Charts as data: panels with axes, and marks on them, in the units shown; the renderers are other modules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Limits = tuple[float, float]
Role = Literal[
    "ink",
    "muted",
    "grid",
    "measured",
    "declared",
    "before",
    "after",
    "trimmed",
    "noise",
    "tolerance",
    "tolerance-edge",
    "surface",
]
"""Meaning of a mark; style.css gives each role its colour, light and dark."""

DASHES: dict[str, tuple[float, ...]] = {
    "declared": (1.2, 1.6),
    "before": (5.0, 2.0),
    "trimmed": (7.0, 1.5, 1.5, 1.5),
    "tolerance-edge": (0.8, 1.6),
}
"""Display: strokes and gaps, pt, that distinguish lines without their colours; a role that is not
here is solid."""

WORDS: dict[str, str] = {
    "measured": "measured",
    "declared": "declared",
    "before": "re-estimated",
    "after": "completed",
    "trimmed": "trimmed",
    "noise": "± 2 × noise",
    "tolerance": "tolerance",
    "tolerance-edge": "tolerance",
}
"""Name of each role in legends."""


@dataclass(frozen=True)
class Line:
    """A line of (N,) samples; NaN interrupts it. `width` in pt."""

    x: FloatArray
    y: FloatArray
    role: Role
    width: float = 1.1


@dataclass(frozen=True)
class Points:
    """One dot per sample (N,); `ordered` where x is a time, so that a long record can be thinned."""

    x: FloatArray
    y: FloatArray
    role: Role = "measured"
    ordered: bool = True


@dataclass(frozen=True)
class Band:
    """A band across the whole panel between two levels."""

    low: float
    high: float
    role: Role = "noise"


@dataclass(frozen=True)
class Corridor:
    """The area between two histories (N,)."""

    x: FloatArray
    low: FloatArray
    high: FloatArray
    role: Role = "tolerance"


@dataclass(frozen=True)
class Outline:
    """A filled shape with the corners x, y (N,)."""

    x: FloatArray
    y: FloatArray
    role: Role = "surface"


@dataclass(frozen=True)
class Words:
    """A text with its baseline at x, y, pt high; `_{x}` in it is a subscript."""

    x: float
    y: float
    text: str
    role: Role = "ink"
    align: Literal["left", "center", "right"] = "left"
    size: float = 8.0


Mark = Line | Points | Band | Corridor | Outline | Words


@dataclass(frozen=True)
class Axis:
    """One axis: its label with the unit in brackets, its limits, and its tick values; none where it is bare."""

    label: str
    limits: Limits
    ticks: tuple[float, ...] = ()
    bare: bool = False


@dataclass(frozen=True)
class Panel:
    """One frame of a chart: its left and lower edge and its size, pt, from the chart's lower left corner.

    `quiet`: its label is small, as part of the panel above. `framed`: it has axes and a grid.
    """

    left: float
    bottom: float
    width: float
    height: float
    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    quiet: bool = False
    framed: bool = True

    def across(self, x: FloatArray) -> FloatArray:
        """Position of x, pt from the chart's left edge."""
        low, high = self.x.limits
        return np.asarray(self.left + self.width * (x - low) / (high - low))

    def up(self, y: FloatArray) -> FloatArray:
        """Position of y, pt from the chart's lower edge."""
        low, high = self.y.limits
        return np.asarray(self.bottom + self.height * (y - low) / (high - low))


@dataclass(frozen=True)
class Chart:
    """A figure: its size, pt, and its panels.

    `timeline` identifies the common time axis of the panels; charts of one timeline are zoomed together. Empty where
    the panels do not share their x axes.
    """

    width: float
    height: float
    panels: tuple[Panel, ...]
    timeline: str = ""
