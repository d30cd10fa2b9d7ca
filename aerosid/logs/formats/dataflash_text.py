"""ArduPilot DataFlash logs in text form (.log): lines of declared messages."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.dataflash import (
    BOOKKEEPING,
    FMT_FIELDS,
    MessageFormat,
    finished_recording,
    stamp_fields,
)
from aerosid.logs.recording import TICKS, Clock, Column, FloatArray, IntArray, Recording, Stream, column

_LAST_STAMP = 2.0**53
"""Numerical: largest stamp, in its unit; beyond, doubles do not represent every integer."""


def read_dataflash_text(data: bytes, path: str) -> Recording:
    """The messages of a DataFlash log in text form (.log), one stream a type.

    Raises
    ------
    LogError
        If it contains no message of a declared type.
    """
    formats: dict[bytes, MessageFormat] = {}
    lines: dict[bytes, list[bytes]] = {}
    places: dict[bytes, list[int]] = {}
    unread = 0
    for number, line in enumerate(data.splitlines()):
        name = line[: line.find(b",")]
        if name == b"FMT" and (form := _text_format(line)) is not None:
            formats[form.name.encode("latin-1")] = form
            lines.setdefault(b"FMT", []).append(line)
        elif name in formats and line.count(b",") == len(formats[name].fields):
            lines.setdefault(name, []).append(line)
            places.setdefault(name, []).append(number)
        elif line and formats:
            unread += 1
    if not formats or not set(lines) - {b"FMT"}:
        raise LogError(f"{path}: no line is a described DataFlash message; check that this is the right file.")
    streams = [
        stream
        for name, held in lines.items()
        if name in formats and formats[name].name not in BOOKKEEPING
        for stream in _text_stream(formats[name], held, np.array(places[name]))
    ]
    counts = {name.decode("latin-1"): len(held) for name, held in lines.items()}
    notes = [f"{unread} lines are not messages of a declared type and are skipped"] if unread else []
    return finished_recording("dataflash_text", streams, counts, notes)


def _text_format(line: bytes) -> MessageFormat | None:
    """The declaration in a line `FMT, type, length, name, letters, fields...`; None where it is not one."""
    words = [word.strip() for word in line.decode("latin-1").split(",")]
    if len(words) < len(FMT_FIELDS) or not (words[1].isdigit() and words[2].isdigit()):
        return None
    return MessageFormat(words[3], int(words[2]), words[4], tuple(words[5:]))


def _text_stream(form: MessageFormat, lines: list[bytes], order: IntArray) -> Iterator[Stream]:
    stamps = dict(stamp_fields(form.name, form.fields))
    if not stamps or len(set(form.fields)) < len(form.fields):
        return
    held = dict(zip(form.fields, _numbers(lines), strict=True))
    # A line whose stamp is damaged cannot be placed in time.
    sound = np.all([np.abs(held[name]) < _LAST_STAMP for name in stamps], axis=0)
    clocks = [Clock(name, held[name][sound].astype(np.int64), TICKS[unit]) for name, unit in stamps.items()]
    columns: dict[str, Column] = {
        name: column(held[name][sound])
        for name, letter in zip(form.fields, form.letters, strict=False)
        if letter not in "anNZM" and name not in stamps
    }
    if sound.any():
        yield Stream(form.name, columns, tuple(clocks), order=order[sound])


def _numbers(lines: list[bytes]) -> list[FloatArray]:
    """Each field after the message's name as numbers, NaN where it is not a number."""
    import pandas as pd

    text = io.BytesIO(b"\n".join(lines))
    options = {"header": None, "skipinitialspace": True, "quoting": csv.QUOTE_NONE, "encoding": "latin-1"}
    frame = pd.read_csv(text, low_memory=False, index_col=False, **options)  # type: ignore[call-overload]
    fields = [frame.iloc[:, index] for index in range(1, frame.shape[1])]
    return [np.asarray(pd.to_numeric(words, errors="coerce"), dtype=np.float64) for words in fields]
