"""GPS time to UTC: weeks and seconds since 1980-01-06 minus the leap seconds at that date."""

from __future__ import annotations

from bisect import bisect_right
from datetime import UTC, date, datetime, timedelta

_EPOCH = datetime(1980, 1, 6, tzinfo=UTC)
_WEEK = 604_800
"""Standard: s in a week."""

# First day of each offset GPS - UTC of 1, 2, ... s: IERS Bulletin C, of which number 72 (July 2026) is the latest
# here. No leap second has been announced since.
LEAP_SECONDS_FROM = (
    date(1981, 7, 1), date(1982, 7, 1), date(1983, 7, 1), date(1985, 7, 1), date(1988, 1, 1), date(1990, 1, 1),
    date(1991, 1, 1), date(1992, 7, 1), date(1993, 7, 1), date(1994, 7, 1), date(1996, 1, 1), date(1997, 7, 1),
    date(1999, 1, 1), date(2006, 1, 1), date(2009, 1, 1), date(2012, 7, 1), date(2015, 7, 1), date(2017, 1, 1),
)  # fmt: skip


def leap_seconds(day: date) -> int:
    """GPS time minus UTC on a day, s.

    Parameters
    ----------
    day : date
        In UTC.
    """
    return bisect_right(LEAP_SECONDS_FROM, day)


def utc_of_gps(week: int, seconds: float) -> datetime:
    """UTC of a GPS time.

    Parameters
    ----------
    week : int
        Weeks since 1980-01-06; a receiver may count them modulo 1024.
    seconds : float
        Seconds of the week; may lie outside the week.

    Notes
    -----
    Within the seconds around a leap second the day in UTC is decisive: the offset is that of the resulting UTC.
    """
    gps = _EPOCH + timedelta(seconds=week * _WEEK) + timedelta(seconds=seconds)
    offset = leap_seconds(gps.date())
    utc = gps - timedelta(seconds=offset)
    return gps - timedelta(seconds=leap_seconds(utc.date()))
