"""Tables of a log's quality and of its data compatibility, for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from aerosid.compatibility import Agreement, InstrumentFinding, KinematicConsistency
from aerosid.logs.quality import Finding, LogQuality, Problem
from aerosid.manoeuvres import FlightSegmentation
from aerosid.notation import MISSING, finite, listed, number, p_value, plain, with_deviation
from aerosid.reporting.manoeuvres.wording import KIND_WORDS
from aerosid.reporting.result_json import portable
from aerosid.reporting.worse_channels import note_on_worse_channels

_DIGITS = 7
"""Display: significant digits in JSON, as in a native log."""


def print_quality(quality: LogQuality, console: Console) -> None:
    """Prints one log's sampling, its channels, and its problems with remedies; the verdict is `closing_sentence`.

    Parameters
    ----------
    quality : LogQuality
        From `check_log`.
    console : Console
        Console to print on.
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
            number(channel.minimum, 4),
            number(channel.maximum, 4),
            f"{number(100.0 * channel.missing)} %" if channel.missing else "",
            str(channel.spikes or ""),
            number(channel.stuck),
            number(channel.quantum, 2) if channel.quantum else "",
            MISSING if channel.doubt else number(channel.noise, 2),
            MISSING if channel.doubt else number(channel.excitation),
        )
    console.print(table)
    span = f"from {plain(quality.start)} to {plain(quality.stop)} s"
    console.print(f"{quality.samples} samples {span}, every {plain(quality.interval, 4)} s.")
    for note in quality.notes:
        console.print(f"read: {note}", soft_wrap=True)
    for finding in _put_together(quality.findings):
        console.print(f"{'needed' if finding.blocking else 'note'}: {finding}", soft_wrap=True)


def _put_together(findings: Sequence[Finding]) -> list[Finding]:
    """The findings, with one for all channels whose noise cannot be estimated for the same reason."""
    doubted: dict[str, list[str]] = {}
    for finding in findings:
        if finding.problem is Problem.NOISE_UNKNOWN:
            doubted.setdefault(finding.detail, []).append(finding.subject)
    others = [finding for finding in findings if finding.problem is not Problem.NOISE_UNKNOWN]
    return [*others, *(Finding(Problem.NOISE_UNKNOWN, listed(names), detail) for detail, names in doubted.items())]


def print_kinematics(agreement: KinematicConsistency, console: Console) -> None:
    """Prints the data compatibility check and the instrument errors that it identifies.

    Parameters
    ----------
    agreement : KinematicConsistency
        From `check_kinematics`.
    console : Console
        Console to print on.
    """
    console.print(f"Data compatibility: {agreement.verdict.value}", soft_wrap=True)
    for contradiction in agreement.contradictions:
        console.print(contradiction.sentence, soft_wrap=True)
    if agreement.findings:
        console.print(_findings(agreement))
    for gust in agreement.air:
        console.print(
            f"Turbulence: sigma_{gust.axis} = {number(gust.sigma, 2)} m/s, scale length {number(gust.length, 2)} m."
        )
    if not agreement.channels:
        return
    table = Table(
        title="measured minus reconstructed from accelerations and rates (root-mean-square)", title_justify="left"
    )
    table.add_column("channel")
    table.add_column("unit")
    for heading in ("as recorded", "corrected", "noise"):
        table.add_column(heading, justify="right")
    table.add_column("residual")
    for row in agreement.channels:
        left = "white" if row.white else "coloured"
        table.add_row(row.channel, row.unit, number(row.before), number(row.after), number(row.noise, 2), left)
    console.print(table)
    if worse := note_on_worse_channels(agreement):
        console.print(f"note: {worse}", soft_wrap=True)
    for note in agreement.notes:
        console.print(f"note: {note}", soft_wrap=True)


def _findings(agreement: KinematicConsistency) -> Table:
    """The findings, each with the errors that these flights cannot distinguish from it."""
    table = Table(title="Instrument errors from kinematics alone", title_justify="left")
    table.add_column("instrument error")
    table.add_column("where")
    for heading in ("value ± standard error", "unit", "p-value"):
        table.add_column(heading, justify="right")
    groups = {group[0]: group[1:] for group in agreement.inseparable}
    for finding in agreement.findings:
        _add_finding(table, finding, "")
        for other in groups.get(finding, ()):
            _add_finding(table, other, "  or ")
    return table


