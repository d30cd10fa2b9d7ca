"""Files of a segmentation: cuts as native CSV with maps, a segment file, manoeuvres.json, a page of strip charts."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from aerosid import __version__
from aerosid.file_set import Writer, require_apart, text, write_files
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.log_writing import channel_map_text, native_csv
from aerosid.manoeuvres import FlightSegmentation, FoundManoeuvre
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.manoeuvres.listing import segmentation_json
from aerosid.reporting.manoeuvres.pictures import manoeuvre_chart, overview_chart
from aerosid.reporting.manoeuvres.table import summary
from aerosid.reporting.manoeuvres.wording import (
    KIND_WORDS,
    air_words,
    condition_words,
    moved_words,
    surface_words,
    worth_words,
)
from aerosid.reporting.templating import page_environment, page_style

__all__ = ["cut_name", "write_segmentation"]

_TEMPLATES = Path(__file__).parent / "templates"
_DIGITS = 9
"""Display: digits of a cut's numbers: a time of an hour is resolved to a tenth of a millisecond."""


def cut_name(log: FlightLog, manoeuvre: FoundManoeuvre, names: Counter[str]) -> str:
    """`FLIGHT_3634_short_period`, numbered where two begin in the same second."""
    name = f"{log.name}_{manoeuvre.start:.0f}_{manoeuvre.kind}"
    names[name] += 1
    return name if names[name] == 1 else f"{name}_{names[name]}"


def write_segmentation(
    segmentation: FlightSegmentation, log: FlightLog, directory: Path, inputs: Iterable[str | Path | None] = ()
) -> tuple[Path, ...]:
    """The paths of the files written: cuts and maps of every motion, segments.csv, manoeuvres.json, manoeuvres.html.

    Parameters
    ----------
    inputs : iterable of str or Path or None
        Further files that were read for it, which like the log are not replaced.

    Raises
    ------
    UsageError
        Where the folder cannot be written, or a file would replace an input.
    """
    taken: Counter[str] = Counter()
    names = [cut_name(log, manoeuvre, taken) for manoeuvre in segmentation]
    cuts: dict[str, Writer] = {}
    for name, manoeuvre in zip(names, segmentation, strict=True):
        part = log.between(manoeuvre.cut_from, manoeuvre.cut_to)
        remark = (
            f"{KIND_WORDS[manoeuvre.kind]}, {manoeuvre.cut_from:.6f} to {manoeuvre.cut_to:.6f} s of {log.name} "
            f"(SHA-256 {log.sha256 or 'unknown'}), cut by aerosid {__version__}"
        )
        cuts[f"{name}.csv"] = text(native_csv(part, remark, _DIGITS))
        cuts[f"{name}.csv.channels.toml"] = text(channel_map_text(part, remark))
    files = {
        "manoeuvres.json": text(json.dumps(segmentation_json(segmentation, log), indent=2, allow_nan=False) + "\n"),
        "segments.csv": text(_segments(segmentation, log, names)),
        "manoeuvres.html": text(_page(segmentation, log, names)),
    }
    outputs = (*(directory / name for name in files), *(directory / "cuts" / name for name in cuts))
    require_apart(outputs, (log.path or None, *inputs))
    return (*write_files(directory, files), *write_files(directory / "cuts", cuts))


def _segments(segmentation: FlightSegmentation, log: FlightLog, names: list[str]) -> str:
    """A segment file of every motion, as read by check, close-loop and batch."""
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(["log", "from", "to", "role", "name"])
    path = str(Path(log.path).resolve()) if log.path else log.name
    for name, manoeuvre in zip(names, segmentation, strict=True):
        if not manoeuvre.is_condition:
            span = (f"{manoeuvre.cut_from:.6f}", f"{manoeuvre.cut_to:.6f}")
            writer.writerow([path, *span, "identification", name])
    return table.getvalue()


def _page(segmentation: FlightSegmentation, log: FlightLog, names: list[str]) -> str:
    book = FigureBook()
    overview = overview_chart(log, segmentation)
    whole = book.add(overview, "The whole recording; every motion is shaded.", "Whole recording") if overview else None
    rows = []
    for name, manoeuvre in zip(names, segmentation, strict=True):
        kind = KIND_WORDS[manoeuvre.kind]
        chart = manoeuvre_chart(log, manoeuvre)
        caption = f"{kind[0].upper()}{kind[1:]}, {manoeuvre.start:.1f} to {manoeuvre.stop:.1f} s."
        rows.append(
            {
                "name": name,
                "kind": kind,
                "start": f"{manoeuvre.start:.1f}",
                "stop": f"{manoeuvre.stop:.1f}",
                "moved": "" if manoeuvre.is_condition else moved_words(manoeuvre),
                "condition": condition_words(manoeuvre),
                "air": air_words(manoeuvre.turbulence),
                "worth": worth_words(manoeuvre.expected),
                "figure": book.add(chart, caption, caption) if chart else None,
            }
        )
    rejected = [
        (f"{entry.start:.1f}", f"{entry.stop:.1f}", surface_words(entry.surface), entry.reason)
        for entry in segmentation.rejected
    ]
    template = page_environment(_TEMPLATES).get_template("manoeuvres.html")
    return template.render(
        log=log,
        overview=whole,
        rows=rows,
        rejected=rejected,
        summary=summary(segmentation),
        style=page_style(),
        version=__version__,
    )
