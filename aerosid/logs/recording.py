"""Recording: streams of samples, each on its own stamps, nothing converted.

A reader returns a recording; a channel map and `logs.raster` turn it into a `FlightLog`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

AnyArray = NDArray[Any]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TICKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Standard: s per count of a clock, by its unit."""


@dataclass(frozen=True)
class Clock:
    """The stamps of a stream by one of the recorder's clocks.

    Attributes
    ----------
    name : str
        The field that contains them in the file, or a description.
    ticks : ndarray, shape (N,)
        Stamps as recorded, integer or float64; integers stay integers, because microseconds since 1970 need 51 bits.
    tick : float
        Length of one count, s.
    """

    name: str
    ticks: AnyArray
    tick: float

    def seconds(self, origin: float = 0) -> FloatArray:
        """Stamps in s since `origin` (in counts), which is subtracted before any rounding; shape (N,)."""
        return since(self.ticks, origin, self.tick)


def since(ticks: AnyArray, origin: float, tick: float) -> FloatArray:
    """Counts of length `tick`, s, as s since `origin`, counts; shape (N,).

    Notes
    -----
    Counts per second are a whole number for every integer clock: the division rounds once, the multiplication by the
    inverse twice.
    """
    if ticks.dtype.kind in "iu":
        counts = (ticks.astype(np.int64) - np.int64(origin)).astype(np.float64)
        return counts / round(1.0 / tick) if tick < 1.0 else counts * tick
    return (ticks.astype(np.float64) - origin) * tick


def as_floats(values: AnyArray) -> FloatArray:
    """Recorded values as float64; bytes of damaged data that are no valid number become NaN, without a warning."""
    with np.errstate(invalid="ignore"):
        return np.asarray(values).astype(np.float64)


@dataclass(frozen=True)
class Column:
    """One recorded quantity.

    Attributes
    ----------
    load : callable
        Returns the values, shape (N,), as recorded; called on demand, so that only the used columns of a file of
        a thousand are read.
    unit : str or None
        As given by the file; None where it gives none.
    """

    load: Callable[[], AnyArray]
    unit: str | None = None


def _held(values: AnyArray) -> AnyArray:
    return values


def column(values: AnyArray, unit: str | None = None) -> Column:
    """A column of values already in memory."""
    return Column(partial(_held, values), unit)


@dataclass(frozen=True)
class Stream:
    """Columns that a recorder wrote together: one message, topic, group or table, with one stamp per row.

    Attributes
    ----------
    name : str
        Message, topic, group or table; empty where a file is one table.
    columns : mapping of str to Column
        By the name in the file, in its order.
    clocks : tuple of Clock
        The stream's stamps, the sample's own first; empty where the file does not define the time column.
    instance : int or None
        Instance among several senders of the same message; None where the format allows only one.
    order : ndarray of int, shape (N,), or None
        Position of each sample in the file, in any count shared by all streams, where they are interleaved.
    aliases : mapping of str to str
        Alternative names of a column, its header with the unit among them, mapped to the name in `columns`.
    boots : ndarray of int, shape (N,), or None
        Number of the recorder's run to which each sample belongs, where the clock restarted within the file.
    """

    name: str
    columns: Mapping[str, Column]
    clocks: tuple[Clock, ...] = ()
    instance: int | None = None
    order: IntArray | None = None
    boots: IntArray | None = None
    aliases: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))
        object.__setattr__(self, "aliases", MappingProxyType(dict(self.aliases)))

    @property
    def label(self) -> str:
        """The stream's name, with its instance in brackets where there is one."""
        return self.name if self.instance is None else f"{self.name}[{self.instance}]"

    def clock(self, name: str | None = None) -> Clock | None:
        """The clock of this name, or the stream's first; None where there is none."""
        found = (clock for clock in self.clocks if name is None or clock.name == name)
        return next(found, None)


@dataclass(frozen=True)
class Recording:
    """Contents of a file, as the recorder wrote them.

    Attributes
    ----------
    format : str
        Name of the format that was read.
    streams : tuple of Stream
        In the file's order.
    notes : tuple of str
        Losses and irregularities of the file, one sentence each.
    drop_outs : tuple of (float, float)
        Start, s on the recorder's clock, and length, s, of losses reported by the recorder itself.
    utc_of_zero : datetime or None
        Absolute time at zero of the recorder's clock; only from a valid source.
    messages : int
        Number of messages read, where the format has them; 0 otherwise.
    counts : mapping of str to int
        Number of messages of each type, including those that are no measurements.
    """

    format: str
    streams: tuple[Stream, ...]
    notes: tuple[str, ...] = ()
    drop_outs: tuple[tuple[float, float], ...] = ()
    utc_of_zero: datetime | None = None
    messages: int = 0
    counts: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "counts", MappingProxyType(dict(self.counts)))
