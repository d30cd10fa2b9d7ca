"""Fonts, colours and paragraph styles of the report on paper."""

from __future__ import annotations

import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from aerosid.errors import UsageError

if TYPE_CHECKING:
    from reportlab.lib.colors import Color
    from reportlab.lib.styles import ParagraphStyle

TYPEFACE = "DejaVuSans"
"""Bundled with matplotlib; contains Greek, subscripts and the signs of the tables."""

_STYLE_SHEET = Path(__file__).parents[1] / "templates" / "style.css"
_VARIABLE = re.compile(r"--([\w-]+): #([0-9a-f]{6})([0-9a-f]{2})?")


@cache
def registered() -> str:
    """The typeface, registered with reportlab in four styles; built-in fonts have no Greek."""
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    spec = find_spec("matplotlib")
    if spec is None or spec.origin is None:
        raise UsageError("matplotlib, whose fonts report.pdf uses, is not installed; reinstall aerosid.")
    folder = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf"
    cuts = [f"{TYPEFACE}{cut}" for cut in ("", "-Bold", "-Oblique", "-BoldOblique")]
    for cut in cuts:
        pdfmetrics.registerFont(TTFont(cut, str(folder / f"{cut}.ttf")))
    pdfmetrics.registerFontFamily(TYPEFACE, *cuts)
    return TYPEFACE


@cache
def colours() -> dict[str, Color]:
    """The light colours of the page by the names of their variables."""
    from reportlab.lib.colors import Color

    light = _STYLE_SHEET.read_text(encoding="utf-8").split("}", 1)[0]
    found = {}
    for name, digits, opacity in _VARIABLE.findall(light):
        red, green, blue = (int(digits[i : i + 2], 16) / 255.0 for i in (0, 2, 4))
        found[name] = Color(red, green, blue, int(opacity or "ff", 16) / 255.0)
    return found


@cache
def style(
    size: float,
    colour: str = "ink",
    *,
    bold: bool = False,
    right: bool = False,
    before: float = 0.0,
    after: float = 0.0,
    together: bool = False,
    indent: float = 0.0,
) -> ParagraphStyle:
    """A paragraph style: size, space before and after, indent, pt; `together` keeps it with the next paragraph."""
    from reportlab.lib.enums import TA_LEFT, TA_RIGHT
    from reportlab.lib.styles import ParagraphStyle

    name = f"{registered()}-Bold" if bold else registered()
    return ParagraphStyle(
        "text",
        fontName=name,
        fontSize=size,
        leading=1.25 * size,
        textColor=colours()[colour],
        alignment=TA_RIGHT if right else TA_LEFT,
        leftIndent=indent,
        bulletIndent=0.0,
        spaceBefore=before,
        spaceAfter=after,
        keepWithNext=together,
        splitLongWords=True,
        allowWidows=0,
        allowOrphans=0,
    )
