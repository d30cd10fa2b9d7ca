"""The blocks of a section on paper: paragraphs, lists, tables and figures, in the order of the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any

from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import (
    CondPageBreak,
    Flowable,
    LongTable,
    Paragraph,
    Spacer,
    Table,
    TableStyle,
)

from aerosid.reporting.figures.chart import Chart
from aerosid.reporting.figures.layout import parted
from aerosid.reporting.figures.numbered import Figure
from aerosid.reporting.figures.pdf import Paper
from aerosid.reporting.paper.elements import Element
from aerosid.reporting.paper.inline import markup
from aerosid.reporting.paper.tables import table
from aerosid.reporting.paper.typeface import colours, registered, style

_TEXT, _QUIET, _HEADING = 8.0, 7.0, 10.0
"""Display: pt, sizes of type."""

_LEAST = 120.0
"""Display: room, pt, needed by the headings and the first rows of a long table or lines of a long text."""
_LONG_TEXT = 900
"""Display: characters, about seven lines, from which on a text below a heading may continue on the next page."""

_KEY_SIZE, _KEY_HEIGHT = 7.5, 10.0
"""Display: pt, type and height of a figure's legend."""

_NAMES = 92.0
"""Display: width, pt, of the column of names in a list of facts."""
_CARD, _CARD_EDGE = 363.0, 10.0
"""Display: width of a card, pt, 128 mm of the 148 of A5, and its inner margin."""

_BETWEEN = 12.0
"""Display: room between adjacent parts, pt."""

_SMALL = 0.62
"""Display: scale of a figure of class `small`."""

_SKIPPED = {"fieldset", "svg", "script", "style"}


class Drawing(Flowable):
    """A chart between its legend and its caption, scaled to the page's width; strips may continue on the next page."""

    def __init__(
        self,
        chart: Chart,
        keys: Sequence[tuple[str, str]],
        captions: tuple[str, str],
        width: float,
        largest: float = 1.0,
        heads: Sequence[Paragraph] = (),
    ) -> None:
        super().__init__()
        self.chart, self.words, self.captions, self.width, self.heads = chart, keys, captions, width, heads
        self.scale = min(width / chart.width, largest)
        self.keys = list(_set_out(keys, chart.width))
        self.legend = _KEY_HEIGHT * (self.keys[-1][3] + 1) + 4.0 if self.keys else 0.0
        self.caption = Paragraph(captions[0], style(_QUIET, "muted"))
        self.below = self.caption.wrap(width, 1e4)[1] + 2.0
        self.above = sum(head.wrap(width, 1e4)[1] + 3.0 for head in heads)
        self.spaceBefore, self.spaceAfter = 6.0, 6.0

    def under(self, heads: Sequence[Paragraph]) -> Drawing:
        """The same with headings above it, which stay on the page of its first strips."""
        return Drawing(self.chart, self.words, self.captions, self.width, self.scale, heads)

    def wrap(self, *_room: float) -> tuple[float, float]:
        """Width and height, pt."""
        return self.width, self.above + self.scale * (self.chart.height + self.legend) + self.below

    def split(self, _width: float, room: float) -> list[Flowable]:
        """The strips that fit the room, pt, and the others; nothing where too few fit."""
        parts = parted(self.chart, (room - self.below - self.above) / self.scale - self.legend)
        if parts is None:
            return []
        return [
            Drawing(parts[0], self.words, self.captions, self.width, self.scale, self.heads),
            Drawing(parts[1], self.words, (self.captions[1],) * 2, self.width, self.scale),
        ]

    def draw(self) -> None:
        """The headings, the legend, the chart below it, and the caption."""
        top = self.wrap()[1]
        for head in self.heads:
            top -= head.height
            head.drawOn(self.canv, 0.0, top)
            top -= 3.0
        self.caption.drawOn(self.canv, 0.0, 0.0)
        self.canv.translate(0.0, self.below)
        self.canv.scale(self.scale, self.scale)
        paper = Paper(self.canv, colours(), registered())
        for role, words, x, line in self.keys:
            y = self.chart.height + self.legend - _KEY_HEIGHT * (line + 1) + 2.0
            paper.key(role, x, y + 2.5, 20.0)
            paper.words(x + 24.0, y, words, "ink", "left", _KEY_SIZE)
        paper.draw(self.chart)


