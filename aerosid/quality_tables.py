"""A log's quality, printed for a person."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from aerosid.quality import LogQuality


def print_quality(quality: LogQuality, console: Console) -> None:
    """Prints one log's sampling, its channels, and what to do about what is wrong.

    Parameters
    ----------
    quality : LogQuality
        From `check_log`.
    console : Console
        Where to.
    """
    table = Table(title=f"{quality.path or quality.name}", title_justify="left")
    table.add_column("channel")
    table.add_column("unit")
    for heading in ("minimum", "maximum", "missing", "spikes", "stuck [s]", "resolution", "noise", "variation/noise"):
        table.add_column(heading, justify="right")
    for channel in quality.channels:
        table.add_row(
            channel.name,
            channel.unit,
            f"{channel.minimum:.4g}",
            f"{channel.maximum:.4g}",
            f"{100.0 * channel.missing:.3g} %" if channel.missing else "",
            str(channel.spikes or ""),
            f"{channel.stuck:.3g}",
            f"{channel.quantum:.2g}" if channel.quantum else "",
            f"{channel.noise:.2g}",
            f"{channel.excitation:.3g}",
        )
    console.print(table)
    console.print(
        f"{quality.samples} samples from {quality.start:g} to {quality.stop:g} s, every {quality.interval:.4g} s."
    )
    for note in quality.notes:
        console.print(f"read: {note}", soft_wrap=True)
    for finding in quality.findings:
        console.print(f"{'needed' if finding.blocking else 'note'}: {finding}", soft_wrap=True)
    verdict = "can be used" if quality.usable else "cannot be used"
    console.print(f"The log {verdict} by close-loop.\n")
