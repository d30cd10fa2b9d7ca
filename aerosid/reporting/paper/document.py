"""report.pdf: the sections of the page on numbered sheets of A4."""

from __future__ import annotations

import io
import re
import zlib
from collections.abc import Sequence
from typing import Any

from reportlab import rl_config
from reportlab.lib.pagesizes import A4
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Frame, PageTemplate, Paragraph

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import Figure
from aerosid.reporting.page import Report
from aerosid.reporting.paper.blocks import allow_breaks, blocks
from aerosid.reporting.paper.elements import Element, parsed
from aerosid.reporting.paper.inline import markup, printable
from aerosid.reporting.paper.typeface import colours, registered, style

_PICTURE = re.compile(r'<svg [^>]*role="img".*?</svg>', re.DOTALL)
"""The page's figures, drawn again for paper."""

_SIDE, _TOP, _FOOT = 15.0 * mm, 10.0 * mm, 14.0 * mm


def report_pdf(result: ClosedLoop, report: Report) -> bytes:
    """The bytes of report.pdf; identical for an identical result and the same versions.

    Parameters
    ----------
    result : ClosedLoop
        The result of close-loop.
    report : Report
        Its sections, from `aerosid.reporting.page.compose`.
    """
    sections = [(section.title, section.name, parsed(_PICTURE.sub("", body))) for section, body in report.parts]
    foot = f"aerosid {result.version}, seed {result.seed}. Angles in degrees; in radians in result.json and the tables."
    head = _head(result, report)
    return _sheets("Model error report", result.aircraft.name, head, sections, report.figures, result.version, foot)


def page_pdf(page: str, figures: Sequence[Figure], version: str) -> bytes:
    """A whole page on numbered sheets: its kind, title and facts, then its sections; identical for an identical page.

    Parameters
    ----------
    page : str
        HTML with a header (a paragraph of class `kind`, a title, a list of facts), sections with titles of the second
        order in `main`, and a footer.
    figures : sequence of Figure
        Those in the page, by their ids.
    version : str
        Version of aerosid.
    """
    tree = parsed(_PICTURE.sub("", page[page.index("<header>") : page.index("</body>")]))
    header, main, footer = (next(tree.all(tag)) for tag in ("header", "main", "footer"))
    kind, title = (next(header.all(tag)).text().strip() for tag in ("p", "h1"))
    width = A4[0] - 2.0 * _SIDE
    entries: list[Element | str] = [child for child in header.elements() if child.tag in ("dl", "p")]
    facts = Element("div", {}, entries[1:])
    sections = [(next(section.all("h2")).text(), section.attributes["id"], section) for section in main.all("section")]
    foot = " ".join(footer.text().split())
    return _sheets(kind, title, list(blocks(facts, {}, width)), sections, figures, version, foot)


def _sheets(
    kind: str,
    title: str,
    head: Sequence[Any],
    sections: Sequence[tuple[str, str, Element]],
    figures: Sequence[Figure],
    version: str,
    foot: str,
) -> bytes:
    """The pages: kind of document, title and head, then each section's title, name and body."""
    width = A4[0] - 2.0 * _SIDE
    large = Paragraph(_text(title), style(18.0, bold=True, after=4.0))
    story: list[Any] = [Paragraph(_text(kind), style(8.0, "muted")), large, *head]
    rl_config.useA85 = 0  # binary streams: their text form is slower and a quarter larger
    by_identity = {figure.identity: figure for figure in figures}
    for heading, name, body in sections:
        story.extend(allow_breaks([_Heading(heading, name), *blocks(body, by_identity, width)]))
    stream = io.BytesIO()
    document = BaseDocTemplate(
        stream,
        pagesize=A4,
        title=printable(f"{kind}: {title}"),
        author=f"aerosid {version}",
        lang="en",
        invariant=1,  # no time of writing in the file
    )
    frame = Frame(_SIDE, _FOOT, width, A4[1] - _TOP - _FOOT, 0, 0, 0, 0)
    document.addPageTemplates(PageTemplate(frames=[frame]))
    document.build(story, canvasmaker=lambda *args, **keys: _Numbered(foot, *args, **keys))
    return stream.getvalue()


class _Heading(Paragraph):
    """A section's title, with its place in the document's outline."""

    def __init__(self, title: str, name: str) -> None:
        super().__init__(_text(title), style(12.5, bold=True, before=11.0, after=3.0, together=True))
        self.title, self.name = title, name

    def draw(self) -> None:
        """The title under a rule."""
        self.canv.bookmarkPage(self.name)
        self.canv.addOutlineEntry(self.title, self.name, 0)
        self.canv.setStrokeColor(colours()["ink"])
        self.canv.setLineWidth(1.0)
        self.canv.line(0.0, self.height + 3.0, self.width, self.height + 3.0)
        super().draw()


class _QuickDeflation:
    """A filter of a PDF's streams: at zlib's level 4, a third of the usual one's time for a fourteenth more bytes."""

    pdfname = "FlateDecode"

    def encode(self, content: str | bytes) -> bytes:
        """The content as it is stored."""
        return zlib.compress(content.encode("utf-8") if isinstance(content, str) else content, 4)


class _Numbered(Canvas):
    """A canvas that delays the page numbers until the number of pages is known."""

    def __init__(self, foot: str, *args: Any, **keys: Any) -> None:
        super().__init__(*args, **keys)
        self.setPageCompression(0)  # which is by the document's own filter below
        self._doc.defaultStreamFilters = [_QuickDeflation()]  # type: ignore[attr-defined]
        self._foot = foot
        self._pages: list[dict[str, Any]] = []

    def showPage(self) -> None:
        """Stores the page until the number of pages is known."""
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


def _head(result: ClosedLoop, report: Report) -> list[Any]:
    """The head of a page: the flights, then the title block."""
    facts = [
        ("fitted on" if result.identified else "not fitted", ", ".join(log.name for log in result.identification)),
        ("validated on", ", ".join(log.name for log in result.validation) or "none"),
    ]
    if result.hold_out:
        facts.append(("held out", ", ".join(log.name for log in result.hold_out)))
    facts_line = "; ".join(f"{name} <b>{_text(words)}</b>" for name, words in facts)
    line = Paragraph(f"{facts_line[:1].upper()}{facts_line[1:]}", style(8.0, after=2.0))
    return [line, *blocks(parsed(report.title), {}, A4[0] - 2.0 * _SIDE)]


def _text(words: str) -> str:
    return markup(Element("span", {}, [words]))
