"""A batch on the terminal: what failed and why, then the derivatives."""

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
    for place, heading in enumerate(headings()):
        table.add_column(heading, justify="left" if place == 0 else "right")
    for row in batch.table:
        table.add_row(f"{row.coefficient} {row.term}", *cells(row))
    console.print(table)
    for structure, number in batch.structures.items():
        console.print(f"structure {number}: {structure_words(structure)}", soft_wrap=True)
    verdicts = Counter(row["verdict"].replace("_", " ") for row in batch.rows.values())
    console.print(", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common()))
    if batch.failures:
        console.print(f"{len(batch.failures)} of {len(batch.logs)} logs could not be used:")
        for name, reason in batch.failures.items():
            console.print(f"  {name}: {reason}", soft_wrap=True)
