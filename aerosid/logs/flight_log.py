"""The measured manoeuvre: an immutable log in SI on one time base, that remembers where each channel came from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import LogError

FloatArray = NDArray[np.float64]
Position = tuple[float, float, float]


@dataclass(frozen=True)
class ChannelSource:
    """Where a channel came from, and what was done to it on reading: value = sign * scale * x + offset.

    Attributes
    ----------
    columns : tuple of str
        The columns as named, or numbered from 1, in the file; several are summed. For a derived channel, its parents.
    unit : str
        The unit the file's numbers were read with.
    sign, scale : float
        Factors applied to the file's numbers.
    offset : float
        Added after the factors, in `unit`.
    delay : float
        How late the recording was taken to be and by how much it was moved earlier, s.
    """

    columns: tuple[str, ...]
    unit: str
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0
    delay: float = 0.0


@dataclass(frozen=True)
class FlightLog:
    """One manoeuvre log: channels in SI and radians on one strictly increasing time base.

    Attributes
    ----------
    name : str
        The file's name without its suffix.
    time : ndarray, shape (N,)
        Time, s, strictly increasing; not necessarily regular.
    channels : mapping of str to ndarray, shape (N,)
        Values in `units`; NaN marks a missing sample. All arrays are read-only.
    units : mapping of str to str
        The unit a channel is held in: the glossary's, or the file's own for a channel that the glossary does not know.
    sources : mapping of str to ChannelSource
        What was read for each channel, for the report's table.
    positions : mapping of str to (float, float, float)
        Sensor positions from the centre of gravity, m, body axes; only where they were given.
    notes : tuple of str
        Everything that was done to the data on reading, one sentence each.
    path : str
        The file as the user named it.
    sha256 : str
        SHA-256 of the file's bytes.

    Raises
    ------
    LogError
        If the shapes differ, the time base has fewer than two samples, is not finite or does not strictly increase.
    """

    name: str
    time: FloatArray
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)
    sources: Mapping[str, ChannelSource] = field(default_factory=dict)
    positions: Mapping[str, Position] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    path: str = ""
    sha256: str = ""

    def __post_init__(self) -> None:
        time = _frozen(self.time)
        channels = {name: _frozen(values) for name, values in self.channels.items()}
        label = self.path or self.name
        if time.ndim != 1 or time.size < 2:
            raise LogError(f"{label}: the log holds {time.size} samples, but at least 2 are needed; record more.")
        for name, values in channels.items():
            if values.shape != time.shape:
                raise LogError(
                    f"{label}: channel {name} has shape {values.shape}, but time has {time.shape}; "
                    "give one value per time sample."
                )
        step = np.diff(time)
        if not (np.isfinite(time[0]) and bool(np.all(step > 0.0)) and np.isfinite(time[-1])):
            bad = int(np.flatnonzero(~(step > 0.0))[0]) + 1 if not np.all(step > 0.0) else 0
            raise LogError(
                f"{label}: time does not strictly increase at sample {bad + 1} "
                f"(found {time[bad]:.10g} s after {time[max(bad - 1, 0)]:.10g} s); remove or repair that sample."
            )
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "channels", MappingProxyType(channels))
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))
        object.__setattr__(self, "sources", MappingProxyType(dict(self.sources)))
        object.__setattr__(self, "positions", MappingProxyType(dict(self.positions)))

    def __reduce__(self) -> tuple[type[FlightLog], tuple[object, ...]]:
        """The parts for a worker process: a mapping that cannot be written cannot be sent either."""
        mappings = (dict(mapping) for mapping in (self.channels, self.units, self.sources, self.positions))
        return FlightLog, (self.name, self.time, *mappings, self.notes, self.path, self.sha256)

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __getitem__(self, name: str) -> FloatArray:
        """Channel `name`, shape (N,), in `units[name]`; LogError where the log does not hold it."""
        try:
            return self.channels[name]
        except KeyError:
            held = ", ".join(self.channels) or "none"
            raise LogError(
                f"{self.path or self.name}: channel {name} is not in the log (it holds {held}); "
                "add the column or map it in a channel map."
            ) from None

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return int(self.time.size)

    @property
    def interval(self) -> float:
        """Median sampling interval, s."""
        return float(np.median(np.diff(self.time)))

    def between(self, start: float | None, stop: float | None) -> FlightLog:
        """The samples with start <= time <= stop (s, the log's own time; None: open), as a new log.

        Raises
        ------
        LogError
            If fewer than two samples remain.
        """
        low = -np.inf if start is None else start
        high = np.inf if stop is None else stop
        # Times are often printed decimals: half a nanosecond of slack keeps the sample that the user names.
        keep = (self.time >= low - 5e-10) & (self.time <= high + 5e-10)
        count = int(np.count_nonzero(keep))
        if count < 2:
            raise LogError(
                f"{self.path or self.name}: {count} samples lie between {low:g} and {high:g} s, but the log runs from "
                f"{self.time[0]:g} to {self.time[-1]:g} s; choose a span inside it."
            )
        if count == self.samples:
            return self
        note = f"cut to {self.time[keep][0]:g} ... {self.time[keep][-1]:g} s ({count} of {self.samples} samples)"
        return replace(
            self,
            time=self.time[keep],
            channels={name: values[keep] for name, values in self.channels.items()},
            notes=(*self.notes, note),
        )


def _frozen(values: ArrayLike) -> FloatArray:
    """A read-only float64 array; copied unless it is one already, so that the caller's array stays writable."""
    array = np.asarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.copy()
        array.setflags(write=False)
    return array
