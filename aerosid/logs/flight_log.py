"""The flight log: channels in SI units on one time base, with the source of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import LogError
from aerosid.logs.settings import READING
from aerosid.nomenclature import is_surface
from aerosid.signals.resampling import without_gaps
from aerosid.signals.running_trapezoids import integral_from_start

FloatArray = NDArray[np.float64]
Position = tuple[float, float, float]


@dataclass(frozen=True)
class ChannelSource:
    """The source of a channel and its conversion on reading: value = sign * scale * x + offset.

    Attributes
    ----------
    columns : tuple of str
        The columns in the file, by name or by number from 1; several are summed. For a derived channel, its parents.
    unit : str
        The unit of the numbers in the file.
    sign, scale : float
        Factors applied to the numbers of the file.
    offset : float
        Added after the factors, in `unit`.
    delay : float
        Delay of the recording, s, by which the channel was shifted to earlier times.
    """

    columns: tuple[str, ...]
    unit: str
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0
    delay: float = 0.0


@dataclass(frozen=True, repr=False)
class FlightLog:
    """One manoeuvre log: channels in SI units and radians on one strictly increasing time base.

    Attributes
    ----------
    name : str
        The file's name without its suffix.
    time : ndarray, shape (N,)
        Time, s, strictly increasing; not necessarily uniform.
    channels : mapping of str to ndarray, shape (N,)
        Values in `units`; NaN marks a missing sample. All arrays are read-only.
    units : mapping of str to str
        The unit of each channel: the glossary's, or the file's for a channel that is not in the glossary.
    sources : mapping of str to ChannelSource
        Source of each channel, for the report's table.
    positions : mapping of str to (float, float, float)
        Sensor positions from the centre of gravity, m, body axes; only where given.
    notes : tuple of str
        Every conversion of the data on reading, one sentence each.
    path : str
        The file as the user named it.
    sha256 : str
        SHA-256 of the file's bytes.
    noise : mapping of str to float
        Standard deviation of a channel's noise in `units`, where the channel map or the aircraft file gives it.
    resolution : mapping of str to float
        Resolution of a channel in `units`, from the same source.
    channel_map, channel_map_sha256 : str
        The channel map with which the file was read, and the SHA-256 of its bytes; empty where none was needed.
    holes : tuple of (float, float)
        Last time before and first time after each gap that divides the record, s.

    Raises
    ------
    LogError
        If the shapes differ, or the time base has fewer than two samples, is not finite or not strictly increasing.
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
    noise: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    channel_map: str = ""
    channel_map_sha256: str = ""
    holes: tuple[tuple[float, float], ...] = ()

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
        object.__setattr__(self, "noise", MappingProxyType(dict(self.noise)))
        object.__setattr__(self, "resolution", MappingProxyType(dict(self.resolution)))

    def __reduce__(self) -> tuple[type[FlightLog], tuple[object, ...]]:
        """The parts for a worker process: a read-only mapping cannot be pickled."""
        mappings = (dict(mapping) for mapping in (self.channels, self.units, self.sources, self.positions))
        known = (dict(self.noise), dict(self.resolution), self.channel_map, self.channel_map_sha256, self.holes)
        return FlightLog, (self.name, self.time, *mappings, self.notes, self.path, self.sha256, *known)

    @property
    def mean_airspeed(self) -> float:
        """Mean of the true airspeed, m/s; 0 where it was not recorded."""
        return float(np.nanmean(self["V"])) if "V" in self and np.isfinite(self["V"]).any() else 0.0

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __getitem__(self, name: str) -> FloatArray:
        """Channel `name`, shape (N,), in `units[name]`; LogError where the log does not contain it."""
        try:
            return self.channels[name]
        except KeyError:
            found = ", ".join(self.channels) or "none"
            raise LogError(
                f"{self.path or self.name}: channel {name} is not in the log (it holds {found}); "
                "add the column or map it in a channel map."
            ) from None

    def __repr__(self) -> str:
        """One line for a log of any length: name, samples, span and channels."""
        span = f"{self.time[0]:g} ... {self.time[-1]:g} s"
        return f"<FlightLog {self.name}: {self.samples} samples, {span}, {', '.join(self.channels) or 'no channel'}>"

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return int(self.time.size)

    @property
    def interval(self) -> float:
        """Median sampling interval, s."""
        return float(np.median(np.diff(self.time)))

    def between(self, start: float | None, stop: float | None) -> FlightLog:
        """The samples with start <= time <= stop (s, the log's own time; None: no limit), as a new log.

        Raises
        ------
        LogError
            If fewer than two samples remain.
        """
        low = -np.inf if start is None else start
        high = np.inf if stop is None else stop
        # Times are often printed decimals: a tolerance of half a nanosecond keeps the sample that the user specifies.
        keep = (self.time >= low - 5e-10) & (self.time <= high + 5e-10)
        count = int(np.count_nonzero(keep))
        if count < 2:
            span = " and ".join(
                f"{side} {edge:g} s" for side, edge in (("after", start), ("before", stop)) if edge is not None
            )
            raise LogError(
                f"{self.path or self.name}: {count or 'no'} sample{'' if count == 1 else 's'} lie{'s' * (count == 1)} "
                f"{span}, but the log runs from {self.time[0]:g} to {self.time[-1]:g} s; choose a span inside it."
            )
        if count == self.samples:
            return self
        note = f"cut to {self.time[keep][0]:g} ... {self.time[keep][-1]:g} s ({count} of {self.samples} samples)"
        return replace(
            self,
            time=self.time[keep],
            channels={name: values[keep] for name, values in self.channels.items()},
            notes=(*self.notes, note),
            holes=tuple(hole for hole in self.holes if hole[0] >= low - 5e-10 and hole[1] <= high + 5e-10),
        )


