"""A log's quality and whether its instruments agree, printed for a person."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from aerosid.compatibility import InstrumentFinding, KinematicConsistency
from aerosid.logs.quality import LogQuality


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


def print_kinematics(agreement: KinematicConsistency, console: Console) -> None:
    """Prints whether the instruments agree with each other, and what is wrong with them.

    Parameters
    ----------
    agreement : KinematicConsistency
        From `check_kinematics`.
    console : Console
        Where to.
    """
    console.print(f"Do the instruments agree with each other? {agreement.verdict.value}", soft_wrap=True)
    for contradiction in agreement.contradictions:
        console.print(contradiction.sentence, soft_wrap=True)
    if agreement.findings:
        console.print(_findings(agreement))
    for gust in agreement.air:
        console.print(f"The air moves along body {gust.axis}: {gust.sigma:.2g} m/s over {gust.length:.3g} m.")
    if not agreement.channels:
        return
    table = Table(title="measured - integrated from a_x, a_z, q (root-mean-square)", title_justify="left")
    table.add_column("channel")
    table.add_column("unit")
    for heading in ("as recorded", "corrected", "noise"):
        table.add_column(heading, justify="right")
    table.add_column("what is left")
    for row in agreement.channels:
        left = "white" if row.white else "coloured"
        table.add_row(row.channel, row.unit, f"{row.before:.3g}", f"{row.after:.3g}", f"{row.noise:.2g}", left)
    console.print(table)
    for note in agreement.notes:
        console.print(f"note: {note}", soft_wrap=True)


def _findings(agreement: KinematicConsistency) -> Table:
    """The findings, each with what these flights cannot tell from it."""
    table = Table(title="Instruments, from kinematics alone", title_justify="left")
    table.add_column("what is wrong")
    table.add_column("where")
    for heading in ("value", "deviation", "unit", "p"):
        table.add_column(heading, justify="right")
    groups = {group[0]: group[1:] for group in agreement.inseparable}
    for finding in agreement.findings:
        _add_finding(table, finding, "")
        for other in groups.get(finding, ()):
            _add_finding(table, other, "  or ")
    return table


def _add_finding(table: Table, finding: InstrumentFinding, before: str) -> None:
    where = f"{finding.where} along {finding.axis}" if finding.axis else finding.where
    numbers = (f"{finding.value:.4g}", f"{finding.std_error:.2g}", finding.unit, f"{finding.p_value:.1g}")
    table.add_row(f"{before}{finding.kind.replace('_', ' ')}", where, *numbers)