def _add_finding(table: Table, finding: InstrumentFinding, before: str) -> None:
    where = f"{finding.where} along {finding.axis}" if finding.axis else finding.where
    numbers = (with_deviation(finding.value, finding.std_error), finding.unit, p_value(finding.p_value))
    table.add_row(f"{before}{finding.kind.replace('_', ' ')}", where, *numbers)


def closing_sentence(
    quality: LogQuality,
    agreement: KinematicConsistency | None,
    whole_flight: str | None,
) -> tuple[str, bool]:
    """The verdict on a log in one sentence, and whether close-loop can use it.

    Parameters
    ----------
    quality : LogQuality
    agreement : KinematicConsistency or None
        Result of the data compatibility check; None where that was not or could not be made.
    whole_flight : str or None
        Advice for a whole flight.
    """
    lacking = [str(finding) for finding in quality.findings if finding.blocking]
    if whole_flight is not None:
        return f"The log cannot be used by close-loop as it is. {whole_flight}", False
    if lacking:
        constant = all(f.problem is Problem.CONTROL_CONSTANT for f in quality.findings if f.blocking)
        still = " It can be predicted with --validate or --hold-out." if constant else ""
        return f"The log cannot be used by close-loop: {' '.join(lacking)}{still}", False
    if agreement is not None and agreement.verdict is Agreement.INCONSISTENT:
        what = "correct the channels named here in the channel map or the log, or choose another span"
        return f"The log cannot be used by close-loop: its channels contradict each other; {what}.", False
    if resting := [str(f) for f in quality.findings if f.problem is Problem.CONTROL_AT_REST]:
        little = "The log can be read, but close-loop can identify little or nothing from it"
        return f"{little}: {' '.join(resting)} It can be predicted with --validate or --hold-out.", True
    if agreement is not None and agreement.verdict is Agreement.CORRECTED:
        return "The log can be used by close-loop, which estimates the instrument errors given here as well.", True
    return "The log can be used by close-loop.", True


def dynamic_sentence(found: FlightSegmentation) -> str:
    """The dynamic stretches of a log, with the reason where one is not a manoeuvre."""
    parts = [f"{entry.start:.1f} to {entry.stop:.1f} s {KIND_WORDS[entry.kind]}" for entry in found.dynamic]
    parts += [f"{entry.start:.1f} to {entry.stop:.1f} s ({entry.reason})" for entry in found.rejected]
    return f"Dynamic: {', '.join(parts)}." if parts else ""


def quality_json(quality: LogQuality, agreement: KinematicConsistency | None) -> dict[str, Any]:
    """The JSON object of `check --json` for one log, SI."""
    return {
        "log": quality.name,
        "path": portable(quality.path),
        "samples": quality.samples,
        "start": round(quality.start, 6),
        "stop": round(quality.stop, 6),
        "interval": float(f"{quality.interval:.7g}"),
        "gaps": [[round(at, 6), round(length, 6)] for at, length in quality.gaps],
        "channels": [
            {
                "name": channel.name,
                "unit": channel.unit,
                "minimum": finite(channel.minimum, _DIGITS),
                "maximum": finite(channel.maximum, _DIGITS),
                "missing": finite(channel.missing, _DIGITS),
                "spikes": channel.spikes,
                "stuck": finite(channel.stuck, _DIGITS),
                "resolution": finite(channel.quantum, _DIGITS),
                "noise": finite(channel.noise, _DIGITS),
                "excitation": finite(channel.excitation, _DIGITS),
            }
            for channel in quality.channels
        ],
        "findings": [
            {"problem": finding.problem.name.lower(), "subject": finding.subject, "sentence": str(finding)}
            for finding in quality.findings
        ],
        "notes": list(quality.notes),
        "instruments": None if agreement is None else agreement.verdict.name.lower(),
    }
