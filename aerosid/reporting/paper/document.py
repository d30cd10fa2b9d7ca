"""report.pdf: the sections of the page on numbered sheets of A4."""

from __future__ import annotations

import io
import re
from typing import Any

from reportlab import rl_config
from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Frame, PageTemplate, Paragraph

from aerosid.reporting.page import Report
from aerosid.reporting.paper.blocks import blocks
from aerosid.reporting.paper.elements import Element, parsed
from aerosid.reporting.paper.inline import markup, printable
from aerosid.reporting.paper.typeface import colours, registered, style
from aerosid.results import ClosedLoop

_PICTURE = re.compile(r'<svg [^>]*role="img".*?</svg>', re.DOTALL)
"""The page's figures, which are drawn anew."""

_SIDE, _TOP, _FOOT = 15.0 * mm, 14.0 * mm, 18.0 * mm


def report_pdf(result: ClosedLoop, report: Report) -> bytes:
    """The bytes of report.pdf; identical for an identical result and the same versions.

    Parameters
    ----------
    result : ClosedLoop
        What one run of the loop found.
    report : Report
        Its sections, as `aerosid.reporting.page.compose` gives them.
    """
    width = A4[0] - 2.0 * _SIDE
    title = Paragraph(_text(result.aircraft.name), style(18.0, bold=True, after=4.0))
    story: list[Any] = [Paragraph("Model error report", style(8.0, "muted")), title, *_head(result)]
    rl_config.useA85 = 0  # bytes as they are: text form takes longer and a quarter more room
    figures = {figure.identity: figure for figure in report.figures}
    for section, body in report.parts:
        story.append(_Heading(section.title, section.name))
        story.extend(blocks(parsed(_PICTURE.sub("", body)), figures, width))
    stream = io.BytesIO()
    document = BaseDocTemplate(
        stream,
        pagesize=A4,
        title=printable(f"Model error report: {result.aircraft.name}"),
        author=f"aerosid {result.version}",
        lang="en",
        invariant=1,  # no time of writing
    )
    frame = Frame(_SIDE, _FOOT, width, A4[1] - _TOP - _FOOT, 0, 0, 0, 0)
    document.addPageTemplates(PageTemplate(frames=[frame]))
    foot = f"aerosid {result.version}, seed {result.seed}. Angles in degrees; in radians in result.json and the tables."
    document.build(story, canvasmaker=lambda *args, **keys: _Numbered(foot, *args, **keys))
    return stream.getvalue()


class _Heading(Paragraph):
    """A section's title, with its place in the document's outline."""

    def __init__(self, title: str, name: str) -> None:
        super().__init__(_text(title), style(13.0, bold=True, before=14.0, after=4.0, together=True))
        self.title, self.name = title, name

    def draw(self) -> None:
        """The title under a rule."""
        self.canv.bookmarkPage(self.name)
        self.canv.addOutlineEntry(self.title, self.name, 0)
        self.canv.setStrokeColor(colours()["ink"])
        self.canv.setLineWidth(1.0)
        self.canv.line(0.0, self.height + 3.0, self.width, self.height + 3.0)
        super().draw()


class _Numbered(Canvas):
    """A canvas that knows how many pages there are when it writes their numbers."""

    def __init__(self, foot: str, *args: Any, **keys: Any) -> None:
        super().__init__(*args, **keys)
        self._foot = foot
        self._pages: list[dict[str, Any]] = []

    def showPage(self) -> None:
        """Keeps the page until all are known."""
        self._pages.append(dict(self.__dict__))
        self._startPage()  # type: ignore[attr-defined]  # reportlab's own way to number pages

    def save(self) -> None:
        """Writes every page with its number."""
        for number, page in enumerate(self._pages, start=1):
            self.__dict__.update(page)
            self.setFont(registered(), 7.0)
            self.setFillColor(colours()["muted"])
            self.drawString(_SIDE, 10.0 * mm, self._foot)
            self.drawRightString(A4[0] - _SIDE, 10.0 * mm, f"page {number} of {len(self._pages)}")
            super().showPage()
        super().save()


def _head(result: ClosedLoop) -> list[Any]:
    """What the page's head says: the flights and the aircraft file."""
    facts = (
        ("Fitted on", ", ".join(log.name for log in result.identification)),
        ("Validated on", ", ".join(log.name for log in result.validation) or "no flight"),
        ("Aircraft file", result.aircraft.path),
    )
    return [Paragraph(f"<b>{name}:</b> {_text(words)}", style(8.5)) for name, words in facts]


def _text(words: str) -> str:
    return markup(Element("span", {}, [words]))
