"""Alignment of recorders' clocks: offset and drift between streams from a signal that both contain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.column_lookup import Found
from aerosid.logs.formats.assembly import Place
from aerosid.logs.formats.channel_map import ChannelColumnMap, ChannelMap
from aerosid.logs.recording import Clock, FloatArray
from aerosid.logs.settings import READING
from aerosid.nomenclature import CHANNELS
from aerosid.signals.clock_alignment import ClockFit, fit_clocks


@dataclass
class MappedChannel:
    """One channel of a map during its conversion to a log.

    Attributes
    ----------
    name : str
        The channel.
    entry : ChannelColumnMap
        Its entry in the map.
    found : tuple of Found
        Its columns, all of one stream.
    clock : Clock
        Its stamps as recorded.
    values : ndarray, shape (N,)
        In the log's unit; NaN where a sample is missing.
    unit : str
        As recorded.
    held : bool
        Whether a sample is held until the next.
    time : ndarray, shape (N,)
        Its stamps on the log's clock, s.
    """

    name: str
    entry: ChannelColumnMap
    found: tuple[Found, ...]
    clock: Clock
    values: FloatArray
    unit: str
    held: bool
    time: FloatArray


def align_streams(channels: list[MappedChannel], mapping: ChannelMap, place: Place) -> list[str]:
    """Converts the stamps of streams to the clocks of others, as required by the map; a sentence on each.

    Parameters
    ----------
    channels : list of MappedChannel
        Their `time` is changed in place.
    mapping : ChannelMap
        The `align` entry of the map.
    place : Place
        The two files, for messages.

    Raises
    ------
    ChannelMapError
        If a pair names no channel.
    LogError
        If the two do not show the same signal.
    """
    notes = []
    by_name = {channel.name: channel for channel in channels}
    for name, reference in mapping.align.items():
        lacking = [key for key in (name, reference) if key not in by_name]
        if lacking:
            raise ChannelMapError(
                f"{place.map}: [align] names {lacking[0]}, which is not a channel of the map; correct it."
            )
        moved, fixed = by_name[name], by_name[reference]
        fit = fit_clocks(*_finite(fixed), *_finite(moved))
        if fit is None:
            raise LogError(
                f"{place.log}: {name} and {reference} do not contain the same signal, so their clocks cannot be "
                "aligned; remove the pair from [align]."
            )
        notes.append(f"{_fit_note(name, reference, fit)}; both are removed")
        for channel in channels:
            if channel.found[0].stream is moved.found[0].stream:
                channel.time = fit.first(channel.time)
    return notes


def unaligned_streams(channels: list[MappedChannel], mapping: ChannelMap) -> list[str]:
    """Relative drift of clocks of streams of one quantity, `q` and `q_logger`, not aligned by the map, as sentences."""
    notes = []
    by_name = {channel.name: channel for channel in channels}
    for name, other in by_name.items():
        reference = by_name.get(name.rpartition("_")[0])
        if reference is None or name in CHANNELS or name in mapping.align:
            continue
        if reference.name not in CHANNELS or reference.found[0].stream is other.found[0].stream:
            continue
        fit = fit_clocks(*_finite(reference), *_finite(other))
        if fit is not None and abs(fit.offset) > READING.clocks_apart * fit.offset_std:
            notes.append(
                f'{_fit_note(name, reference.name, fit)}; `{name} = "{reference.name}"` in [align] aligns them'
            )
    return notes


def _finite(channel: MappedChannel) -> tuple[FloatArray, FloatArray]:
    there = np.isfinite(channel.values)
    return channel.time[there], channel.values[there]


def _fit_note(name: str, reference: str, fit: ClockFit) -> str:
    return (
        f"the clock of {name} is ahead of that of {reference} by {fit.offset:.5g} +- {fit.offset_std:.2g} s at "
        f"{fit.at:.5g} s and gains {1e6 * fit.drift:.3g} +- {1e6 * fit.drift_std:.2g} ppm (correlation "
        f"{fit.correlation:.3f})"
    )
