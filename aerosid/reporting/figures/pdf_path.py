"""The operators of a path in a PDF, written for all points of a line at once."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from reportlab.lib.rl_accel import fp_str
from reportlab.pdfgen.pathobject import PDFPathObject

from aerosid.reporting.figures.chart import FloatArray

_FURTHEST = 2_000_000
"""Display: 1/100 pt; beyond what a page can hold, and within what readers of PDF can."""

_KEPT = 100_000
"""Numerical: texts of coordinates that are kept: those of a page of A4."""


class PathOfLines(PDFPathObject):
    """A path of straight lines; reportlab's own takes a call for every point, and writes each number anew."""

    _code: list[str]

    def line(self, points: FloatArray) -> None:
        """A line through the points (M, 2), pt, at least one."""
        first, *others = _places(points)
        self._extend([f"{first} m", *(f"{place} l" for place in others)])

    def dots(self, points: FloatArray) -> None:
        """A line without length at each of the points (M, 2), pt."""
        self._extend([f"{place} m {place} l" for place in _places(points)])

    def close(self) -> None:
        """Leads the line back to where it began."""
        self._extend(["h"])

    def _extend(self, code: list[str]) -> None:
        self._code += code if self._code else ["n", *code]


def _places(points: FloatArray) -> list[str]:
    numbers = np.clip(np.rint(100.0 * points), -_FURTHEST, _FURTHEST).astype(np.int64)
    across, up = (map(_text, axis) for axis in numbers.T.tolist())
    return [f"{x} {y}" for x, y in zip(across, up, strict=True)]


@lru_cache(_KEPT)
def _text(hundredths: int) -> str:
    """The number as a PDF holds it: a history shares its times with all others of a figure."""
    text: str = fp_str(hundredths / 100.0)
    return text
