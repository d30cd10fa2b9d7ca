"""Spans of recordings: `LOG@FROM:TO`, and segment files that list log, span, role and name."""

from __future__ import annotations

import csv
import io
import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from aerosid.errors import LogError, UsageError
from aerosid.logs.flight_log import FlightLog, chosen_stretch
from aerosid.logs.formats import read_log
from aerosid.logs.formats.table import shown
from aerosid.logs.settings import READING

__all__ = [
    "ROLES",
    "Span",
    "cut_span",
    "expand",
    "files_given",
    "is_segment_file",
    "parse_span",
    "read_segment_file",
    "read_span",
]

ROLES = ("identification", "validation", "hold_out")
"""Permitted roles of a segment."""

_SPAN = re.compile(r"(?P<path>.+)@(?P<start>[^:@]*):(?P<stop>[^:@]*)", re.DOTALL)
_COLUMNS = ("log", "from", "to", "role", "name")
_LARGEST_FILE = 10_000_000
"""Format: maximum number of bytes of a segment file."""


@dataclass(frozen=True)
class Span:
    """Part of a recording.

    Attributes
    ----------
    path : Path
        The recording.
    start, stop : float or None
        s on its own clock; None: from its beginning, or to its end.
    role : str
        identification, validation or hold_out; empty where neither the file nor the command line gives it.
    name : str
        Its name in results; empty: the recording's name with the span.
    """

    path: Path
    start: float | None = None
    stop: float | None = None
    role: str = ""
    name: str = ""

    @property
    def whole(self) -> bool:
        """Whether it is the whole recording."""
        return self.start is None and self.stop is None

    def __str__(self) -> str:
        """As written on the command line."""
        if self.whole:
            return str(self.path)
        ends = ("" if end is None else f"{end:.15g}" for end in (self.start, self.stop))
        return f"{self.path}@{':'.join(ends)}"


def parse_span(text: str | Path) -> Span:
    """The span written as `LOG`, `LOG@FROM:TO`, `LOG@FROM:` or `LOG@:TO`, times in s.

    Raises
    ------
    UsageError
        Where a time is not a number, or the span is empty.
    """
    path = Path(text)
    match = _SPAN.fullmatch(str(text))
    if match is None or path.exists():
        return Span(path)
    ends: list[float | None] = []
    for word in (match["start"], match["stop"]):
        try:
            ends.append(float(word) if word.strip() else None)
        except ValueError:
            raise UsageError(
                f"{shown(text, 200)}: {shown(word)} is not a time in s; give a span as LOG@3625:3665."
            ) from None
    return _checked(Span(Path(match["path"]), ends[0], ends[1]), shown(text, 200))


def _checked(span: Span, label: str) -> Span:
    for end in (span.start, span.stop):
        if end is not None and not math.isfinite(end):
            raise UsageError(f"{label}: a span's time is {end}, expected a number of seconds; correct it.")
    if span.start is not None and span.stop is not None and not span.start < span.stop:
        raise UsageError(
            f"{label}: the span goes from {span.start:g} to {span.stop:g} s, expected the earlier time first; "
            "correct it."
        )
    return span


def expand(texts: Iterable[str | Path]) -> tuple[Span, ...]:
    """The spans of a command line's arguments: recordings, spans of them, and the contents of segment files.

    Raises
    ------
    UsageError
        Where a span or a segment file is wrong.
    """
    spans: list[Span] = []
    for text in texts:
        path = Path(text)
        spans += read_segment_file(path) if is_segment_file(path) else [parse_span(text)]
    return tuple(spans)


def files_given(texts: Iterable[str | Path]) -> tuple[Path, ...]:
    """The files that a command line's arguments name: recordings, segment files, and the recordings in these.

    Raises
    ------
    UsageError
        As `expand`.
    """
    texts = tuple(texts)
    return (*map(Path, texts), *(span.path for span in expand(texts)))


def read_span(
    text: str | Path | Span,
    channels: Path | None,
    held: dict[Path, FlightLog] | None = None,
    *,
    across_holes: bool = False,
) -> FlightLog:
    """The recording, cut to its span and named accordingly.

    Parameters
    ----------
    text : str, Path or Span
        From `parse_span`.
    channels : Path, optional
        The channel map.
    held : dict of Path to FlightLog, optional
        Recordings already read: a flight with ten spans is read once.
    across_holes : bool
        Keep all stretches of the span; otherwise the longest one without a gap.

    Raises
    ------
    LogError
        Where the recording cannot be read, or has fewer than two samples in the span.
    """
    span = text if isinstance(text, Span) else parse_span(text)
    store = {} if held is None else held
    if span.path not in store:
        store[span.path] = read_log(span.path, channels, across_holes=True)
    cut = cut_span(store[span.path], span)
    return cut if across_holes else chosen_stretch(cut)


