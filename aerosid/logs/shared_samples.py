"""Duplicate samples of two recordings: the same file over overlapping spans, or rows that agree in every channel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aerosid.logs.flight_log import FlightLog, range_of
from aerosid.logs.settings import DUPLICATES
from aerosid.nomenclature import CHANNELS


def shared_samples(one: FlightLog, other: FlightLog) -> tuple[float, float] | None:
    """The span of `one`, s in its own time, whose samples the other log also contains; None where there is none.

    Notes
    -----
    The same file (by path or SHA-256) has one clock, so that spans are compared. Of different files rows are compared,
    whatever their clocks: a cut that begins at zero again has the same samples as the recording that it comes from.
    """
    if _is_same_file(one, other):
        both = one.time[(one.time >= other.time[0]) & (one.time <= other.time[-1])]
        return (float(both[0]), float(both[-1])) if both.size >= DUPLICATES.fewest else None
    names = [
        name
        for name in one.channels
        if name in other and name in CHANNELS and min(range_of(one[name]), range_of(other[name])) > 0.0
    ]
    if len(names) < DUPLICATES.fewest_channels:
        return None
    (mine, times), (theirs, _) = _rows(one, names), _rows(other, names)
    shared = np.isin(mine, theirs)
    if np.unique(mine[shared]).size < DUPLICATES.fewest_rows:
        return None
    return float(times[shared][0]), float(times[shared][-1])


def _is_same_file(one: FlightLog, other: FlightLog) -> bool:
    if one.sha256 and one.sha256 == other.sha256:
        return True
    return bool(one.path and other.path) and Path(one.path).resolve() == Path(other.path).resolve()


def _rows(log: FlightLog, names: list[str]) -> tuple[NDArray[np.void], NDArray[np.float64]]:
    """The complete rows of some channels as one item each, and their times."""
    table = np.column_stack([log[name] for name in names])
    complete = np.isfinite(table).all(axis=1)
    table = table[complete]
    size = np.abs(table)
    scale = 10.0 ** (DUPLICATES.digits - 1 - np.floor(np.log10(np.where(size > 0.0, size, 1.0))))
    whole = np.ascontiguousarray(np.rint(table * scale) / scale) + 0.0  # -0.0 becomes 0.0
    return whole.view(np.dtype((np.void, whole.dtype.itemsize * len(names)))).ravel(), log.time[complete]
