"""What a benchmark found, as sections of text and tables: one form for the terminal, Markdown and the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aerosid.reporting.figures.numbered import Figure


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Attributes
    ----------
    headings : tuple of str
        Of the columns.
    rows : tuple of tuple of str
    words : int
        So many columns from the left hold words; the rest are numbers, set to the right.
    caption : str
    """

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 0
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes
    ----------
    identity : str
        Of its place in the page.
    title : str
    parts : tuple of str, Table or Figure
        Paragraphs, tables and figures in their order; figures are on the page alone.
    """

    identity: str
    title: str
    parts: tuple[str | Table | Figure, ...]


def markdown(section: Section) -> str:
    """The section as Markdown."""
    texts = [f"## {section.title}"]
    for part in section.parts:
        if isinstance(part, Table):
            texts.append(_table(part))
        elif isinstance(part, str):
            texts.append(part)
    return "\n\n".join(texts) + "\n"


def _table(table: Table) -> str:
    marks = ["---" if n < table.words else "---:" for n in range(len(table.headings))]
    rows: Sequence[Sequence[str]] = (table.headings, marks, *table.rows)
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([f"{table.caption}\n", *lines] if table.caption else lines)