def cut_span(log: FlightLog, span: Span) -> FlightLog:
    """The log between the span's ends, with its name; the whole log keeps its own."""
    if span.whole:
        return replace(log, name=span.name) if span.name else log
    cut = log.between(span.start, span.stop)
    first = log.time[0] if span.start is None else span.start
    last = log.time[-1] if span.stop is None else span.stop
    return replace(cut, name=span.name or named_by_span(log.name, first, last))


def named_by_span(name: str, first: float, last: float) -> str:
    """The name of a part of a recording, from one time to another, s."""
    return f"{name}_{first:.6g}-{last:.6g}"


def is_segment_file(path: Path) -> bool:
    """A TOML file, or a CSV whose header names `log` and `from` or `to` without units."""
    if not path.is_file():
        return False
    if path.suffix.lower() == ".toml":
        return True
    if path.suffix.lower() != ".csv":
        return False
    try:
        with path.open("rb") as stream:
            head = stream.read(4096).decode("utf-8-sig", "replace")
    except OSError:
        return False
    line = next((line for line in head.splitlines() if line.strip() and not line.startswith("#")), "")
    names = {word.strip().strip('"') for word in line.split(",")}
    return "log" in names and bool(names & {"from", "to"}) and names <= set(_COLUMNS)


def read_segment_file(path: Path) -> tuple[Span, ...]:
    """The segments of a TOML file (`[[segment]]` with log, from, to, role, name) or of a CSV with these columns.

    Logs are relative to the file's folder.

    Raises
    ------
    UsageError
        Where the file cannot be read or an entry is wrong; the message names segment and key.
    """
    try:
        content = path.read_bytes()[: _LARGEST_FILE + 1].decode("utf-8-sig")
    except OSError as error:
        raise UsageError(f"{path}: the segment file cannot be opened ({error.strerror}); check the path.") from None
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: byte {error.start + 1} is not UTF-8; save the segment file as UTF-8.") from None
    rows = _toml_rows(path, content) if path.suffix.lower() == ".toml" else _csv_rows(path, content)
    if not rows:
        raise UsageError(f"{path}: it lists no segment; add [[segment]] with log, from and to.")
    spans = tuple(_segment(path, number, row) for number, row in enumerate(rows, 1))
    names = [span.name for span in spans if span.name]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UsageError(f"{path}: two segments are named {shown(twice)}; name each once.")
    return spans


def _toml_rows(path: Path, content: str) -> list[Mapping[str, Any]]:
    try:
        document = tomllib.loads(content)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        reason = " ".join(str(error).split())[:120]
        raise UsageError(f"{path}: the segment file is not valid TOML ({reason}); correct that place.") from None
    unknown = next((key for key in document if key not in ("schema", "segment")), None)
    if unknown is not None:
        raise UsageError(
            f"{path}: key {shown(unknown)} is not known in a segment file, expected [[segment]] with "
            f"{', '.join(_COLUMNS)}; correct it."
        )
    rows = document.get("segment", [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise UsageError(f"{path}: segment is not a list of tables; write [[segment]] with double brackets.")
    return rows


def _csv_rows(path: Path, content: str) -> list[Mapping[str, Any]]:
    lines = [line for line in content.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    try:
        return list(csv.DictReader(io.StringIO("\n".join(lines)), skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise UsageError(f"{path}: the segment file is not valid CSV ({error}); correct it.") from None


def _segment(path: Path, number: int, row: Mapping[str, Any]) -> Span:
    label = f"{path}: segment {number}"
    for key in row:
        if key not in _COLUMNS:
            raise UsageError(f"{label} holds {shown(key)}, expected {', '.join(_COLUMNS)}; correct it.")
    log = row.get("log")
    if not isinstance(log, str) or not log.strip():
        raise UsageError(f'{label} names no log; add log = "flight.csv".')
    role = str(row.get("role") or "").strip()
    if role and role not in ROLES:
        raise UsageError(f"{label} has the role {shown(role)}, expected one of {', '.join(ROLES)}; correct it.")
    name = str(row.get("name") or "").strip()
    if any(mark in name for mark in '/\\:*?"<>|\0') or name in (".", ".."):
        raise UsageError(f"{label} is named {shown(name)}, which is not a file name; take letters, digits, - and _.")
    ends = [_seconds(label, key, row.get(key)) for key in ("from", "to")]
    return _checked(Span(path.parent / log.strip(), ends[0], ends[1], role, name), label)


def _seconds(label: str, key: str, found: object) -> float | None:
    if found is None or (isinstance(found, str) and not found.strip()):
        return None
    try:
        return float(found) if isinstance(found, (int, float, str)) and not isinstance(found, bool) else _no_time()
    except ValueError:
        raise UsageError(f"{label}: {key} is {shown(found)}, expected a time in s; correct it.") from None


def _no_time() -> float:
    raise ValueError


def require_samples(log: FlightLog, fewest: int = READING.fewest_samples) -> FlightLog:
    """The log, where it has enough samples for an estimation.

    Raises
    ------
    LogError
        Where it does not.
    """
    if log.samples < fewest:
        raise LogError(
            f"{log.path or log.name}: {log.samples} samples are too few to estimate anything; give at least {fewest}."
        )
    return log
