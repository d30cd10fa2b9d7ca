"""Table of a recording's manoeuvres for the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from aerosid.logs.flight_log import FlightLog
from aerosid.manoeuvres import FlightSegmentation
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.manoeuvres.wording import (
    KIND_WORDS,
    air_words,
    condition_words,
    moved_words,
    surface_words,
    worth_words,
)

__all__ = ["print_segmentation"]


def print_segmentation(segmentation: FlightSegmentation, log: FlightLog, console: Console, rejected: bool) -> None:
    """Prints the manoeuvres of a recording and, where wanted, the stretches rejected as manoeuvres.

    Parameters
    ----------
    segmentation : FlightSegmentation
    log : FlightLog
        The recording that was searched.
    console : Console
        Console to print on.
    rejected : bool
        Whether active stretches that are not manoeuvres are also listed, each with its reason.
    """
    table = Table(title=f"{log.path or log.name}", title_justify="left")
    for heading in ("from [s]", "to [s]"):
        table.add_column(heading, justify="right", no_wrap=True)
    for heading in ("kind", "moved", "condition", "air", "expected standard errors"):
        table.add_column(heading)
    for manoeuvre in segmentation:
        table.add_row(
            f"{manoeuvre.start:.1f}",
            f"{manoeuvre.stop:.1f}",
            KIND_WORDS[manoeuvre.kind],
            "" if manoeuvre.is_condition else moved_words(manoeuvre),
            condition_words(manoeuvre),
            air_words(manoeuvre.turbulence),
            worth_words(manoeuvre.expected),
        )
    console.print(table)
    console.print(summary(segmentation), soft_wrap=True)
    if not rejected or not segmentation.rejected:
        return
    why = Table(title="Dynamic, but no manoeuvre", title_justify="left")
    for heading in ("from [s]", "to [s]"):
        why.add_column(heading, justify="right")
    why.add_column("moved")
    why.add_column("reason")
    for entry in segmentation.rejected:
        why.add_row(f"{entry.start:.1f}", f"{entry.stop:.1f}", surface_words(entry.surface), entry.reason)
    console.print(why)


def summary(segmentation: FlightSegmentation) -> str:
    """One sentence on the manoeuvres and the flight conditions, or on why no search was possible."""
    if segmentation.lacking:
        names = " and ".join(f"{name} ({CHANNELS[name].name})" for name in segmentation.lacking)
        return f"No manoeuvres were searched for: the recording holds no {names}; map it in a channel map."
    trims = sum(entry.kind == "trim" for entry in segmentation)
    turns = sum(entry.kind in ("turn", "steady_turn") for entry in segmentation)
    flown = ", ".join(f"{first:.6g} to {last:.6g} s" for first, last in segmentation.airborne[:4]) or "never"
    more = " and more" if len(segmentation.airborne) > 4 else ""
    rejected = _counted(len(segmentation.rejected), "stretch", "stretches")
    return (
        f"{_counted(len(segmentation.dynamic), 'manoeuvre')}, {_counted(trims, 'trim point')} and "
        f"{_counted(turns, 'turn')} in {segmentation.start:.6g} to {segmentation.stop:.6g} s; "
        f"in the air {flown}{more}; dynamic, but no manoeuvre: {rejected}."
    )


def _counted(number: int, one: str, several: str = "") -> str:
    return f"{number} {one if number == 1 else several or one + 's'}"
