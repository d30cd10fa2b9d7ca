"""Time stamp faults: no clock, out of order, a restart, strays far from the flight, holes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.logs.recording import AnyArray, Clock, FloatArray, IntArray, Stream

_NAMED = 8
"""Display: holes in one sentence."""


@dataclass(frozen=True)
class StampSettings:
    """When stamps count as faulty.

    Attributes
    ----------
    hole : float
        Median steps; a longer step cuts the record. From the issue's definition; ordinary jitter and one or two lost
        samples stay below, and nothing is ever interpolated across more.
    restart : float
        s; a step back by more begins another run of the recorder where the stamps after it overlap those before.
        Messages of an EKF lie up to 2.2 ms back, re-sent telemetry up to some tenths of a second.
    most_restarts : int
        More steps back than this are disorder, and no recorder that was started so often.
    stray : float
        s without any sample between a message and the flight; a latched message older than the log or a wrong stamp
        stands alone behind so long a silence. Found on PX4's sample_log_small.ulg, which is no evidence for it.
    stray_share : float
        Of all messages; a group of messages with fewer is stray.
    coarse_share : float
        Of the stamps; where more repeat the one before, the clock is coarser than the sampling, and otherwise a stamp
        is wrong.
    """

    hole: float = 5.0
    restart: float = 0.5
    stray: float = 5.0
    stray_share: float = 0.02
    most_restarts: int = 200
    coarse_share: float = 0.02


DEFAULTS = StampSettings()


def unusable(clock: Clock) -> str | None:
    """Why stamps tell no time, as a clause, or None where they do.

    Parameters
    ----------
    clock : Clock
        Stamps of one stream, shape (N,).
    """
    ticks = clock.ticks
    if ticks.size == 0:
        return "it holds no sample"
    if ticks.dtype.kind == "f" and not np.isfinite(ticks).all():
        return f"{int(np.count_nonzero(~np.isfinite(ticks)))} of its {ticks.size} stamps ({clock.name}) are missing"
    if ticks.size > 1 and bool(np.all(ticks == ticks[0])):
        return f"all {ticks.size} stamps ({clock.name}) are {ticks[0]:.10g}, so it has no clock"
    return None


def back_steps(ticks: AnyArray) -> IntArray:
    """Indices of the samples stamped earlier than the one before them."""
    return np.flatnonzero(ticks[1:] < ticks[:-1]).astype(np.int64) + 1


def restarts(seconds: FloatArray, settings: StampSettings = DEFAULTS) -> IntArray:
    """Indices at which the clock began anew, rather than a block of samples lying in another order.

    Parameters
    ----------
    seconds : ndarray, shape (N,)
        Stamps in the order of the file, s.

    Notes
    -----
    A block that was written late fits before or between the others without overlap, and sorting mends it. Two runs of a
    recorder overlap in time, and sorting would mix two flights.
    """
    back = np.flatnonzero(np.diff(seconds) < -settings.restart) + 1
    if back.size > settings.most_restarts:
        return np.empty(0, dtype=np.int64)
    found: list[int] = []
    start = 0
    for index, at in enumerate(back):
        end = int(back[index + 1]) if index + 1 < back.size else seconds.size
        before, after = seconds[start:at], seconds[at:end]
        # One late sample among others in order is no restart.
        overlap = after.min() <= before.max() and after.max() >= before.min() and after.size > 1
        if (
            overlap
            and after.max() > seconds[at - 1] - (before.max() - before.min())
            and not _fits_between(before, after)
        ):
            found.append(int(at))
            start = int(at)
    return np.array(found, dtype=np.int64)


def _fits_between(before: FloatArray, after: FloatArray) -> bool:
    """Whether no sample of the earlier part lies within the later part's span: then sorting mixes nothing."""
    ordered = np.sort(before)
    low, high = np.searchsorted(ordered, [after.min(), after.max()], side="left")
    return bool(low == high)


def boot_numbers(
    streams: list[Stream], settings: StampSettings = DEFAULTS, clocks: tuple[str, ...] = ()
) -> list[Stream]:
    """The streams, each sample numbered by the recorder's start it belongs to, where a clock began anew.

    Parameters
    ----------
    streams : list of Stream
        Of one recorder; where they are interleaved in the file, each with its `order`.
    settings : StampSettings
        What counts as a step back.
    clocks : tuple of str
        Names of the clocks that may tell; any, where empty.

    Notes
    -----
    The stream with the most samples tells how often and about where. The cut is the first message of any stream that
    lies that far back, so that all streams are cut at one place of the file.
    """
    usable = [
        stream
        for stream in streams
        if (clock := stream.clock()) is not None
        and unusable(clock) is None
        and (not clocks or clock.name in clocks)
        and clock.ticks.min() != 0
    ]
    if not usable:
        return streams
    if any(stream.order is None for stream in usable):
        return [_own_boots(stream, settings) if stream in usable else stream for stream in streams]
    fullest = max(usable, key=lambda stream: stream.clocks[0].ticks.size)
    order = fullest.order
    assert order is not None  # looked at above
    at = restarts(fullest.clocks[0].seconds(), settings)
    if at.size == 0:
        return streams
    places = np.concatenate([stream.order for stream in usable if stream.order is not None])
    seconds = np.concatenate([stream.clocks[0].seconds() for stream in usable])
    rank = np.argsort(places, kind="stable")
    places, seconds = places[rank], seconds[rank]
    cuts = [_first_back(places, seconds, int(order[index - 1]), int(order[index]), settings) for index in at]
    return [
        stream if stream.order is None else replace(stream, boots=np.searchsorted(cuts, stream.order, side="right"))
        for stream in streams
    ]


