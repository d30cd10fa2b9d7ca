"""Command `replay`: recursive identification along a recorded flight, with a live table and a page."""

from __future__ import annotations

import time as clock
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from aerosid.cli.options import ChannelsOption, console, out_folder
from aerosid.cli.output import headed, written

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from aerosid.model_error.paper_chain.in_flight import Frame

PAGE = "replay.html"


def replay_command(
    log: Annotated[
        str, typer.Argument(metavar="LOG", help="A recorded manoeuvre, or LOG@FROM:TO.", show_default=False)
    ],
    aircraft: Annotated[
        str, typer.Option("--aircraft", metavar="FILE", help="Aircraft file, or a bundled name.", show_default=False)
    ],
    channels: ChannelsOption = None,
    out: Annotated[
        Path | None,
        out_folder("Output folder; default reports/<log name>/.", show_default=False),
    ] = None,
    step: Annotated[float, typer.Option(help="Flight time between frames, s.")] = 0.25,
    speed: Annotated[
        float, typer.Option(help="Replay speed on a terminal, times real time; 0: as fast as computed.")
    ] = 4.0,
) -> None:
    """Replays a flight as identified on board by method iebmee: derivatives, d(t) and the identified terms."""
    from aerosid.aircraft import load_aircraft
    from aerosid.cli.close_loop import read_roles
    from aerosid.errors import UsageError
    from aerosid.file_set import require_apart, require_writable, text, write_files
    from aerosid.logs.spans import files_given
    from aerosid.loop.identification import replayed
    from aerosid.reporting.replay_page import render_replay

    if not 0.0 < step < float("inf") or not 0.0 <= speed < float("inf"):
        raise UsageError(f"--step is {step:g} and --speed {speed:g}; give a step above zero and a speed not below it.")
    declared = load_aircraft(aircraft)
    flight = read_roles([log], [], channels).identification[0]
    directory = out or Path("reports") / flight.name
    require_apart([directory / PAGE], [*files_given([log]), aircraft, channels])
    require_writable(directory)
    output = console()
    frames = list(_watched(replayed(flight, declared, step), output, speed))
    files = write_files(
        directory, {PAGE: text(render_replay(frames, flight.name, declared.name, declared.axes.coefficients))}
    )
    output.print(replay_table(frames[-1]))
    for name in frames[-1].names:
        output.print(f"{name.coefficient} {name.term} identified at {name.time:.2f} s", markup=False)
    if not frames[-1].names:
        output.print("No term was identified.")
    written("replay", files, lambda: headed("replay", {"files": list(map(str, files)), "last": asdict(frames[-1])}))


def _watched(frames: Iterable[Frame], output: Console, speed: float) -> Iterator[Frame]:
    """The frames, shown in a table that is updated with each where the output is a terminal."""
    if not output.is_terminal:
        yield from frames
        return
    from rich.live import Live

    before: float | None = None
    with Live(console=output, transient=True) as live:
        for frame in frames:
            live.update(replay_table(frame))
            if speed > 0.0 and before is not None:
                clock.sleep((frame.time - before) / speed)
            before = frame.time
            yield frame


def replay_table(frame: Frame) -> Table:
    """A frame as a table: derivatives on the left, the strongest candidates on the right."""
    from rich.table import Table
    from rich.text import Text

    named = ", ".join(f"{name.coefficient} {name.term}" for name in frame.names) or "none yet"
    table = Table(title=Text(f"{frame.time:8.2f} s   identified: {named}"), title_justify="left")
    words = ("derivative", "candidate", "reason for rejection")
    for heading in ("derivative", "value", "standard error", "candidate", "partial correlation", "p", words[-1]):
        table.add_column(heading, justify="left" if heading in words else "right")
    for n in range(max(len(frame.derivatives), len(frame.candidates))):
        left, right = [""] * 3, [""] * 4
        if n < len(frame.derivatives):
            row = frame.derivatives[n]
            left = [f"{row.coefficient} {row.term}", f"{row.value:.4g}", f"{row.deviation:.2g}"]
        if n < len(frame.candidates):
            candidate = frame.candidates[n]
            right = [
                candidate.label,
                f"{candidate.correlation:.2f}",
                f"{candidate.p_value:.2g}",
                candidate.reason,
            ]
        table.add_row(*(Text(cell) for cell in (*left, *right)))
    return table
