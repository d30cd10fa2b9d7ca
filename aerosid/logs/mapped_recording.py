"""Conversion of a recording of several streams to a log by a channel map: which column, which stamps, which unit."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np

from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.column_lookup import LookupProblem, find_column
from aerosid.logs.flight_log import ChannelSource
from aerosid.logs.formats.assembly import Assembled, Place, derive, glossary_factor, held_unit, initialised, scaled
from aerosid.logs.formats.channel_map import ChannelColumnMap, ChannelMap
from aerosid.logs.raster import DEFAULTS, RasterSettings, Track, onto_one_raster
from aerosid.logs.recording import TICKS, Clock, FloatArray, IntArray, Recording, Stream, as_floats
from aerosid.logs.settings import READING
from aerosid.logs.stamps import back_steps, flight_span, spread_repeats, unusable
from aerosid.logs.stream_alignment import MappedChannel, align_streams, unaligned_streams

_WHOLE_CLOCK = ("HH:MM:SS", "H:M:S", "DDD:HH:MM:SS")  # units of a time that is given as text


class _Unusable(ValueError):
    """A stream whose stamps are unusable; the message is a clause."""


def map_recording(
    recording: Recording, mapping: ChannelMap, place: Place, settings: RasterSettings = DEFAULTS
) -> list[Assembled]:
    """The segments between gaps, in order of time, each with all channels of the map on one raster.

    Parameters
    ----------
    recording : Recording
        As the recorder made it.
    mapping : ChannelMap
        Meaning of its columns.
    place : Place
        The two files, for messages.
    settings : RasterSettings
        Limits of resampling.

    Raises
    ------
    ChannelMapError
        If a column does not exist, or a unit is missing or does not convert.
    LogError
        If stamps are unusable, channels do not overlap, or no stretch without a gap is long enough.
    """
    notes = list(recording.notes)
    channels = [
        channel
        for name, alternatives in mapping.channels.items()
        if (channel := _first_usable(recording, mapping, name, alternatives, place, notes)) is not None
    ]
    if not channels:
        raise ChannelMapError(f"{place.map}: {place.log} holds none of the channels that the map names; correct it.")
    origin = _origin(channels)
    notes += _start_notes(recording, origin)
    boot = _longest_boot(channels, notes)
    for channel in channels:
        channel.time = _on_log_clock(channel, origin)
        _order(channel, boot, notes)
    _trim_strays(recording, channels, origin, notes)
    notes += align_streams(channels, mapping, place)
    notes += unaligned_streams(channels, mapping)
    tracks = [Track(channel.name, channel.time, channel.values, channel.held) for channel in channels]
    drops = tuple((at - origin, length) for at, length in recording.drop_outs)
    segments, raster_notes = onto_one_raster(tracks, drops, mapping.raster, place.log, settings)
    notes = _grouped([*notes, *raster_notes], tuple(mapping.channels))
    return [_assembled(segment.time, segment.channels, channels, mapping, place, notes) for segment in segments]


def _grouped(notes: list[str], names: tuple[str, ...]) -> list[str]:
    """Notes with the same text on several channels merged into one, in the order of the first."""
    subjects: dict[str, list[str]] = {}
    for note in notes:
        name, mark, text = note.partition(": ")
        known = bool(mark) and name in names
        subjects.setdefault(text if known else note, []).extend([name] if known else [])
    return [f"{', '.join(dict.fromkeys(grouped))}: {text}" if grouped else text for text, grouped in subjects.items()]


def _assembled(
    time: FloatArray,
    values: dict[str, FloatArray],
    channels: list[MappedChannel],
    mapping: ChannelMap,
    place: Place,
    notes: list[str],
) -> Assembled:
    log = Assembled(time, notes=list(notes))
    clock = channels[0].clock
    log.sources["time"] = ChannelSource((clock.name,), next((u for u, s in TICKS.items() if s == clock.tick), "s"))
    for channel in channels:
        entry = channel.entry
        log.channels[channel.name] = values[channel.name]
        log.units[channel.name] = held_unit(channel.name, channel.unit)
        labels = tuple(found.label for found in channel.found)
        sign = float(entry.sign)
        log.sources[channel.name] = ChannelSource(labels, channel.unit, sign, entry.scale, entry.offset, entry.delay)
        if entry.position is not None:
            log.positions[channel.name] = entry.position
        for given, declared in ((entry.noise, log.noise), (entry.resolution, log.resolution)):
            if given is not None:
                declared[channel.name] = given * glossary_factor(channel.name, channel.unit)
    derive(log, mapping, place)
    return log


def _first_usable(
    recording: Recording,
    mapping: ChannelMap,
    name: str,
    alternatives: tuple[ChannelColumnMap, ...],
    place: Place,
    notes: list[str],
) -> MappedChannel | None:
    """The first alternative recorded on a usable clock; None where there is none and the channel is optional."""
    if name == "time":
        raise ChannelMapError(f"{place.map}: [channels] holds time; give it by the key `time` above [channels].")
    problem: Exception | None = None
    for entry in alternatives:
        try:
            channel = _channel(recording, mapping, name, entry, place)
        except LookupProblem as error:
            problem = problem or ChannelMapError(f"{place.map}: channel {name} of {place.log} {error}.")
        except _Unusable as error:
            problem = LogError(f"{place.log}: {error}.")
        else:
            notes += _choice_notes(channel, len(alternatives) > 1)
            return channel
    assert problem is not None  # there is at least one alternative
    if not mapping.optional:
        raise problem
    reason = str(problem).split(": ", 1)[1] if isinstance(problem, LogError) else "not in the recording"
    notes.append(f"{name}: left out, {reason.rstrip('.')}")
    return None


def _choice_notes(channel: MappedChannel, of_several: bool) -> list[str]:
    name, notes = channel.name, []
    if of_several:
        notes.append(f"{name}: taken from {' + '.join(found.label for found in channel.found)}")
    notes += [
        f"{name}: {found.label} is used; the recording also holds {', '.join(found.others)}"
        for found in channel.found
        if found.others
    ]
    notes += _stamp_notes(channel)
    if channel.entry.note is not None:
        notes.append(f"{name}: {channel.entry.note}")
    return notes


def _channel(
    recording: Recording, mapping: ChannelMap, name: str, entry: ChannelColumnMap, place: Place
) -> MappedChannel:
    found = tuple(find_column(recording, column) for column in entry.parts)
    stream = found[0].stream
    if any(one.stream is not stream for one in found):
        raise LookupProblem(
            f"sums columns of {', '.join(one.stream.label for one in found)}, which have stamps of their own"
        )
    clock = _clock(recording, mapping, entry, stream)
    reason = unusable(clock)
    if reason is not None:
        others = [other.name for other in stream.clocks if other is not clock]
        way = f", or name {' or '.join(others)} as `clock`" if others else ""
        raise _Unusable(f"{stream.label or 'the table'}, mapped as {name}: {reason}; leave the channel out{way}")
    units = {one.column.unit for one in found}
    unit = entry.unit if entry.unit is not None else units.pop() if len(units) == 1 else None
    if unit is None:
        raise ChannelMapError(
            f"{place.map}: channel {name} has no `unit`, and {place.log} gives none for {found[0].label}; add the unit."
        )
    raw = [np.asarray(one.column.load()) for one in found]
    held = entry.held or any(values.dtype.kind == "b" for values in raw)
    recorded = np.column_stack([as_floats(values) for values in raw])
    recorded = np.where(np.isfinite(recorded), recorded, np.nan)
    # Damaged bytes can give numbers whose product overflows; such a sample is missing.
    with np.errstate(all="ignore"):
        values = scaled(name, entry, initialised(name, recorded, []).sum(axis=1), unit, place)
    values = np.where(np.isfinite(values), values, np.nan)
    return MappedChannel(name, entry, found, clock, values, unit, held, np.empty(0))


def _clock(recording: Recording, mapping: ChannelMap, entry: ChannelColumnMap, stream: Stream) -> Clock:
    """The stamps of a channel: the map's column of time, the clock named in the map, or the stream's first clock."""
    wanted = entry.clock or mapping.clock
    if wanted is not None and (clock := stream.clock(wanted)) is not None:
        return clock
    if entry.clock is not None:
        found = ", ".join(clock.name for clock in stream.clocks) or "none"
        raise LookupProblem(f"names the clock {entry.clock!r}, but {stream.label or 'the table'} has {found}")
    given = entry.time or mapping.time
    if given is not None and given.column is not None:
        return _mapped_clock(recording, given.column, given.unit, given.sign * given.scale, given.offset, stream)
    clock = stream.clock()
    if clock is None:
        raise LookupProblem(
            f"has no stamps: {stream.label or 'the table'} does not say which column is its time; give it by the key "
            "`time`"
        )
    return clock


def _mapped_clock(
    recording: Recording, wanted: int | str, unit: str | None, factor: float, offset: float, stream: Stream
) -> Clock:
    """Stamps from a column, as integers where they are whole numbers of a tick."""
    if isinstance(wanted, str):
        name = stream.aliases.get(wanted, wanted)
        clock = stream.clock(name)
        if clock is not None and (unit in (None, *_WHOLE_CLOCK) or unit not in TICKS):
            return clock
    alone = Recording(recording.format, (stream,))
    found = find_column(alone, wanted)
    unit = unit or found.column.unit
    if unit not in TICKS:
        raise LookupProblem(
            f"has its time in {found.label} in {unit or 'no unit'}, but s, ms, us, ns or HH:MM:SS was expected; give it"
        )
    stamps = found.column.load()
    if stamps.dtype.kind in "iu" and factor == 1.0 and offset == 0.0:
        return Clock(found.name, stamps, TICKS[unit])
    return Clock(found.name, factor * stamps.astype(np.float64) + offset, TICKS[unit])


def _stamp_notes(channel: MappedChannel) -> list[str]:
    """Differences between the clocks of a stream, where they could matter."""
    stream, mine = channel.found[0].stream, channel.clock
    notes = []
    for other in stream.clocks:
        if other.name == mine.name or unusable(other) is not None or 2 * np.unique(other.ticks).size < other.ticks.size:
            continue
        late = other.seconds(other.ticks[0]) - mine.seconds(mine.ticks[0])
        jitter = float(late.max() - late.min())
        zero = float(other.ticks[0]) * other.tick - float(mine.ticks[0]) * mine.tick
        # Where two clocks show different times of day, only their relative drift is meaningful.
        if abs(zero) < READING.largest_delay and (abs(zero) > 0.0 or jitter > 0.0):
            late = late + zero
            middle = 1e3 * float(np.median(late))
            range_of = f"{1e3 * float(late.min()):.3g} to {1e3 * float(late.max()):.3g}"
            notes.append(
                f"{channel.name}: stamps are {mine.name}; {other.name} is later by {middle:.3g} ms ({range_of})"
            )
        elif jitter > READING.loose_stamps:
            drift = 1e6 * float(np.polynomial.polynomial.polyfit(mine.seconds(mine.ticks[0]), late, 1)[1])
            notes.append(
                f"{channel.name}: stamps are {mine.name}; {other.name} runs within {jitter:.3g} s of it and drifts by "
                f"{drift:.3g} ppm"
            )
    return notes


def _origin(channels: list[MappedChannel]) -> int:
    """Zero of the log's time on the recorder's clock, s: a whole second where stamps are dates, else 0."""
    first = min(float(channel.clock.ticks.min()) * channel.clock.tick for channel in channels)
    return int(first) if first > READING.dated else 0


def _start_notes(recording: Recording, origin: int) -> list[str]:
    if origin:
        zero = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=origin)
        return [f"time 0 is {zero:%Y-%m-%d %H:%M:%S} on the recorder's clock"]
    if recording.utc_of_zero is not None and recording.utc_of_zero.year > 1970:
        return [f"time 0 is {recording.utc_of_zero:%Y-%m-%d %H:%M:%S.%f} UTC"]
    return []


def _on_log_clock(channel: MappedChannel, origin: int) -> FloatArray:
    clock = channel.clock
    counts = origin * round(1.0 / clock.tick) if clock.tick < 1.0 else origin
    # The value at t is the recording at t + delay.
    return clock.seconds(counts) - channel.entry.delay


def _longest_boot(channels: list[MappedChannel], notes: list[str]) -> int | None:
    """The run of the recorder with the most samples, where it restarted within the file."""
    booted = [channel for channel in channels if channel.found[0].stream.boots is not None]
    if not booted:
        return None
    fullest = max(booted, key=lambda channel: channel.values.size)
    boots = _boots(fullest)
    counts = np.bincount(boots)
    longest = int(np.argmax(counts))
    stamps = fullest.clock.seconds()
    spans = [
        f"{stamps[boots == k].min():.6g} to {stamps[boots == k].max():.6g} s" for k in range(counts.size) if counts[k]
    ]
    others = ", ".join(span for k, span in enumerate(spans) if k != longest)
    notes.append(
        f"the clock restarts within the file: {counts.size} runs, the longest ({spans[longest]}) is used; the "
        f"others ({others}) overlap it in time and are left out"
    )
    return longest


def _boots(channel: MappedChannel) -> IntArray:
    boots = channel.found[0].stream.boots
    return np.zeros(channel.values.size, dtype=np.int64) if boots is None else boots


def _order(channel: MappedChannel, boot: int | None, notes: list[str]) -> None:
    """Samples of one run, in order of time, without repeated stamps."""
    if boot is not None:
        mine = _boots(channel) == boot
        channel.time, channel.values = channel.time[mine], channel.values[mine]
    back = back_steps(channel.time)
    if back.size:
        rank = np.argsort(channel.time, kind="stable")
        channel.time, channel.values = channel.time[rank], channel.values[rank]
        notes.append(f"{channel.name}: {back.size} steps back in the stamps; the samples are sorted, none is left out")
    if np.any(np.diff(channel.time) == 0.0):
        apart, note = spread_repeats(channel.time)
        if note is None:
            keep = np.concatenate([[True], np.diff(channel.time) > 0.0])
            note = f"{int(np.count_nonzero(~keep))} samples repeat a stamp, the first of each is used"
            apart, channel.values = channel.time[keep], channel.values[keep]
        channel.time = apart
        notes.append(f"{channel.name}: {note}")


def _trim_strays(recording: Recording, channels: list[MappedChannel], origin: int, notes: list[str]) -> None:
    """Removes samples stamped far outside the flight."""
    names = {channel.clock.name for channel in channels}
    stamps = []
    for stream in recording.streams:
        clock = next((clock for clock in stream.clocks if clock.name in names), None)
        if clock is not None and unusable(clock) is None:
            stamps.append(clock.seconds(origin * round(1.0 / clock.tick)))
    span = flight_span(stamps)
    if span is None or not (span.before or span.after):
        return
    notes.append(f"stamped outside the recording and left out: {span.after} after it, {span.before} long before it")
    for channel in channels:
        inside = (channel.time >= span.start - abs(channel.entry.delay)) & (
            channel.time <= span.stop + abs(channel.entry.delay)
        )
        channel.time, channel.values = channel.time[inside], channel.values[inside]