def _first_back(places: IntArray, seconds: FloatArray, low: int, high: int, settings: StampSettings) -> int:
    """The first place in (low, high] of a message that is stamped far before those ahead of it."""
    first, last = np.searchsorted(places, [low, high], side="right")
    newest = float(np.median(seconds[max(first - 5, 0) : first]))
    between = np.flatnonzero(seconds[first:last] < newest - settings.restart)
    return int(places[first + between[0]]) if between.size else high


def _own_boots(stream: Stream, settings: StampSettings) -> Stream:
    at = restarts(stream.clocks[0].seconds(), settings)
    if at.size == 0:
        return stream
    boots = np.zeros(stream.clocks[0].ticks.size, dtype=np.int64)
    boots[at] = 1
    return replace(stream, boots=np.cumsum(boots))


def spread_repeats(seconds: FloatArray, settings: StampSettings = DEFAULTS) -> tuple[FloatArray, str | None]:
    """Stamps of a clock coarser than the sampling, spread evenly up to the next one, and a note; else as they are.

    Parameters
    ----------
    seconds : ndarray, shape (N,)
        Stamps, not decreasing, s.
    settings : StampSettings
        From which share of repeats on it is the clock.
    """
    first = np.flatnonzero(np.concatenate([[True], np.diff(seconds) > 0.0]))
    repeats = seconds.size - first.size
    if repeats < max(1.0, settings.coarse_share * seconds.size) or first.size < 3:
        return seconds, None
    resolution = float(np.min(np.diff(seconds[first])))
    count = np.diff(np.concatenate([first, [seconds.size]]))
    # A gap after the stamp is no time in which its samples lie.
    room = np.minimum(np.concatenate([np.diff(seconds[first]), [resolution]]), resolution)
    within = np.arange(seconds.size) - np.repeat(first, count)
    spread = seconds + within * np.repeat(room / count, count)
    note = (
        f"stamps have a resolution of {resolution:g} s and {repeats} of {seconds.size} repeat: samples of one stamp "
        f"are spread evenly over it, and no time is known better than to {resolution:g} s"
    )
    return spread, note


def holes(seconds: FloatArray, settings: StampSettings = DEFAULTS) -> NDArray[np.float64]:
    """Start and end, s, of each step longer than `settings.hole` medians; shape (n, 2).

    Parameters
    ----------
    seconds : ndarray, shape (N,)
        Stamps, not decreasing, s.
    """
    if seconds.size < 3:
        return np.empty((0, 2))
    steps = np.diff(seconds)
    moving = steps[steps > 0.0]
    if moving.size == 0:
        return np.empty((0, 2))
    at = np.flatnonzero(steps > settings.hole * float(np.median(moving)))
    return np.column_stack([seconds[at], seconds[at + 1]])


@dataclass(frozen=True)
class Span:
    """The time in which a recording's samples lie, and how many messages stand far outside.

    Attributes
    ----------
    start, stop : float
        s on the recorder's clock.
    before, after : int
        Messages far before and after it.
    """

    start: float
    stop: float
    before: int
    after: int


def flight_span(stamps: list[FloatArray], settings: StampSettings = DEFAULTS) -> Span | None:
    """The span of the groups of messages that make up the recording, stray ones left out; None without stamps.

    Parameters
    ----------
    stamps : list of ndarray
        Each stream's stamps, s, on one clock.
    """
    pooled = np.sort(np.concatenate([each for each in stamps if each.size] or [np.empty(0)]))
    if pooled.size == 0:
        return None
    steps = np.diff(pooled)
    moving = steps[steps > 0.0]
    # A recorder that writes every ten seconds is silent for as long between any two samples.
    silence = max(settings.stray, 4.0 * settings.hole * float(np.median(moving)) if moving.size else 0.0)
    cuts = np.flatnonzero(steps > silence) + 1
    groups = np.split(pooled, cuts)
    weighty = [group for group in groups if group.size >= settings.stray_share * pooled.size] or groups
    start, stop = float(weighty[0][0]), float(weighty[-1][-1])
    return Span(start, stop, int(np.count_nonzero(pooled < start)), int(np.count_nonzero(pooled > stop)))


def hole_notes(
    cuts: list[tuple[float, float]], segments: int, fewest: int, settings: StampSettings = DEFAULTS
) -> list[str]:
    """One sentence on the holes that cut a record; none where there are none.

    Parameters
    ----------
    cuts : list of (float, float)
        Start and end of each hole, s.
    segments, fewest : int
        How many stretches are left, of at least how many samples.
    settings : StampSettings
        What a hole is.
    """
    if not cuts:
        return []
    named = ", ".join(f"{high - low:.3g} s after {low:.6g} s" for low, high in cuts[:_NAMED])
    more = f" and {len(cuts) - _NAMED} more" if len(cuts) > _NAMED else ""
    count = "1 hole" if len(cuts) == 1 else f"{len(cuts)} holes"
    left = "1 segment" if segments == 1 else f"{segments} segments"
    sentence = (
        f"{count} (steps of more than {settings.hole:g} medians, or the recorder's own mark) in the record, none "
        f"is interpolated: {named}{more}; {left} of {fewest} samples or more"
    )
    return [sentence]
