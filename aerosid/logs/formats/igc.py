"""Gliders' flight recorders (FAI IGC, .igc), through aerofiles: fixes with pressure and GNSS altitude."""

from __future__ import annotations

import io
from datetime import UTC, datetime, time
from typing import Any

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.missing_library import library
from aerosid.logs.recording import TICKS, Clock, Recording, Stream, column

_DAY = 86_400_000
"""Standard: ms in a day."""

_UNITS = {"lat": "deg", "lon": "deg", "pressure_alt": "m", "gps_alt": "m"}
_NOT_NUMBERS = ("time", "validity", "datetime", "datetime_local")


def read_igc(data: bytes, path: str) -> Recording:
    """The fixes of an IGC file, with the values of its extensions.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If aerofiles is not installed, or no line contains a fix.

    Notes
    -----
    Stamps are UTC, ms since 1970 where the file gives its date (`HFDTE`, old or new spelling), else of the day; a step
    back by more than half a day is midnight. The extensions' numbers are as written: the file does not give the unit
    of a TAS.
    """
    reader = library("aerofiles.igc", path)
    try:
        parsed = reader.Reader(skip_duplicates=False).read(io.StringIO(data.decode("latin-1")))
    except Exception as error:  # noqa: BLE001  damaged bytes can raise any exception in aerofiles
        detail = " ".join(str(error).split())[:80] or type(error).__name__
        raise LogError(f"{path}: the IGC file is damaged ({detail}); copy it again from the recorder.") from None
    wrong, fixes = parsed["fix_records"]
    if not fixes:
        raise LogError(f"{path}: no line holds a fix (B record); check that this is an IGC file.")
    day = parsed["header"][1].get("utc_date")
    zero = 0 if day is None else int(datetime.combine(day, time(), UTC).timestamp() * 1e3)
    of_day = np.array([_milliseconds(fix["time"]) for fix in fixes], dtype=np.int64)
    stamps = of_day + _DAY * np.cumsum(np.concatenate([[0], np.diff(of_day) < -_DAY // 2])) + zero
    columns = {name: column(_numbers(fixes, name), _UNITS.get(name)) for name in fixes[0] if name not in _NOT_NUMBERS}
    notes = [f"{len(wrong)} fixes cannot be read and are left out"] if wrong else []
    if day is None:
        notes.append("the file gives no date (HFDTE): times are of the day")
    stream = Stream("", columns, (Clock("UTC", stamps, TICKS["ms"]),))
    return Recording("igc", (stream,), tuple(notes), messages=len(fixes))


def _milliseconds(moment: time) -> int:
    return ((moment.hour * 60 + moment.minute) * 60 + moment.second) * 1000 + moment.microsecond // 1000


def _numbers(fixes: list[dict[str, Any]], name: str) -> Any:
    values = [fix.get(name) for fix in fixes]
    return np.array([np.nan if value is None else float(value) for value in values])
