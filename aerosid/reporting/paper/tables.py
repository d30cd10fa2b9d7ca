"""A table of the page on paper: columns as wide as their words need, headings repeated on every page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import Flowable, LongTable, Paragraph, Table, TableStyle

from aerosid.reporting.paper.elements import Element
from aerosid.reporting.paper.inline import escaped, markup, printable
from aerosid.reporting.paper.typeface import colours, style

_SIZE, _HEAD_SIZE, _HASH_SIZE = 7.0, 6.5, 5.2
"""Display: pt, type of rows, of headings and of check sums."""

_PADDING, _MATRIX_PADDING = 3.0, 0.75
"""Display: pt inside a cell, and inside one of a matrix, whose columns are many and equal."""

_LONG = 12
"""Display: rows beyond which a table may continue on the next page."""
_GUTTER = 24.0
"""Display: pt between the halves of a table set side by side."""
_SPARE = 14.0
"""Display: pt by which a column may exceed its need."""
_SKIPPED = {"track", "track-head"}  # drawn by the style sheet; the numbers are in the next column
_SCALES = (1.0, 0.94, 0.88, 0.82, 0.76)
"""Display: scales of the type in a table, the largest first; the smallest legible type on paper is 5.3 pt."""
_LONGEST_WORD = 130.0
"""Display: maximum width, pt, of one word; a longer one, usually a path, is broken after its separators."""
_PIECES = re.compile(r"[^/\\_.,-]+[/\\_.,-]*|[/\\_.,-]+")


_NO_ROW = Element("tr")


@dataclass(frozen=True)
class _Cell:
    """One cell: its column, how many it spans, and its text."""

    column: int
    span: int
    element: Element
    head: bool


@dataclass(frozen=True)
class _Row:
    """One row of the table: its element, its cells, and the column in which it begins."""

    element: Element
    cells: list[_Cell]
    first: int = 0


def table(element: Element, width: float) -> Table:
    """The table within the given width, pt; a long narrow one in two halves next to each other."""
    parts = _parts(element)
    lines = [[_Row(row, _cells(row, head=part.tag == "thead"))] for part in parts for row in part.all("tr")]
    columns = max((cell.column + cell.span for (row,) in lines for cell in row.cells), default=1)
    heads = sum(1 for part in parts if part.tag == "thead" for _ in part.all("tr"))
    rows = [row.cells for (row,) in lines]
    padding = _MATRIX_PADDING if "matrix" in element.classes else _PADDING
    scale, widths = _fitted(rows, columns, width, padding)
    narrow = _narrowest(rows, heads, columns, padding)
    if _folds(lines, heads) and 2.0 * sum(narrow) + _GUTTER <= width:
        scale, lines = 1.0, _folded(lines, heads, columns)
        spare = min((0.5 * (width - _GUTTER) - sum(narrow)) / columns, _SPARE)
        widths = [need + spare for need in narrow]
        widths = [*widths, _GUTTER, *widths]
    grid: list[list[Any]] = [[""] * len(widths) for _ in lines]
    rules: list[tuple[Any, ...]] = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("VALIGN", (0, 0), (-1, heads - 1), "BOTTOM"),
        ("LEFTPADDING", (0, 0), (-1, -1), padding),
        ("RIGHTPADDING", (0, 0), (-1, -1), padding),
        ("TOPPADDING", (0, 0), (-1, -1), 0.5),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 1.2),
        ("FONTSIZE", (0, 0), (-1, -1), _HASH_SIZE),  # of an empty cell, which is as high as a line of its type
        ("LEADING", (0, 0), (-1, -1), _HASH_SIZE),
    ]
    for i, row in ((i, row) for i, line in enumerate(lines) for row in line):
        last = row.first + columns - 1
        rules.append(("LINEBELOW", (row.first, i), (last, i), 0.25, colours()["rule"]))
        if i == heads - 1:
            rules.append(("LINEBELOW", (row.first, i), (last, i), 0.5, colours()["muted"]))
        if "group" in row.element.classes and i + 1 < len(lines):
            rules.append(("NOSPLIT", (0, i), (-1, i + 1)))  # a group's name stays on the page of its first row
        if "chosen" in row.element.classes:
            rules.append(("BACKGROUND", (row.first, i), (last, i), colours()["chosen"]))
        for cell in row.cells:
            column = row.first + cell.column
            if cell.span > 1:
                rules.append(("SPAN", (column, i), (column + cell.span - 1, i)))
            across = sum(widths[column : column + cell.span])
            grid[i][column] = _content(cell, _style(cell, row.element, scale), across - 2.0 * padding)
    kind = LongTable if len(grid) > _LONG else Table
    return kind(grid, colWidths=widths, repeatRows=heads, style=TableStyle(rules), hAlign="LEFT")


def _folds(lines: list[list[_Row]], heads: int) -> bool:
    """Whether the table is long and its rows are independent: none names a group of rows below it."""
    body = [row for (row,) in lines[heads:]]
    return len(body) > _LONG and not any(
        "group" in row.element.classes or any(cell.span > 1 for cell in row.cells) for row in body
    )


def _folded(lines: list[list[_Row]], heads: int, columns: int) -> list[list[_Row]]:
    """The second half of the rows next to the first, below the same headings."""
    middle = heads + (len(lines) - heads + 1) // 2
    beside = [*lines[:heads], *lines[middle:]]
    return [
        line + [_Row(row.element, row.cells, columns + 1) for other in beside[i : i + 1] for row in other]
        for i, line in enumerate(lines[:middle])
    ]


def _parts(element: Element) -> list[Element]:
    return [part for part in element.elements() if part.tag in ("thead", "tbody")]


def _cells(row: Element, *, head: bool) -> list[_Cell]:
    cells = []
    column = 0
    for element in row.elements():
        if element.classes & _SKIPPED:
            continue
        span = int(element.attributes.get("colspan", "1"))
        cells.append(_Cell(column, span, element, head))
        column += span
    return cells


class _OneLine(Flowable):
    """A text without markup that fits its column, as in most cells; a paragraph takes ten times as long to typeset."""

    def __init__(self, text: str, its_style: Any) -> None:
        super().__init__()
        self.text, self.style = text, its_style

    def wrap(self, width: float, _height: float) -> tuple[float, float]:
        """Width and height, pt."""
        self.width = width
        return width, self.style.leading

    def draw(self) -> None:
        """The text at its side of the column (left or right)."""
        self.canv.setFont(self.style.fontName, self.style.fontSize)
        self.canv.setFillColor(self.style.textColor)
        base = self.style.leading - self.style.fontSize
        if self.style.alignment:
            self.canv.drawRightString(self.width, base, self.text)
        else:
            self.canv.drawString(0.0, base, self.text)


def _content(cell: _Cell, its_style: Any, width: float) -> Any:
    """The cell's text within a width, pt."""
    if all(isinstance(child, str) for child in cell.element.children):
        text = " ".join(printable(cell.element.text()).split())
        if stringWidth(text, its_style.fontName, its_style.fontSize) <= width:
            return _OneLine(text, its_style)
        lines = _lines(text, its_style, width)
        return Paragraph("<br/>".join(map(escaped, lines)), its_style)
    return Paragraph(markup(cell.element), its_style)