def stretches(log: FlightLog) -> tuple[FlightLog, ...]:
    """The stretches of a log between its gaps, in order of time; the log itself where it has none.

    Parameters
    ----------
    log : FlightLog
        As it was read.
    """
    if not log.holes:
        return (log,)
    edges = [0, *np.searchsorted(log.time, [after for _, after in log.holes]), log.samples]
    spans = [(a, b) for a, b in pairwise(edges) if b - a > 1]
    return tuple(
        replace(log, time=log.time[a:b], channels={k: v[a:b] for k, v in log.channels.items()}, holes=())
        for a, b in spans
    )


def chosen_stretch(log: FlightLog) -> FlightLog:
    """The longest stretch without a gap that holds a manoeuvre, with a note on the others.

    A control moves in it by a fifth of the most that it moves in any; where none moves or is recorded, the longest. The
    log itself where it has no gap.

    Parameters
    ----------
    log : FlightLog
        As it was read, or cut to a span.
    """
    parts = stretches(log)
    if len(parts) == 1:
        return parts[0]
    moving = _with_moving_control(parts)
    chosen = max(moving, key=lambda part: float(part.time[-1] - part.time[0]))
    others = ", ".join(f"{part.time[0]:.6g} to {part.time[-1]:.6g} s" for part in parts if part is not chosen)
    whose = " in which a control moves" if len(moving) < len(parts) else ""
    note = (
        f"{chosen.time[0]:.6g} to {chosen.time[-1]:.6g} s is used, of {len(parts)} stretches without a gap the longest"
        f"{whose}; the others: {others}; choose one by its span"
    )
    return replace(chosen, notes=(*chosen.notes, note))


def _with_moving_control(parts: Sequence[FlightLog]) -> Sequence[FlightLog]:
    """The stretches in which a control moves; all where none does."""
    ranges = np.array(
        [[range_of(part[name]) for part in parts] for name in parts[0].channels if is_surface(name)]
    ).reshape(-1, len(parts))
    largest = ranges.max(axis=1, keepdims=True, initial=0.0)
    moves = np.any((ranges > READING.moving_control * largest) & (largest > 0.0), axis=0)
    return [part for part, moved in zip(parts, moves.tolist(), strict=True) if moved] or parts


def range_of(values: NDArray[np.float64]) -> float:
    """The largest of some samples less the smallest; zero where none is there."""
    present = values[np.isfinite(values)]
    return float(np.ptp(present)) if present.size else 0.0


def with_fuel_used(log: FlightLog) -> FlightLog:
    """The log with `fuel_used` [kg] integrated from `fuel_flow` [kg/s], where only the latter was recorded.

    Done on reading, before any cut, so that a manoeuvre late in the flight includes the fuel used before it.
    """
    if "fuel_flow" not in log or "fuel_used" in log:
        return log
    if np.count_nonzero(np.isfinite(log["fuel_flow"])) < 2:
        return log
    flow = without_gaps(log.time, log["fuel_flow"])
    used = integral_from_start(log.time, flow)
    return replace(
        log,
        channels={**log.channels, "fuel_used": used},
        units={**log.units, "fuel_used": "kg"},
        sources={**log.sources, "fuel_used": ChannelSource(("fuel_flow",), "kg")},
        notes=(*log.notes, f"fuel_used: fuel_flow integrated since the beginning, {used[-1]:.4g} kg in all"),
    )


def _frozen(values: ArrayLike) -> FloatArray:
    """A read-only float64 array; copied unless it is read-only already, so that the caller's array stays writable."""
    array = np.asarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.copy()
        array.setflags(write=False)
    return array
