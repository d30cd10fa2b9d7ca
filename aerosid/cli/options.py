"""Options that several verbs of the command line share, and where their tables go."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

# typer resolves annotations at run time, where Optional is what every supported version understands.
ChannelsOption = Annotated[
    Path | None,
    typer.Option("--channels", metavar="FILE", help="Channel map for all logs of the call.", show_default=False),
]
LogsArgument = Annotated[
    list[str],
    typer.Argument(
        metavar="LOG...",
        help="Recorded manoeuvres, spans of recordings as LOG@FROM:TO in s, or segment files (TOML or CSV).",
        show_default=False,
    ),
]
FromOption = Annotated[
    float | None,
    typer.Option("--from", metavar="S", help="Begin, in the log's own time.", show_default=False),
]
ToOption = Annotated[
    float | None, typer.Option("--to", metavar="S", help="End, in the log's own time.", show_default=False)
]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", help="Processes; by default one for each core.", show_default=False)
]
SchedulerOption = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Dask scheduler, as tcp://host:8786.", show_default=False),
]


def console() -> Console:
    """Where tables go: the terminal's width, or wide enough for every table where the output is a file or a pipe."""
    from rich.console import Console

    from aerosid.cli.output import mode

    class PipeConsole(Console):
        """A console that leaves a broken pipe to `main`; rich would end the process with exit code 1."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

    return PipeConsole(highlight=False, markup=False, width=None if sys.stdout.isatty() else 140, quiet=mode().silent)
