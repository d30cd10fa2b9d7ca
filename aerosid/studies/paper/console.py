"""The reproduction on a terminal: a progress bar while it runs, abbreviated tables at the end."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from aerosid.studies.paper import table1, table2, table3, table4
from aerosid.studies.paper.run import Reproduction, reproduce, steps
from aerosid.studies.paper.view import TableView

if TYPE_CHECKING:
    from rich.console import Console


def reproduce_with_progress(seeds: int) -> Reproduction:
    """The reproduction, with a progress bar on the terminal; silent where stderr is not a terminal."""
    if not sys.stderr.isatty():
        return reproduce(seeds)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reproducing the paper", total=steps(seeds))
        return reproduce(seeds, lambda: bar.update(task, advance=1))


def print_reproduction(result: Reproduction, console: Console) -> None:
    """Print tables 1 to 4 without their notes."""
    for view in (
        table1.view(result.table1), table2.view(result.table2), table3.view(result.table3), table4.view(result.table4),
    ):  # fmt: skip
        print_table(view, console)


def print_table(view: TableView, console: Console) -> None:
    """Print one table without its notes, numbers right-aligned."""
    from rich.table import Table

    table = Table(title=view.title, title_justify="left")
    for place, heading in enumerate(view.header):
        table.add_column(heading, justify="left" if place == 0 else "right")
    for row in view.rows:
        table.add_row(*row)
    console.print(table)
