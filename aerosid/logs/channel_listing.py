"""Contents of a recording: each channel's unit, samples, rate, span, gaps and range, and faults of the time stamps."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from aerosid.logs.recording import TICKS, AnyArray, Clock, FloatArray, Recording, Stream, as_floats
from aerosid.logs.settings import READING
from aerosid.logs.stamps import DEFAULTS, Span, StampSettings, back_steps, flight_span, holes, unusable
from aerosid.signals.resampling import median_step

_BLOCKS = "▁▂▃▄▅▆▇█"
_SPARKS = 24
"""Display: characters of a sparkline."""

_NAMED = 4
"""Display: streams named in one sentence."""

_LARGEST = 1e150
"""Numerical: larger numbers, in any unit, are left out of ranges: their squares exceed the range of doubles."""


@dataclass(frozen=True)
class ListedStream:
    """The time stamps of one stream.

    Attributes
    ----------
    label : str
        The stream's name, with its instance.
    clock : str
        Name of the clock used; empty where there is none.
    samples : int
        Number of samples.
    rate : float or None
        From the median step, Hz.
    first, last : float or None
        s, on the listing's clock.
    holes : tuple of (float, float)
        Start and length, s, of each gap.
    problem : str
        Why the stream has no usable clock; empty where it has one.
    """

    label: str
    clock: str
    samples: int
    rate: float | None
    first: float | None
    last: float | None
    holes: tuple[tuple[float, float], ...]
    problem: str = ""


@dataclass(frozen=True)
class ListedChannel:
    """One column of a recording.

    Attributes
    ----------
    name : str
        As written in a channel map.
    unit : str
        As written in the file; empty where the file gives none.
    stream : str
        The label of the stream that holds it.
    samples, missing : int
        Number of samples, and number of missing samples.
    minimum, maximum, mean : float or None
        As recorded; None where no sample is a number.
    repeats : float
        Fraction of samples equal to the preceding one: a held value is not a measurement.
    sparkline : str
        Time history in block characters.
    """

    name: str
    unit: str
    stream: str
    samples: int
    missing: int
    minimum: float | None
    maximum: float | None
    mean: float | None
    repeats: float
    sparkline: str


@dataclass(frozen=True)
class Listing:
    """Contents of a recording.

    Attributes
    ----------
    format : str
        A key of `FORMATS`.
    streams : tuple of ListedStream
        In the file's order.
    channels : tuple of ListedChannel
        In the file's order.
    notes : tuple of str
        Lost data, irregularities and refused data, one sentence each.
    origin : int
        Zero of the listed times, s on the recorder's clock.
    """

    format: str
    streams: tuple[ListedStream, ...]
    channels: tuple[ListedChannel, ...]
    notes: tuple[str, ...]
    origin: int

    def as_json(self) -> dict[str, Any]:
        """The listing as a JSON object: finite numbers, None where a number is unknown."""
        content: dict[str, Any] = {"schema": 1, **asdict(self)}
        stamps = {stream.label: stream for stream in self.streams}
        for channel in content["channels"]:
            stream = stamps[channel["stream"]]
            channel |= {"rate": stream.rate, "first": stream.first, "last": stream.last, "holes": stream.holes}
            channel["range"] = [channel["minimum"], channel["maximum"]]
        return content


def list_channels(recording: Recording, settings: StampSettings = DEFAULTS, *, with_columns: bool = True) -> Listing:
    """The streams and columns of a recording, with the faults of its time stamps.

    Parameters
    ----------
    recording : Recording
        As the recorder made it.
    settings : StampSettings
        Limits of gaps and stray stamps.
    with_columns : bool
        Whether all columns are read and listed, or only the streams' time stamps.
    """
    clocks = {id(stream): stream.clock() for stream in recording.streams}
    usable = [clock for clock in clocks.values() if clock is not None and unusable(clock) is None]
    # A ground station may stamp its messages with the date and the aircraft with the time since its start.
    dated = [clock for clock in usable if _dated(clock)]
    counts = [sum(clock.ticks.size for clock in part) for part in (usable, dated)]
    elsewhere = {id(clock) for clock in dated} if 2 * counts[1] <= counts[0] else set()
    other_zero = _origin(dated)
    origin = 0 if elsewhere else other_zero
    zeros = {id(clock): other_zero if id(clock) in elsewhere else origin for clock in usable}
    streams = tuple(
        _listed_stream(stream, clock, zeros.get(id(clock), origin), settings)
        for stream in recording.streams
        for clock in [clocks[id(stream)]]
    )
    channels = tuple(
        _listed_channel(stream, name, column.unit, column.load())
        for stream in (recording.streams if with_columns else ())
        for name, column in stream.columns.items()
    )
    apart = [one for one, stream in zip(streams, recording.streams, strict=True) if id(clocks[id(stream)]) in elsewhere]
    together = tuple(one for one in streams if one not in apart)
    main = [clock for clock in usable if id(clock) not in elsewhere]
    notes = [*recording.notes, *_span_notes(main, together, origin, settings)]
    if apart:
        named = ", ".join(one.label for one in apart)
        notes.append(
            f"{named}: stamped with dates and not with the time since a start; listed from a zero of their own"
        )
    notes += _restart_notes(recording)
    for stream, listed in zip(recording.streams, streams, strict=True):
        notes += _stream_notes(stream, listed, clocks[id(stream)])
    notes += [
        f"the recorder lost {1e3 * length:.3g} ms at {at - origin:.6g} s"
        for at, length in recording.drop_outs
        if length
    ]
    return Listing(recording.format, streams, channels, tuple(notes), origin)


def _dated(clock: Clock) -> bool:
    """Whether most stamps count from 1970."""
    return clock.ticks.size > 0 and float(np.median(clock.ticks)) * clock.tick > READING.dated


def _origin(dated: list[Clock]) -> int:
    """A whole second before the first stamp that counts from 1970; 0 where there is none."""
    early = [clock.ticks.astype(np.float64) * clock.tick for clock in dated]
    first = min((float(np.min(moments[moments > READING.dated])) for moments in early), default=0.0)
    return int(first)


def _seconds(clock: Clock, origin: int) -> FloatArray:
    return clock.seconds(origin * round(1.0 / clock.tick) if clock.tick < TICKS["s"] else origin)


def _listed_stream(stream: Stream, clock: Clock | None, origin: int, settings: StampSettings) -> ListedStream:
    samples = next(iter(stream.columns.values())).load().shape[0] if clock is None and stream.columns else 0
    if clock is None:
        return ListedStream(stream.label, "", samples, None, None, None, (), "it has no time column")
    problem = unusable(clock)
    if problem is not None:
        return ListedStream(stream.label, clock.name, clock.ticks.size, None, None, None, (), problem)
    seconds = np.sort(_seconds(clock, origin), kind="stable")
    step = median_step(seconds)
    found = tuple((float(low), float(high - low)) for low, high in holes(seconds, settings))
    rate = 1.0 / step if np.isfinite(step) else None
    return ListedStream(stream.label, clock.name, clock.ticks.size, rate, float(seconds[0]), float(seconds[-1]), found)


def _listed_channel(stream: Stream, name: str, unit: str | None, recorded: AnyArray) -> ListedChannel:
    values = as_floats(recorded)
    # Larger numbers make a sum overflow: they are damaged data.
    values[~(np.abs(values) < _LARGEST)] = np.nan
    present = values[np.isfinite(values)]
    repeats = float(np.mean(present[1:] == present[:-1])) if present.size > 1 else 0.0
    label = f"{stream.label}.{name}" if stream.label else name
    return ListedChannel(
        label,
        unit or "",
        stream.label,
        values.size,
        values.size - present.size,
        *_extremes(present),
        repeats,
        sparkline(values),
    )


def _extremes(held: FloatArray) -> tuple[float | None, float | None, float | None]:
    """Least, greatest and mean value; None for an empty array."""
    return (float(held.min()), float(held.max()), float(held.mean())) if held.size else (None, None, None)


def sparkline(values: FloatArray, width: int = _SPARKS) -> str:
    """The time history of a channel in block characters, each the mean of a stretch; blank without measurements.

    Parameters
    ----------
    values : ndarray, shape (N,)
        Samples; NaN where one is missing.
    width : int
        Number of characters.
    """
    if values.size == 0:
        return ""
    stretches = np.array_split(values, min(width, values.size))
    means = np.array([np.mean(part[np.isfinite(part)]) if np.isfinite(part).any() else np.nan for part in stretches])
    if not np.isfinite(means).any():
        return " " * means.size
    low, high = float(np.nanmin(means)), float(np.nanmax(means))
    scaled = (means - low) / (high - low) if high > low else np.where(np.isfinite(means), 0.0, np.nan)
    return "".join(" " if np.isnan(m) else _BLOCKS[min(int(m * len(_BLOCKS)), len(_BLOCKS) - 1)] for m in scaled)


def _span_notes(
    clocks: list[Clock], streams: tuple[ListedStream, ...], origin: int, settings: StampSettings
) -> list[str]:
    """Duration of the recording, messages outside it, and streams that cover less of it."""
    span = flight_span([_seconds(clock, origin) for clock in clocks], settings)
    if span is None:
        return []
    within = [s for s in streams if s.first is not None and s.samples >= READING.fewest_of_stream]
    start, stop = _common_span(within, span)
    outside = []
    if span.after:
        outside.append(f"{span.after} message{'s are' if span.after > 1 else ' is'} after it")
    if span.before:
        outside.append(f"{span.before} long before it" if outside else f"{span.before} messages are long before it")
    notes = [
        "; ".join([f"the recording lasts {stop - start:.3g} s, from {start:.6g} to {stop:.6g} s", ", ".join(outside)])
        if outside
        else f"the recording lasts {stop - start:.3g} s, from {start:.6g} to {stop:.6g} s"
    ]
    length = stop - start
    for stream in within:
        assert stream.first is not None  # by the selection above
        assert stream.last is not None
        late, early = stream.first - start, stop - stream.last
        if max(late, early) > max(0.1 * length, settings.hole / (stream.rate or 1.0)):
            notes.append(
                f"{stream.label or 'the table'} covers only {max(stream.first, start):.6g} to "
                f"{min(stream.last, stop):.6g} s of it"
            )
    return notes


def _common_span(streams: list[ListedStream], span: Span) -> tuple[float, float]:
    """From the first to the last sample of streams with many samples, without stray stamps."""
    starts = [s.first for s in streams if s.first is not None and s.first >= span.start]
    stops = [s.last for s in streams if s.last is not None and s.last <= span.stop]
    return (min(starts), max(stops)) if starts and stops else (span.start, span.stop)


def _begun(stream: Stream) -> list[int]:
    """Sample numbers, from 1, at which the recorder restarted; a message may occur in one of its runs only."""
    return [] if stream.boots is None else (np.flatnonzero(np.diff(stream.boots)) + 2).tolist()


def _restart_notes(recording: Recording) -> list[str]:
    """One sentence on the restarts of the recorder within the file."""
    begun = {stream.label or "the table": at for stream in recording.streams if (at := _begun(stream))}
    if not begun:
        return []
    runs = 1 + max(map(len, begun.values()))
    named = [f"{label} at sample {', '.join(map(str, at))}" for label, at in begun.items()]
    more = f" and {len(named) - _NAMED} streams more" if len(named) > _NAMED else ""
    return [f"the recorder restarted within the file ({runs} runs): {', '.join(named[:_NAMED])}{more}"]


def _stream_notes(stream: Stream, listed: ListedStream, clock: Clock | None) -> list[str]:
    label = stream.label or "the table"
    notes = []
    if listed.problem and clock is not None:
        others = [other.name for other in stream.clocks[1:] if unusable(other) is None]
        way = f"; a map may name {' or '.join(others)} as its `clock`" if others else ""
        notes.append(f"{label} cannot be used: {listed.problem}{way}")
    elif clock is not None:
        back = back_steps(clock.ticks)
        if back.size and not _begun(stream):
            notes.append(f"{label}: {back.size} of {clock.ticks.size} stamps step back; they are sorted for use")
        repeated = int(np.count_nonzero(np.diff(clock.ticks) == 0))
        if repeated:
            resolution = float(np.min(np.diff(np.unique(clock.ticks)))) * clock.tick
            notes.append(
                f"{label}: {repeated} of {clock.ticks.size} stamps repeat the one before, their resolution is "
                f"{resolution:.3g} s"
            )
    return notes
