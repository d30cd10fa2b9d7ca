"""Command `batch`: close-loop on many logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aerosid.cli.options import ChannelsOption, SchedulerOption, WorkersOption, console, out_folder
from aerosid.cli.output import written


def batch_command(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="DIR|LIST|LOG",
            help="A folder of logs, a text file with one path or LOG@FROM:TO a line, a segment file, or a log or span.",
            show_default=False,
        ),
    ],
    aircraft: Annotated[
        str, typer.Option("--aircraft", metavar="FILE", help="Aircraft file, or a bundled name.", show_default=False)
    ],
    channels: ChannelsOption = None,
    find: Annotated[bool, typer.Option("--find", help="Use the elevator manoeuvres found in each log.")] = False,
    catalogue: Annotated[str, typer.Option(help="Candidate effects: all, or terms (aerodynamic terms only).")] = "all",
    against: Annotated[
        str | None,
        typer.Option(
            help="Abscissa of the derivative plots: alpha, mach, V, h or mass; default mach where it varies.",
            show_default=False,
        ),
    ] = None,
    reports: Annotated[bool, typer.Option(help="Write a report for each log.")] = True,
    seed: Annotated[int, typer.Option(help="Seed of every random draw.", min=0)] = 0,
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 1 where a log could not be used.")] = False,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    out: Annotated[Path, out_folder()] = Path("reports/batch"),
) -> int:
    """Runs close-loop on every log of a folder, and tabulates the derivatives over the manoeuvres."""
    from aerosid.aircraft import load_aircraft
    from aerosid.cli.progress_bar import progress_bar
    from aerosid.errors import UsageError
    from aerosid.file_set import require_apart
    from aerosid.logs.spans import parse_span
    from aerosid.loop.settings import LoopSettings
    from aerosid.studies.batch import find_logs, run_batch, write_batch
    from aerosid.studies.batch.console import print_batch
    from aerosid.studies.batch.logs import find_manoeuvres_of
    from aerosid.studies.batch.one_log import CONDITION
    from aerosid.studies.batch.writing import batch_json, files_of
    from aerosid.studies.workers import Workers

    if catalogue not in ("all", "terms"):
        raise UsageError(f"--catalogue is {catalogue!r}; give all or terms.")
    if against is not None and against not in CONDITION:
        raise UsageError(f"--against is {against!r}; give one of {', '.join(CONDITION)}.")
    dealt = Workers(workers, scheduler)
    declared = load_aircraft(aircraft)
    logs = find_logs(source, channels, but_in=out)
    inputs = [source, aircraft, channels, *(parse_span(log.path).path for log in logs)]
    if find:
        logs = find_manoeuvres_of(logs, channels)
    require_apart([out / name for name in files_of([log.name for log in logs], reports)], inputs)
    settings = LoopSettings(catalogue="terms" if catalogue == "terms" else "all", seed=seed)
    with progress_bar("logs") as (announce, tick):
        batch = run_batch(
            logs,
            declared,
            out,
            channels=channels,
            settings=settings,
            reports=reports,
            workers=dealt,
            announce=announce,
            tick=tick,
        )
    files = write_batch(batch, out, against)
    output = console()
    print_batch(batch, output)
    written("batch", files, lambda: batch_json(batch))
    return int(strict and bool(batch.failures))