def _lines(text: str, its_style: Any, width: float) -> list[str]:
    """The text in lines of a width, pt, broken at blanks, and after separators where a word alone is too long."""
    lines = [""]
    for word in text.split():
        pieces = [word]
        if stringWidth(word, its_style.fontName, its_style.fontSize) > width:
            pieces = _PIECES.findall(word)
        for n, piece in enumerate(pieces):
            joint = " " if n == 0 and lines[-1] else ""
            longer = lines[-1] + joint + piece
            if lines[-1] and stringWidth(longer, its_style.fontName, its_style.fontSize) > width:
                lines.append(piece)
            else:
                lines[-1] = longer
    return lines


def _style(cell: _Cell, row: Element, scale: float = 1.0) -> Any:
    right = "n" in cell.element.classes
    if cell.head:
        return style(scale * _HEAD_SIZE, "muted", bold=True, right=right)
    if "hash" in cell.element.classes:
        return style(_HASH_SIZE, "muted")
    bold = "strong" in cell.element.classes or "group" in row.classes
    return style(scale * _SIZE, "muted" if "hidden-value" in row.classes else "ink", bold=bold, right=right)


def _narrowest(rows: Sequence[Sequence[_Cell]], heads: int, columns: int, padding: float) -> list[float]:
    """Width of every column for its longest text in one line, with its heading broken between words; pt."""
    least, _ = _needs(rows, columns, 1.0, padding)
    _, most = _needs(rows[heads:], columns, 1.0, padding)
    return [max(pair) for pair in zip(least, most, strict=True)]


def _fitted(rows: Sequence[Sequence[_Cell]], columns: int, width: float, padding: float) -> tuple[float, list[float]]:
    """The largest scale of the type at which no word and no number has to be broken, and the columns' widths, pt."""
    for scale in _SCALES:
        least, most = _needs(rows, columns, scale, padding)
        if sum(least) <= width:
            break
    else:
        return scale, [need * width / sum(least) for need in least]
    room = width - sum(least)
    wanted = [m - n for m, n in zip(most, least, strict=True)]
    if sum(wanted) <= room:
        spare = min((room - sum(wanted)) / columns, _SPARE)
        return scale, [m + spare for m in most]
    return scale, [n + room * w / sum(wanted) for n, w in zip(least, wanted, strict=True)]


def _needs(
    rows: Sequence[Sequence[_Cell]], columns: int, scale: float, padding: float
) -> tuple[list[float], list[float]]:
    """Width of every column for its longest word or number, and for its longest text in one line; pt."""
    least, most = [0.0] * columns, [0.0] * columns
    for cell in (cell for cells in rows for cell in cells if cell.span == 1):
        its_style = _style(cell, _NO_ROW, scale)
        font = its_style.fontName, its_style.fontSize
        lines = [" ".join(line.split()) for line in printable(cell.element.text()).split("\v")]
        whole = max(stringWidth(line, *font) for line in lines)
        word = max((stringWidth(word, *font) for line in lines for word in line.split()), default=0.0)
        # A number and its standard error stay in one line.
        together = ("n" in cell.element.classes and not cell.head) or "hash" in cell.element.classes
        need = whole if together else min(word, _LONGEST_WORD)
        least[cell.column] = max(least[cell.column], need + 2.0 * padding + 1.0)
        most[cell.column] = max(most[cell.column], whole + 2.0 * padding + 1.0)
    return least, most
