"""Options shared by several verbs of the command line, and the consoles on which tables are printed."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

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


def _writable_folder(directory: Path | None) -> Path | None:
    """The folder; refused during parsing where it cannot be written, before any log is opened."""
    from aerosid.file_set import require_writable

    if directory is not None:
        require_writable(directory)
    return directory


def _writable_file(file: Path | None) -> Path | None:
    """The file; refused during parsing where its folder cannot be written or a folder of this name exists."""
    from aerosid.file_set import require_writable_file

    if file is not None:
        require_writable_file(file)
    return file


def out_folder(help: str = "Output folder.", *, show_default: bool = True) -> typer.models.OptionInfo:  # noqa: A002
    """The option --out of a verb that writes into a folder."""
    info: typer.models.OptionInfo = typer.Option(
        "--out", metavar="DIR", help=help, show_default=show_default, callback=_writable_folder
    )
    return info


def out_file(help: str, metavar: str = "FILE") -> typer.models.OptionInfo:  # noqa: A002
    """The option --out of a verb that writes a file."""
    info: typer.models.OptionInfo = typer.Option(
        "--out", metavar=metavar, help=help, show_default=False, callback=_writable_file
    )
    return info


def console() -> Console:
    """A console of the terminal's width, or wide enough for every table where the output is a file or a pipe."""
    from rich.console import Console

    from aerosid.cli.output import mode, read_no_more

    class PipeConsole(Console):
        """A console that ignores a closed pipe, so that the files are still written; rich would end the process."""

        def on_broken_pipe(self) -> None:
            read_no_more()

    return PipeConsole(highlight=False, markup=False, width=None if sys.stdout.isatty() else 180, quiet=mode().silent)
