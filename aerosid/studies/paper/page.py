"""paper.html: tables and figures compared with the printed ones, in one file that loads nothing."""

from __future__ import annotations

from pathlib import Path

from aerosid import __version__
from aerosid.reporting.inline_svg import drawing_style, inline_svg
from aerosid.reporting.templating import page_environment, page_style
from aerosid.studies.paper import table1, table2, table3, table4
from aerosid.studies.paper.figures import drawings
from aerosid.studies.paper.run import Reproduction

_TEMPLATES = Path(__file__).parent / "templates"


def page_html(result: Reproduction) -> str:
    """The text of paper.html; identical for an identical result and the same versions."""
    figures = {}
    with drawing_style():
        for drawing in drawings(result.table1.fits, result.table2.fits):
            svg = inline_svg(drawing.draw(), f"figure{drawing.number}", drawing.caption)
            figures[drawing.number] = (drawing, svg)
    parts = (
        ("Discrete system", [table1.view(result.table1)], [figures[1], figures[2]]),
        ("Continuous system", [table2.view(result.table2), table2.error_view(result.table2)], [figures[3]]),
        (
            "Light transport aircraft",
            [table3.view(result.table3), table4.view(result.table4)],
            [figures[4], figures[5]],
        ),
    )
    style = page_style()
    return page_environment(_TEMPLATES).get_template("paper.html").render(parts=parts, style=style, version=__version__)
