"""Paths of lines on paper, compared with those that reportlab writes point by point."""

from __future__ import annotations

import numpy as np
from reportlab.pdfgen.pathobject import PDFPathObject

from aerosid.reporting.figures.pdf_path import PathOfLines

POINTS = np.array([[0.0, 12.3456], [-0.004, 700.0], [99.995, 0.005], [-3.25, 3e4], [1e-9, 841.89]])


def reference(*lines: np.ndarray, closed: bool = False) -> str:
    """Of every line in turn, its points rounded to 1/100 pt and kept within 2e4 pt, one call each."""
    path = PDFPathObject()
    for line in lines:
        first, *others = np.clip(np.round(line, 2) + 0.0, -2e4, 2e4).tolist()
        path.moveTo(*first)
        for x, y in others:
            path.lineTo(x, y)
    if closed:
        path.close()
    return str(path.getCode())


def test_lines_are_those_of_reportlab() -> None:
    path = PathOfLines()
    path.line(POINTS)
    path.line(POINTS[::-1] + 1.0)
    assert path.getCode() == reference(POINTS, POINTS[::-1] + 1.0)


def test_a_closed_outline() -> None:
    path = PathOfLines()
    path.line(POINTS)
    path.close()
    assert path.getCode() == reference(POINTS, closed=True)


def test_dots_are_lines_without_length() -> None:
    path = PathOfLines()
    path.dots(POINTS)
    assert path.getCode() == reference(*(np.array([point, point]) for point in POINTS))


def test_a_path_without_points_is_empty() -> None:
    assert PathOfLines().getCode() == PDFPathObject().getCode()
