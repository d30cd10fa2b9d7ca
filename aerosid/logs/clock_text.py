"""Clock times as text: `HH:MM:SS(.sss)`, `DDD:HH:MM:SS(.sss)`, dates, and the day change at midnight."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, date, datetime, time

import numpy as np

from aerosid.logs.recording import IntArray

_CLOCK = re.compile(r"\s*(?:(\d{1,3}):)?(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d{1,6}))?\s*")
_DATES = (re.compile(r"\s*(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})\s*"), re.compile(r"\s*(\d{1,2})\.(\d{1,2})\.(\d{4})\s*"))
_DAY = 86_400_000_000
"""Standard: us in a day."""

_HALF_DAY = _DAY // 2


def looks_like_clock(word: str) -> bool:
    """Whether a field is a clock time."""
    return _CLOCK.fullmatch(word) is not None


def looks_like_date(word: str) -> bool:
    """Whether a field is a date including the year."""
    return any(form.fullmatch(word) for form in _DATES)


def microseconds_of_clock(words: Sequence[str], dates: Sequence[str] | None = None) -> IntArray | None:
    """Stamps, us, of texts such as `23:59:59.9` or `237:23:59:59.9` (day of the year first); None if one is invalid.

    Parameters
    ----------
    words : sequence of str, length N
        One clock time for each sample.
    dates : sequence of str, length N, optional
        The date of each sample; stamps then count since 1970, otherwise from the clock's own zero.

    Notes
    -----
    Without dates and days a step back by more than half a day is taken for midnight, and the next day begins.
    """
    stamps = np.empty(len(words), dtype=np.int64)
    days_given = False
    for index, word in enumerate(words):
        match = _CLOCK.fullmatch(word)
        if match is None:
            return None
        days, hours, minutes, seconds, fraction = match.groups()
        days_given |= days is not None
        whole = ((int(days or 0) * 24 + int(hours)) * 60 + int(minutes)) * 60 + int(seconds)
        stamps[index] = whole * 1_000_000 + int((fraction or "0").ljust(6, "0"))
    if dates is not None:
        zeros = _days(dates)
        return None if zeros is None else stamps + zeros
    if not days_given:
        stamps += _DAY * np.cumsum(np.concatenate([[0], np.diff(stamps) < -_HALF_DAY]))
    return stamps


def _days(dates: Sequence[str]) -> IntArray | None:
    """Us since 1970 of each date; each distinct text is parsed once."""
    known: dict[str, int] = {}
    for word in dict.fromkeys(dates):
        found = _date(word)
        if found is None:
            return None
        known[word] = int(datetime.combine(found, time(), UTC).timestamp()) * 1_000_000
    return np.array([known[word] for word in dates], dtype=np.int64)


def _date(word: str) -> date | None:
    for form, order in zip(_DATES, ((0, 1, 2), (2, 1, 0)), strict=True):
        match = form.fullmatch(word)
        if match is not None:
            parts = [int(part) for part in match.groups()]
            try:
                return date(parts[order[0]], parts[order[1]], parts[order[2]])
            except ValueError:
                return None
    return None
