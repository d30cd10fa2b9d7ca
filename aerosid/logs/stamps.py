"""Time stamp faults: no clock, disorder, restarts, stray stamps far from the flight, gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.logs.recording import AnyArray, Clock, FloatArray, IntArray, Stream

_NAMED = 8
"""Display: gaps named in one sentence."""


@dataclass(frozen=True)
class StampSettings:
    """Limits of faulty stamps.

    Attributes
    ----------
    hole : float
        Median steps; a longer step cuts the record. From the issue's definition; ordinary jitter and one or two lost
        samples stay below, and longer gaps are never interpolated.
    restart : float
        s; a step back by more begins another run of the recorder where the stamps after it overlap those before.
        Messages of an EKF are up to 2.2 ms late, re-sent telemetry up to some tenths of a second.
    most_restarts : int
        More steps back than this are disorder: no recorder restarts so often.
    stray : float
        s without any sample between a message and the flight; a latched message older than the log or a wrong stamp is
        separated by so long a silence. Found on PX4's sample_log_small.ulg, which is no evidence for it.
    stray_share : float
        Fraction of all messages; a group of messages with fewer is stray.
    coarse_share : float
        Fraction of the stamps; where more repeat the preceding one, the clock is coarser than the sampling, otherwise a
        stamp is wrong.
    """

    hole: float = 5.0
    restart: float = 0.5
    stray: float = 5.0
    stray_share: float = 0.02
    most_restarts: int = 200
    coarse_share: float = 0.02


DEFAULTS = StampSettings()


def unusable(clock: Clock) -> str | None:
    """Why stamps are unusable, as a clause, or None where they are usable.

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
    """Indices of the samples stamped earlier than the preceding one."""
    return np.flatnonzero(ticks[1:] < ticks[:-1]).astype(np.int64) + 1


def restarts(seconds: FloatArray, settings: StampSettings = DEFAULTS) -> IntArray:
    """Indices at which the clock restarted, in contrast to a block of samples in another order.

    Parameters
    ----------
    seconds : ndarray, shape (N,)
        Stamps in the order of the file, s.

    Notes
    -----
    A block written late fits before or between the others without overlap, and is sorted. Two runs of a recorder
    overlap in time, and sorting would mix two flights.
    """
    back = np.flatnonzero(np.diff(seconds) < -settings.restart) + 1
    if back.size > settings.most_restarts:
        return np.empty(0, dtype=np.int64)
    found: list[int] = []
    start = 0
    for index, at in enumerate(back):
        end = int(back[index + 1]) if index + 1 < back.size else seconds.size
        before, after = seconds[start:at], seconds[at:end]
        # A single late sample among ordered ones is not a restart.
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
    """Whether no sample of the earlier part lies within the later part's span: then sorting mixes no runs."""
    ordered = np.sort(before)
    low, high = np.searchsorted(ordered, [after.min(), after.max()], side="left")
    return bool(low == high)


def boot_numbers(
    streams: list[Stream], settings: StampSettings = DEFAULTS, clocks: tuple[str, ...] = ()
) -> list[Stream]:
    """The streams, each sample with the number of the recorder's run it belongs to, where a clock restarted.

    Parameters
    ----------
    streams : list of Stream
        Of one recorder; where they are interleaved in the file, each with its `order`.
    settings : StampSettings
        Limits of a step back.
    clocks : tuple of str
        Names of the clocks that are considered; any, where empty.

    Notes
    -----
    The stream with the most samples determines the number of restarts and their approximate place. The cut is the first
    message of any stream that steps back as far, so that all streams are cut at one place of the file.
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
    assert order is not None  # selected above
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
    """The first place in (low, high] of a message stamped far earlier than those before it."""
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
        Fraction of repeated stamps from which on the clock is coarse.
    """
    first = np.flatnonzero(np.concatenate([[True], np.diff(seconds) > 0.0]))
    repeats = seconds.size - first.size
    if repeats < max(1.0, settings.coarse_share * seconds.size) or first.size < 3:
        return seconds, None
    resolution = float(np.min(np.diff(seconds[first])))
    count = np.diff(np.concatenate([first, [seconds.size]]))
    # The samples of a stamp do not extend into a gap after it.
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
    """The time span of a recording's samples, and the number of messages far outside it.

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
    """The span of the groups of messages that form the recording, without stray ones; None without stamps.

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
    # The median step counts: a recorder that writes every ten seconds is silent for as long between any two samples.
    silence = max(settings.stray, 4.0 * settings.hole * float(np.median(moving)) if moving.size else 0.0)
    cuts = np.flatnonzero(steps > silence) + 1
    groups = np.split(pooled, cuts)
    weighty = [group for group in groups if group.size >= settings.stray_share * pooled.size] or groups
    start, stop = float(weighty[0][0]), float(weighty[-1][-1])
    return Span(start, stop, int(np.count_nonzero(pooled < start)), int(np.count_nonzero(pooled > stop)))


def hole_notes(
    cuts: list[tuple[float, float]], segments: int, fewest: int, settings: StampSettings = DEFAULTS
) -> list[str]:
    """One sentence on the gaps that divide a record; empty where there are none.

    Parameters
    ----------
    cuts : list of (float, float)
        Start and end of each gap, s.
    segments, fewest : int
        Number of remaining stretches, and their least number of samples.
    settings : StampSettings
        Definition of a gap.
    """
    if not cuts:
        return []
    named = ", ".join(f"{high - low:.3g} s after {low:.6g} s" for low, high in cuts[:_NAMED])
    more = f" and {len(cuts) - _NAMED} more" if len(cuts) > _NAMED else ""
    count = "1 gap" if len(cuts) == 1 else f"{len(cuts)} gaps"
    left = "1 segment" if segments == 1 else f"{segments} segments"
    sentence = (
        f"{count} (steps of more than {settings.hole:g} medians, or the recorder's own mark) in the record, none "
        f"is interpolated: {named}{more}; {left} of {fewest} samples or more"
    )
    return [sentence]
