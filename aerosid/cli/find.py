"""Command `find`: the manoeuvres in recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aerosid.cli.options import ChannelsOption, console, out_folder
from aerosid.cli.output import headed, tell


def find_command(
    log: Annotated[
        str,
        typer.Argument(metavar="LOG", help="A recording, or a span of it as LOG@FROM:TO in s.", show_default=False),
    ],
    channels: ChannelsOption = None,
    aircraft: Annotated[
        str | None,
        typer.Option(
            "--aircraft",
            metavar="FILE",
            help="Expected standard errors for this aircraft's coefficients; default per unit inertia.",
            show_default=False,
        ),
    ] = None,
    kinds: Annotated[
        str | None,
        typer.Option("--kinds", metavar="KIND,...", help="Only these kinds, as in trim,phugoid.", show_default=False),
    ] = None,
    rejected: Annotated[
        bool, typer.Option("--rejected", help="Also list dynamic parts that are not manoeuvres.")
    ] = False,
    out: Annotated[
        Path | None,
        out_folder(
            "Write cuts with their maps, segments.csv, manoeuvres.json and a page with a picture of each.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Finds the manoeuvres in a recording, with flight condition and expected standard errors of the derivatives."""
    from dataclasses import replace

    from aerosid.aircraft import load_aircraft
    from aerosid.aircraft.loading import with_mass
    from aerosid.errors import UsageError
    from aerosid.logs.spans import files_given, read_span
    from aerosid.manoeuvres import KINDS, find_manoeuvres
    from aerosid.reporting.manoeuvres import print_segmentation, segmentation_json, write_segmentation

    wanted = [word.strip() for word in kinds.split(",")] if kinds else list(KINDS)
    for word in wanted:
        if word not in KINDS:
            raise UsageError(f"--kinds holds {word!r}; give one or more of {', '.join(KINDS)}.")
    declared = load_aircraft(aircraft) if aircraft else None
    recording = read_span(log, channels, across_holes=True)
    if declared is not None:
        recording = with_mass(recording, declared)
    found = find_manoeuvres(recording, declared)
    found = replace(found, manoeuvres=tuple(entry for entry in found if entry.kind in wanted))
    output = console()
    print_segmentation(found, recording, output, rejected)
    if out is not None:
        files = write_segmentation(found, recording, out, [*files_given([log]), aircraft, channels])
        output.print(f"Written: {len(files)} files, {files[2]} first.", soft_wrap=True)
    tell(lambda: headed("find", segmentation_json(found, recording)))
