"""LabVIEW TDMS (.tdms), through npTDMS: each channel as `group/channel`, with its own start and rate."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from typing import Any

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.damaged_columns import guarded
from aerosid.logs.formats.missing_library import library
from aerosid.logs.recording import AnyArray, Clock, Recording, Stream

MAGIC = b"TDSm"
_NO_START = np.datetime64("1904-01-02")  # LabVIEW's zero: the channel has no start time


def read_tdms(data: bytes, path: str) -> Recording:
    """The numeric channels of a TDMS file.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If npTDMS is not installed, or the file cannot be read or contains no numeric channel.

    Notes
    -----
    Channels of equal group, length, start and rate form one stream. A channel without a rate among its properties
    (`wf_increment`) has no clock: the channel map has to give it, it is not guessed.
    """
    nptdms = library("nptdms", path)
    if not data.startswith(MAGIC):
        raise LogError(f"{path}: the file does not start as a TDMS file does; check that it is the right file.")
    with _warnings_kept() as warnings:
        try:
            file = nptdms.TdmsFile.open(io.BytesIO(data))
            channels = [channel for group in file.groups() for channel in group.channels() if len(channel)]
        except Exception as error:  # noqa: BLE001  damaged bytes can raise any exception in npTDMS
            detail = " ".join(str(error).split())[:80] or type(error).__name__
            raise LogError(f"{path}: the TDMS file is damaged or truncated ({detail}); copy it again.") from None
    streams, start = _streams(channels, path)
    if not streams:
        raise LogError(f"{path}: no channel holds numbers; check that this is the right file.")
    notes = []
    if warnings or _lengths_differ(channels):
        notes.append("the file ends inside a segment: the recording was cut off; the complete part is read")
    return Recording("tdms", tuple(streams), tuple(notes), (), start)


@contextmanager
def _warnings_kept() -> Iterator[list[str]]:
    """The warnings that npTDMS would write to stderr, as a list; those while samples are read later are dropped."""
    kept: list[str] = []

    class Keeper(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            kept.append(record.getMessage())

    keeper = Keeper()
    loggers = [logging.getLogger(name) for name in logging.root.manager.loggerDict if name.startswith("nptdms")]
    for logger in loggers:
        logger.handlers, logger.propagate = [keeper], False
    try:
        yield kept
    finally:
        for logger in loggers:
            logger.handlers = [logging.NullHandler()]


def _lengths_differ(channels: list[Any]) -> bool:
    """Whether channels of one group written together differ in their numbers of samples."""
    seen: dict[tuple[str, str], set[int]] = {}
    for channel in channels:
        rate = (channel.group_name, str(channel.properties.get("wf_increment")))
        seen.setdefault(rate, set()).add(len(channel))
    return any(len(lengths) > 1 for lengths in seen.values())


def _streams(channels: list[Any], path: str) -> tuple[list[Stream], datetime | None]:
    numeric = [channel for channel in channels if channel.dtype.kind in "fiub"]
    starts = {channel.path: _start(channel) for channel in numeric}
    known = [start for start in starts.values() if start is not None]
    first = min(known) if known else None
    groups: dict[tuple[Any, ...], list[Any]] = {}
    for channel in numeric:
        increment = channel.properties.get("wf_increment")
        offset = channel.properties.get("wf_start_offset", 0.0)
        groups.setdefault((channel.group_name, len(channel), starts[channel.path], increment, offset), []).append(
            channel
        )
    streams = []
    for (group, length, start, increment, offset), members in groups.items():
        clocks: tuple[Clock, ...] = ()
        if increment:
            late = 0.0 if start is None or first is None else float((start - first) / np.timedelta64(1, "us")) * 1e-6
            seconds = late + float(offset or 0.0) + np.arange(length) * float(increment)
            clocks = (Clock("wf_increment", seconds, 1.0),)
        columns = {member.name: guarded(partial(_load, member), path, member.name, _unit(member)) for member in members}
        streams.append(Stream(group, columns, clocks))
    return streams, None if first is None else _utc(first)


def _start(channel: Any) -> np.datetime64 | None:
    start = channel.properties.get("wf_start_time")
    return None if start is None or start < _NO_START else np.datetime64(start, "us")


def _utc(start: np.datetime64) -> datetime:
    return start.astype(datetime).replace(tzinfo=UTC)  # type: ignore[no-any-return]


def _unit(channel: Any) -> str | None:
    return str(channel.properties["unit_string"]) if channel.properties.get("unit_string") else None


def _load(channel: Any) -> AnyArray:
    return np.asarray(channel[:])
