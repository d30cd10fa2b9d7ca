"""Day of a report: today, or that of SOURCE_DATE_EPOCH for files that are the same on every day."""

from __future__ import annotations

import datetime as dt
import os

from aerosid.errors import UsageError

EPOCH = "SOURCE_DATE_EPOCH"
"""Environment variable that gives the day, s since 1970, where files are to be the same on every day."""


def today() -> str:
    """The day, UTC: that of SOURCE_DATE_EPOCH where it is set, so that the same input gives the same bytes.

    Raises
    ------
    UsageError
        Where SOURCE_DATE_EPOCH is no whole number of seconds.
    """
    given = os.environ.get(EPOCH)
    if given is None:
        return dt.datetime.now(dt.UTC).date().isoformat()
    try:
        return dt.datetime.fromtimestamp(int(given), dt.UTC).date().isoformat()
    except (ValueError, OverflowError, OSError):
        raise UsageError(
            f"the environment variable {EPOCH} is {given[:40]!r}, expected whole seconds since 1970; correct or unset "
            "it."
        ) from None
