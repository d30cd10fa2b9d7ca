"""PX4 ULog (.ulg), through pyulog: one stream per topic and instance."""

from __future__ import annotations

import contextlib
import io
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.recording import TICKS, Clock, Column, Recording, Stream, column

MAGIC = b"ULog\x01\x12\x35"
_TYPES = frozenset(b"FDIMPQARSOLCB")
_FILLING = "_padding"  # alignment bytes of a message
_HEADER = 16
"""Format: bytes before the first message."""

_CHAIN = 6
"""Format: consecutive valid messages after which a chance match of a type's letter is excluded."""

# PX4's own clocks: first the time of the sensor's sample, then the time of publication.
_CLOCKS = ("timestamp_sample", "timestamp")
_FIX_3D = 3
"""Format: lowest type of a GPS fix with valid position and time."""

_NO_CLOCK_BEFORE = 946_684_800_000_000
"""Format: us since 1970 of 2000-01-01: a receiver without a fix gives 1970 or 1980."""


def read_ulog(data: bytes, path: str) -> Recording:
    """The topics of a ULog file.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If the file is not a ULog file, or contains no topic.

    Notes
    -----
    pyulog stops silently where a file is truncated and skips damage silently; both are located here by following the
    messages' headers (https://docs.px4.io/main/en/dev_log/ulog_file_format.html).
    """
    import pyulog
    from pyulog.exceptions import ULogException

    if not data.startswith(MAGIC):
        raise LogError(f"{path}: the file does not start as a ULog file does; check that it is the right file.")
    try:
        # pyulog prints its warnings on a damaged file to stdout.
        with contextlib.redirect_stdout(io.StringIO()):
            log = pyulog.ULog(io.BytesIO(data))
    except (ULogException, ValueError, KeyError, IndexError, TypeError, OverflowError) as error:
        detail = " ".join(str(error).split())[:80] or type(error).__name__
        raise LogError(f"{path}: the ULog file is damaged ({detail}); download it from the aircraft again.") from None
    if not log.data_list:
        raise LogError(f"{path}: the ULog file holds no topic; the aircraft logged nothing, or the file is cut off.")
    if unstamped := [topic.name for topic in log.data_list if "timestamp" not in topic.data]:
        # pyulog stops at its first sample, so that those of other topics are missing too.
        raise LogError(
            f"{path}: the ULog file is damaged (topic {ascii(unstamped[0])[1:-1]} has no field timestamp, which every "
            "topic has); download it from the aircraft again."
        )
    # pyulog measures a drop-out's length in ms from the last stamp before it.
    drops = tuple((drop.timestamp * TICKS["us"], drop.duration * TICKS["ms"]) for drop in log.dropouts)
    return Recording(
        "ulog",
        tuple(_stream(topic) for topic in log.data_list),
        tuple(_framing_notes(data)),
        drops,
        _utc_of_zero(log.data_list),
        counts={f"{topic.name}[{topic.multi_id}]": len(topic.data["timestamp"]) for topic in log.data_list},
    )


def _stream(topic: Any) -> Stream:
    clocks = tuple(Clock(name, topic.data[name], TICKS["us"]) for name in _CLOCKS if name in topic.data)
    columns: dict[str, Column] = {
        name: column(values) for name, values in topic.data.items() if name not in _CLOCKS and _FILLING not in name
    }
    return Stream(topic.name, columns, clocks, topic.multi_id)


def _framing_notes(data: bytes) -> list[str]:
    """Offsets at which the chain of messages breaks, and whether the last message is complete."""
    notes = []
    position, size = _HEADER, len(data)
    while position + 3 <= size:
        length, kind = data[position] | data[position + 1] << 8, data[position + 2]
        if kind not in _TYPES:
            again = _next_chain(data, position + 1)
            notes.append(
                f"the file is damaged at byte {position}: {again - position} bytes are skipped, and what they held is "
                "lost"
            )
            position = again
            continue
        if position + 3 + length > size:
            break
        position += 3 + length
    if position < size:
        notes.append(
            f"the file ends inside a message ({size - position} bytes over): the recording was cut off; the "
            "complete part is read"
        )
    return notes


def _next_chain(data: bytes, start: int) -> int:
    """The next offset at which several messages follow each other; the file's length where there is none."""
    size = len(data)
    for position in range(start, size - 3):
        if data[position + 2] in _TYPES and _chained(data, position):
            return position
    return size


def _chained(data: bytes, position: int) -> bool:
    size = len(data)
    for _ in range(_CHAIN):
        if position + 3 > size:
            return position == size
        length = data[position] | data[position + 1] << 8
        if data[position + 2] not in _TYPES or length == 0:
            return False
        position += 3 + length
    return position <= size


def _utc_of_zero(topics: list[Any]) -> datetime | None:
    """Absolute time at zero of the autopilot's clock, from the first fix in three dimensions."""
    for topic in topics:
        fields = topic.data
        if topic.name not in ("vehicle_gps_position", "sensor_gps") or "time_utc_usec" not in fields:
            continue
        fixed = np.flatnonzero(
            (fields["fix_type"] >= _FIX_3D) & (fields["time_utc_usec"].astype(np.int64) > _NO_CLOCK_BEFORE)
        )
        if fixed.size:
            zero = int(fields["time_utc_usec"][fixed[0]]) - int(fields["timestamp"][fixed[0]])
            return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=zero)
    return None