def _set_out(keys: Sequence[tuple[str, str]], width: float) -> Iterator[tuple[str, str, float, int]]:
    """Each legend entry with its position, pt, and its line."""
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
        The report's figures by their ids in the page.
    width : float
        Of the column, pt.
    """
    for child in element.elements():
        yield from _block(child, figures, width)


def allow_breaks(flowables: Sequence[Any]) -> Iterator[Any]:
    """The flowables with long tables, long texts and strip charts free to begin on the page of their headings.

    A table, a text or a chart of up to a page that stayed together with its headings would leave the rest of the
    page before empty.
    """
    heads: list[Any] = []
    for flowable, following in zip_longest(flowables, flowables[1:]):
        below = bool(heads) and isinstance(following, LongTable)  # a text between the headings and their table
        if isinstance(flowable, Paragraph) and (flowable.style.keepWithNext or below):
            heads.append(flowable)
            continue
        if isinstance(flowable, Drawing):
            yield flowable.under(heads)
            heads = []
            continue
        if isinstance(flowable, LongTable) or (heads and _is_long_text(flowable)):
            yield CondPageBreak(_LEAST)
            for head in heads:
                head.keepWithNext = False
        yield from heads
        yield flowable
        heads = []
    yield from heads


def _is_long_text(flowable: Any) -> bool:
    return isinstance(flowable, Paragraph) and len(flowable.text or "") > _LONG_TEXT


def _block(element: Element, figures: Mapping[str, Figure], width: float) -> Iterator[Any]:
    if element.tag in _SKIPPED or element.classes & {"legend", "on-screen"}:
        return
    if element.tag in ("h3", "summary"):
        yield Paragraph(markup(element), style(_HEADING, bold=True, before=8.0, after=2.0, together=True))
    elif element.tag == "p":
        yield Paragraph(markup(element), _paragraph_style(element))
    elif element.tag == "ul":
        for item in element.elements():
            yield Paragraph(markup(item), style(_TEXT, after=1.0, indent=12.0), bulletText="•")
    elif element.tag == "dl":
        facts = [(next(entry.all("dt")), next(entry.all("dd"))) for entry in element.elements()]
        if "lines" in element.classes:
            yield _lines(facts, width)
            return
        if "terms" in element.classes:
            words = " ".join(f"<b>{markup(name)}</b>: {markup(value)}" for name, value in facts)
            yield Paragraph(words, style(_QUIET, after=3.0))
            return
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
    elif "beside" in element.classes:
        yield _beside(list(element.elements()), figures, width)
    else:
        yield from blocks(element, figures, width)


def _lines(facts: Sequence[tuple[Element, Element]], width: float) -> Table:
    """Facts one below the other, their names in a column of their own."""
    cells = [
        [Paragraph(markup(name), style(_QUIET, "muted")), Paragraph(markup(text), style(_QUIET))]
        for name, text in facts
    ]
    rules: list[Any] = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("LEFTPADDING", (0, 0), (-1, -1), 0.0),
        ("RIGHTPADDING", (0, 0), (-1, -1), 6.0),
        ("TOPPADDING", (0, 0), (-1, -1), 0.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 0.5),
    ]
    return Table(cells, colWidths=[_NAMES, width - _NAMES], style=TableStyle(rules), hAlign="LEFT", spaceAfter=4.0)


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
            keys.append((role, " ".join(_lowered(key).split())))
    caption = next(iter(element.all("figcaption")))
    figure = figures[element.attributes["id"]]
    more = f"<b>Figure {figure.number}, continued.</b>"
    largest = _SMALL if "small" in element.classes else 1.0
    yield Drawing(figure.chart, keys, (markup(caption), more), width, largest)


def _lowered(element: Element) -> str:
    """The text of a legend's key, a subscript as `_{x}`, as figures take it."""
    parts = [child if isinstance(child, str) else _lowered(child) for child in element.children]
    return f"_{{{''.join(parts)}}}" if element.tag == "sub" else "".join(parts)


def _verdict(element: Element, width: float) -> Table:
    """The verdict's box: a bar in the colour of the verdict beside its sentences."""
    tone = next(iter(element.classes & {"good", "fair", "poor"}), "fair")
    sentences = []
    for child in element.elements():
        large, word = "summary" in child.classes, "word" in child.classes
        words = markup(child).capitalize() if word else markup(child)
        sentences.append(
            Paragraph(words, style(9.5 if large else 8.5, tone if word else "ink", bold=large or word, after=1.5))
        )
    rules: list[Any] = [
        ("BACKGROUND", (0, 0), (-1, -1), colours()[f"{tone}-sheet"]),
        ("LINEBEFORE", (0, 0), (0, -1), 4.0, colours()[tone]),
        ("LEFTPADDING", (0, 0), (-1, -1), 12.0),
    ]
    return Table([[sentences]], colWidths=[width], style=TableStyle(rules))


def _beside(parts: Sequence[Element], figures: Mapping[str, Figure], width: float) -> Table:
    """Adjacent parts, each in a column of its own."""
    column = (width + _BETWEEN) / len(parts)
    cells = [list(blocks(part, figures, column - _BETWEEN)) for part in parts]
    rules: list[Any] = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("LEFTPADDING", (0, 0), (-1, -1), 0.0),
        ("RIGHTPADDING", (0, 0), (-1, -1), _BETWEEN),
        ("TOPPADDING", (0, 0), (-1, -1), 0.0),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 0.0),
    ]
    return Table([cells], colWidths=[column] * len(parts), style=TableStyle(rules), hAlign="LEFT", spaceBefore=6.0)


def _card(element: Element, figures: Mapping[str, Figure], width: float) -> Iterator[Any]:
    """A card to be cut out: on one sheet, in the column of an A5 sheet."""
    column = min(width, _CARD)
    rules: list[Any] = [
        ("BOX", (0, 0), (-1, -1), 1.0, colours()["ink"]),
        ("LEFTPADDING", (0, 0), (-1, -1), _CARD_EDGE),
        ("RIGHTPADDING", (0, 0), (-1, -1), _CARD_EDGE),
    ]
    content = list(blocks(element, figures, column - 2.0 * _CARD_EDGE))
    yield Table([[content]], colWidths=[column], style=TableStyle(rules), hAlign="LEFT", splitByRow=0)
