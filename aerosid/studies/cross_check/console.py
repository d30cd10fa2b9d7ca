"""The cross-check on a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from aerosid.studies.cross_check import views
from aerosid.studies.cross_check.run import CrossCheck
from aerosid.studies.paper.console import print_table

if TYPE_CHECKING:
    from rich.console import Console


def print_cross_check(result: CrossCheck, console: Console) -> None:
    """Print a line for each aircraft, and the effects that were not identified."""
    print_table(views.overview(result.aircraft), console)
    if result.sideways:
        print_table(views.sideways_overview(result.sideways), console)
    console.print(views.not_named(result.effects))
