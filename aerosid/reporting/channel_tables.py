"""Tables of a recording's streams, channels and map, for the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from aerosid.logs.channel_listing import Listing
from aerosid.notation import number

_HOLES_NAMED = 3
"""Display: gaps of a recording named in one sentence."""

_MOST_CHANNELS = 400
"""Display: rows on a screen; the remaining ones are counted, and listed in full with --json."""


def print_channels(listing: Listing, channel_map: str, path: str, console: Console) -> None:
    """Prints a recording's streams, its channels, its problems, and a proposed map.

    Parameters
    ----------
    listing : Listing
        From `list_channels`.
    channel_map : str
        The map, TOML.
    path : str
        The file, for the title.
    console : Console
        Console to print on.
    """
    print_streams(listing, path, console)
    table = Table(title="Channels", title_justify="left")
    for heading in ("channel", "unit"):
        table.add_column(heading, overflow="fold")
    for heading in ("samples", "missing", "minimum", "maximum", "repeats"):
        table.add_column(heading, justify="right")
    table.add_column("course")
    for channel in listing.channels[:_MOST_CHANNELS]:
        table.add_row(
            channel.name,
            channel.unit,
            str(channel.samples),
            str(channel.missing or ""),
            "" if channel.minimum is None else number(channel.minimum, 5),
            "" if channel.maximum is None else number(channel.maximum, 5),
            f"{100.0 * channel.repeats:.0f} %" if channel.repeats else "",
            channel.sparkline,
        )
    console.print(table)
    if len(listing.channels) > _MOST_CHANNELS:
        console.print(f"... {len(listing.channels)} channels in all; --json lists every one.")
    print_notes(listing, console)
    console.print("\nProposed channel map:\n")
    console.print(channel_map, soft_wrap=True)


def print_streams(listing: Listing, path: str, console: Console) -> None:
    """Prints first and last time, rate and gaps of each stream.

    Parameters
    ----------
    listing : Listing
        From `list_channels`.
    path : str
        The file, for the title.
    console : Console
        Console to print on.
    """
    table = Table(title=f"{path} ({listing.format})", title_justify="left")
    for heading in ("stream", "stamps"):
        table.add_column(heading, overflow="fold")
    for heading in ("samples", "rate [Hz]", "first [s]", "last [s]", "gaps"):
        table.add_column(heading, justify="right")
    for stream in listing.streams:
        named = ", ".join(f"{length:.3g} s at {at:.6g}" for at, length in stream.holes[:_HOLES_NAMED])
        more = f" ... {len(stream.holes)} in all" if len(stream.holes) > _HOLES_NAMED else ""
        table.add_row(
            stream.label or "(table)",
            stream.clock or "none",
            str(stream.samples),
            "" if stream.rate is None else f"{stream.rate:.4g}",
            "" if stream.first is None else f"{stream.first:.6f}",
            "" if stream.last is None else f"{stream.last:.6f}",
            named + more,
        )
    console.print(table)


def print_notes(listing: Listing, console: Console) -> None:
    """Prints lost data, irregularities and refused data.

    Parameters
    ----------
    listing : Listing
        From `list_channels`.
    console : Console
        Console to print on.
    """
    for note in listing.notes:
        console.print(f"note: {note}", soft_wrap=True)
