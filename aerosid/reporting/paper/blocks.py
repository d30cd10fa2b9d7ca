"""The blocks of a section on paper: paragraphs, lists, tables and figures, in the order of the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import (
    CondPageBreak,
    Flowable,
    ListFlowable,
    ListItem,
    LongTable,
    PageBreak,
    Paragraph,
    Spacer,
    Table,
    TableStyle,
)

from aerosid.reporting.figures.numbered import Figure
from aerosid.reporting.figures.pdf import Paper
from aerosid.reporting.paper.elements import Element
from aerosid.reporting.paper.inline import markup
from aerosid.reporting.paper.tables import table
from aerosid.reporting.paper.typeface import colours, registered, style

_TEXT, _QUIET, _HEADING = 8.5, 7.5, 10.5
_LEAST = 120.0
"""Room, pt, that the headings and the first rows of a long table need."""

_KEY_SIZE, _KEY_HEIGHT = 7.5, 10.0
_CARD, _CARD_EDGE = 363.0, 10.0
"""Width of a card, pt, 128 mm of the 148 of A5, and the room inside its edge."""

_SKIPPED = {"fieldset", "svg", "script", "style"}


class Drawing(Flowable):
    """A chart with its legend, shrunk to the width of the page."""

    def __init__(self, figure: Figure, keys: list[tuple[str, str]], width: float) -> None:
        super().__init__()
        self.chart = figure.chart
        self.scale = min(width / self.chart.width, 1.0)
        self.keys = list(_set_out(keys, self.chart.width))
        self.legend = _KEY_HEIGHT * (self.keys[-1][3] + 1) + 4.0 if self.keys else 0.0

    def wrap(self, *_room: float) -> tuple[float, float]:
        """Width and height, pt."""
        return self.scale * self.chart.width, self.scale * (self.chart.height + self.legend)

    def draw(self) -> None:
        """The legend, and the chart below it."""
        self.canv.scale(self.scale, self.scale)
        paper = Paper(self.canv, colours(), registered())
        for role, words, x, line in self.keys:
            y = self.chart.height + self.legend - _KEY_HEIGHT * (line + 1) + 2.0
            paper.key(role, x, y + 2.5, 20.0)
            paper.words(x + 24.0, y, words, "ink", "left", _KEY_SIZE)
        paper.draw(self.chart)


def _set_out(keys: Sequence[tuple[str, str]], width: float) -> Iterator[tuple[str, str, float, int]]:
    """Each key with where it begins, pt, and in which line."""
    x, line = 0.0, 0
    for role, words in keys:
        length = 24.0 + stringWidth(words, registered(), _KEY_SIZE)
        if x > 0.0 and x + length > width:
            x, line = 0.0, line + 1
        yield role, words, x, line
        x += length + 12.0


def blocks(element: Element, figures: Mapping[str, Figure], width: float) -> Iterator[Any]:
    """The flowables of everything in the element.

    Parameters
    ----------
    element : Element
        A section's body.
    figures : mapping of str to Figure
        The report's figures by the ids that they have in the page.
    width : float
        Of the column, pt.
    """
    for child in element.elements():
        yield from _block(child, figures, width)


def allow_breaks(flowables: Sequence[Any]) -> Iterator[Any]:
    """The flowables with long tables free to begin on the page of their headings, some rows below them.

    Kept together with its headings, a table that fits a page would leave the rest of the page before it empty.
    """
    heads: list[Any] = []
    for flowable in flowables:
        if isinstance(flowable, Paragraph) and flowable.style.keepWithNext:
            heads.append(flowable)
            continue
        if heads and isinstance(flowable, LongTable):
            yield CondPageBreak(_LEAST)
            for head in heads:
                head.keepWithNext = False
        yield from heads
        yield flowable
        heads = []
    yield from heads


def _block(element: Element, figures: Mapping[str, Figure], width: float) -> Iterator[Any]:
    if element.tag in _SKIPPED or "legend" in element.classes:
        return
    if element.tag in ("h3", "summary"):
        yield Paragraph(markup(element), style(_HEADING, bold=True, before=8.0, after=2.0, together=True))
    elif element.tag == "p":
        yield Paragraph(markup(element), _paragraph_style(element))
    elif element.tag == "ul":
        items: list[Any] = [
            ListItem(Paragraph(markup(item), style(_TEXT)), leftIndent=12) for item in element.elements()
        ]
        if items:
            yield ListFlowable(items, bulletType="bullet", start="•", leftIndent=12, bulletFontSize=_TEXT)
    elif element.tag == "dl":
        facts = [(next(entry.all("dt")), next(entry.all("dd"))) for entry in element.elements()]
        words = ", ".join(f"<b>{markup(name)}</b> {markup(value)}" for name, value in facts)
        yield Paragraph(words, style(_TEXT, after=3.0))
    elif element.tag == "table":
        yield from _captioned(element, width)
    elif element.tag == "figure":
        yield from _figure(element, figures, width)
    elif "verdict" in element.classes:
        yield _verdict(element, width)
    elif "card" in element.classes:
        yield from _card(element, figures, width)
    else:
        yield from blocks(element, figures, width)


def _paragraph_style(element: Element) -> Any:
    if "quiet" in element.classes:
        return style(_QUIET, "muted", before=2.0, after=3.0)
    return style(_TEXT, before=2.0, after=3.0)


def _captioned(element: Element, width: float) -> Iterator[Any]:
    for caption in element.all("caption"):
        yield Paragraph(markup(caption), style(_TEXT, bold=True, before=6.0, after=1.0, together=True))
    yield table(element, width)
    yield Spacer(0.0, 5.0)


def _figure(element: Element, figures: Mapping[str, Figure], width: float) -> Iterator[Any]:
    keys = []
    for key in element.all("span"):
        if "key" in key.classes:
            role = next(iter(key.all("svg"))).attributes["class"].removeprefix("line-")
            keys.append((role, " ".join(key.text().split())))
    caption = next(iter(element.all("figcaption")))
    drawing = Drawing(figures[element.attributes["id"]], keys, width)
    drawing.keepWithNext = True
    drawing.spaceBefore = 6.0
    yield drawing
    yield Paragraph(markup(caption), style(_QUIET, "muted", before=2.0, after=6.0))


def _verdict(element: Element, width: float) -> Table:
    """The verdict's box: a bar of its tone beside its sentences."""
    tone = next(iter(element.classes & {"good", "fair", "poor"}), "fair")
    sentences = []
    for child in element.elements():
        large, word = "summary" in child.classes, "word" in child.classes
        words = markup(child).capitalize() if word else markup(child)
        sentences.append(
            Paragraph(words, style(11.0 if large else 9.0, tone if word else "ink", bold=large or word, after=2.0))
        )
    rules: list[Any] = [
        ("BACKGROUND", (0, 0), (-1, -1), colours()[f"{tone}-sheet"]),
        ("LINEBEFORE", (0, 0), (0, -1), 4.0, colours()[tone]),
        ("LEFTPADDING", (0, 0), (-1, -1), 12.0),
    ]
    return Table([[sentences]], colWidths=[width], style=TableStyle(rules))


def _card(element: Element, figures: Mapping[str, Figure], width: float) -> Iterator[Any]:
    """A card to be cut out and taken along, whole on a sheet of its own, in the column of an A5 sheet."""
    column = min(width, _CARD)
    rules: list[Any] = [
        ("BOX", (0, 0), (-1, -1), 1.0, colours()["ink"]),
        ("LEFTPADDING", (0, 0), (-1, -1), _CARD_EDGE),
        ("RIGHTPADDING", (0, 0), (-1, -1), _CARD_EDGE),
    ]
    content = list(blocks(element, figures, column - 2.0 * _CARD_EDGE))
    yield PageBreak()
    yield Table([[content]], colWidths=[column], style=TableStyle(rules), hAlign="LEFT")
    yield PageBreak()
