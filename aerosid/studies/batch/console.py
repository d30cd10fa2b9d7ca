"""A batch on the terminal: the logs that failed with the reason, then the derivatives."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from aerosid.studies.batch.run import Batch
from aerosid.studies.batch.table_texts import cells, headings, structure_words

if TYPE_CHECKING:
    from rich.console import Console


def print_batch(batch: Batch, console: Console) -> None:
    """Print the table of derivatives, the verdicts, and the logs that could not be used."""
    from rich.table import Table

    table = Table(title=f"{batch.aircraft.name}, {len(batch.rows)} manoeuvres", title_justify="left")
    rows = [(f"{row.coefficient} {row.term}", *cells(row)) for row in batch.table]
    # Where there is room, headings are broken into lines but numbers are not.
    least = [max(map(len, (*heading.split(), *column))) for heading, *column in zip(headings(), *rows, strict=True)]
    roomy = sum(least) + 3 * len(least) + 1 <= console.width
    for heading, width in zip(headings(), least, strict=True):
        table.add_column(heading, justify="right" if table.columns else "left", min_width=width if roomy else None)
    for row in rows:
        table.add_row(*row)
    console.print(table)
    for structure, number in batch.structures.items():
        console.print(f"structure {number}: {structure_words(structure)}", soft_wrap=True)
    verdicts = Counter(row["verdict"].replace("_", " ") for row in batch.rows.values())
    console.print(", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common()))
    if batch.failures:
        console.print(f"{len(batch.failures)} of {len(batch.logs)} logs could not be used:")
        for name, reason in batch.failures.items():
            console.print(f"  {name}: {reason}", soft_wrap=True)
