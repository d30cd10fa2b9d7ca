"""The cross-check on a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from aerosid.cross_check import views
from aerosid.cross_check.run import CrossCheck

if TYPE_CHECKING:
    from rich.console import Console


def print_cross_check(result: CrossCheck, console: Console) -> None:
    """Print a line for each aircraft, and what was not named."""
    from rich.table import Table

    view = views.overview(result.aircraft)
    table = Table(title=view.title, title_justify="left")
    for place, heading in enumerate(view.header):
        table.add_column(heading, justify="left" if place == 0 else "right")
    for row in view.rows:
        table.add_row(*row)
    console.print(table)
    console.print(views.not_named(result.effects))
