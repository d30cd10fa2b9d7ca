"""Command `channels`: contents of a recording, and a channel map for it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aerosid.cli.options import console, out_file
from aerosid.cli.output import headed, tell


def channels_command(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A recording.", show_default=False)],
    out: Annotated[Path | None, out_file("File for the proposed map.")] = None,
    form: Annotated[
        str | None,
        typer.Option("--format", metavar="NAME", help="Format name, as in `aerosid formats`.", show_default=False),
    ] = None,
) -> None:
    """Lists the channels of a recording (unit, samples, rate, span, gaps, range) and proposes a channel map."""
    from aerosid.errors import UsageError
    from aerosid.file_set import require_apart, text, write_files
    from aerosid.logs.channel_listing import list_channels
    from aerosid.logs.formats import FORMATS, read_recording
    from aerosid.logs.map_proposal import propose_map
    from aerosid.reporting.channel_tables import print_channels

    if form is not None and form not in FORMATS:
        raise UsageError(f"--format is {form!r}, but one of {', '.join(FORMATS)} was expected; give one of them.")
    if out is not None:
        require_apart([out], [log])
    recording = read_recording(log, form)
    listing, proposal = list_channels(recording), propose_map(recording, str(log))
    if out is not None:
        write_files(out.parent, {out.name: text(proposal.text)})
    print_channels(listing, proposal.text, str(log), console())
    tell(lambda: headed("channels", {**listing.as_json(), "map": proposal.text}))
