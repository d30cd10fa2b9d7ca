"""MAVLink telemetry logs (.tlog): messages by pymavlink's definitions, columns decoded with numpy."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from aerosid.compiled import njit
from aerosid.errors import LogError
from aerosid.logs.formats.missing_library import library
from aerosid.logs.recording import TICKS, AnyArray, Clock, Column, IntArray, Recording, Stream
from aerosid.logs.settings import READING
from aerosid.logs.stamps import boot_numbers

_DIALECT = "pymavlink.dialects.v20.ardupilotmega"  # includes the common messages and the autopilots' own
_STAMP = 8
"""Format: bytes of the stamp before each message: us since 1970, big-endian."""

_LONGEST = 255
"""Format: maximum number of bytes of a payload."""

_TYPES = {
    "int8_t": "<i1", "uint8_t": "<u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "char": "S1",
}  # fmt: skip
# Units as written in pymavlink's definitions, and as this package reads them.
_UNITS = {"degE7": "1e-7 deg", "cdeg": "cdeg", "rad/s": "rad/s", "mrad/s": "mrad/s", "mG": "mg", "degC": "degC"}
# Stamps in the messages, of the aircraft's own clock since its start; time_usec may also count since 1970.
_OWN = {"time_boot_ms": "ms", "time_usec": "us"}


def read_tlog(data: bytes, path: str) -> Recording:
    """The messages of a telemetry log, one stream per message and sender.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If pymavlink is not installed, or no complete message is found.

    Notes
    -----
    A message is valid where its checksum is right (X.25 with the definition's seed,
    https://mavlink.io/en/guide/serialization.html). The stamps of the file are the ground station's, on arrival; the
    aircraft's own stamp comes first where a message has one, otherwise the last one before the message.
    """
    dialect = library(_DIALECT, path)
    table = dialect.mavlink_map
    seeds = np.full(1 << 16, -1, dtype=np.int64)
    for number, message in table.items():
        if number < seeds.size:
            seeds[number] = message.crc_extra
    raw = np.frombuffer(data, dtype=np.uint8)
    found, skipped, over = _walked(raw, seeds)
    if found.shape[0] == 0:
        raise LogError(f"{path}: no whole MAVLink message was found; check that this is a telemetry log (.tlog).")
    arrival = _arrival(raw, found)
    vehicle = _vehicle(found)
    streams, counts = [], {}
    for kind in np.unique(found[:, 3]):
        message = table[int(kind)]
        here = np.flatnonzero(found[:, 3] == kind)
        counts[message.msgname] = int(here.size)
        for sender in np.unique(found[here, 4]):
            mine = here[found[here, 4] == sender]
            streams.append(_stream(raw, found, mine, arrival, message, int(sender), vehicle))
    notes = []
    if skipped:
        notes.append(f"{skipped} of {raw.size} bytes do not belong to a message and are skipped")
    if over:
        notes.append(f"the file ends inside a message ({over} bytes over); the complete part is read")
    streams = boot_numbers(_on_own_clock(streams), clocks=tuple(_OWN))
    senders = {f"{one >> 8}/{one & 0xFF}": int(np.count_nonzero(found[:, 4] == one)) for one in np.unique(found[:, 4])}
    if len(senders) > 1:
        notes.append(
            "several senders: "
            + ", ".join(f"{name} ({count} messages)" for name, count in senders.items())
            + f"; streams without a sender's number are those of {vehicle >> 8}/{vehicle & 0xFF}"
        )
    return Recording("tlog", tuple(streams), tuple(notes), (), None, int(found.shape[0]), counts)


@njit
def _index(raw: AnyArray, seeds: IntArray, found: IntArray) -> tuple[int, int, int]:
    """Rows (offset, start of payload, its length, message, sender); their number, bytes skipped, bytes left."""
    count, skipped, place, size = 0, 0, 0, raw.size
    while place + 17 <= size:
        mark = raw[place + 8]
        head = 0
        if mark == 0xFE:
            head, kind, sender = 6, int(raw[place + 13]), (int(raw[place + 11]) << 8) | int(raw[place + 12])
            signature = 0
        elif mark == 0xFD:
            kind = int(raw[place + 15]) | int(raw[place + 16]) << 8
            if place + 18 <= size:
                kind |= int(raw[place + 17]) << 16
            head, sender = 10, (int(raw[place + 13]) << 8) | int(raw[place + 14])
            signature = 13 if raw[place + 10] & 1 else 0
        length = int(raw[place + 9])
        if head == 0 or kind >= seeds.size or seeds[kind] < 0:
            place += 1
            skipped += 1
            continue
        end = place + 8 + head + length
        if end + 2 + signature > size:
            break
        crc = 0xFFFF
        for at in range(place + 9, end + 1):
            byte = int(raw[at]) if at < end else seeds[kind]
            byte = (byte ^ crc) & 0xFF
            byte = (byte ^ (byte << 4)) & 0xFF
            crc = (crc >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4)
        if (crc & 0xFFFF) != int(raw[end]) | int(raw[end + 1]) << 8:
            place += 1
            skipped += 1
            continue
        found[count, 0], found[count, 1], found[count, 2] = place, place + 8 + head, length
        found[count, 3], found[count, 4] = kind, sender
        count += 1
        place = end + 2 + signature
    return count, skipped, size - place


def _walked(raw: AnyArray, seeds: IntArray) -> tuple[IntArray, int, int]:
    found = np.empty((raw.size // 17 + 1, 5), dtype=np.int64)
    count, skipped, over = _index(raw, seeds, found)
    return found[:count].copy(), skipped, over


def _arrival(raw: AnyArray, found: IntArray) -> IntArray:
    """The ground station's stamps, us since 1970, shape (N,)."""
    windows = np.lib.stride_tricks.sliding_window_view(raw, _STAMP)
    return np.ascontiguousarray(windows[found[:, 0]]).view(">u8").ravel().astype(np.int64)


def _vehicle(found: IntArray) -> int:
    """The sender of most messages."""
    senders, counts = np.unique(found[:, 4], return_counts=True)
    return int(senders[np.argmax(counts)])


def _stream(
    raw: AnyArray, found: IntArray, mine: IntArray, arrival: IntArray, message: Any, sender: int, vehicle: int
) -> Stream:
    name = message.msgname if sender == vehicle else f"{sender >> 8}/{sender & 0xFF}:{message.msgname}"
    layout = _layout(message)
    clocks = [Clock("arrival", arrival[mine], TICKS["us"])]
    for field, unit in _OWN.items():
        if field in message.fieldnames:
            stamps = _field(raw, found, mine, layout, field, None).astype(np.int64)
            if stamps.max() * TICKS[unit] < READING.unix_clock:
                clocks.insert(0, Clock(field, stamps, TICKS[unit]))
    columns: dict[str, Column] = {}
    for field in message.fieldnames:
        kind, width = layout[field][0], layout[field][2]
        if kind == "S1" or field in _OWN:
            continue
        unit = message.fieldunits_by_name.get(field)
        for index in range(max(width, 1)):
            label = field if width == 0 else f"{field}[{index}]"
            load = partial(_field, raw, found, mine, layout, field, index if width else None)
            columns[label] = Column(load, unit)
    return Stream(name, columns, tuple(clocks), order=mine)


def _layout(message: Any) -> dict[str, tuple[str, int, int]]:
    """Type, place in the payload and number of elements (0: no array) of each field, in the order on the wire."""
    layout, place = {}, 0
    types = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    widths = message.array_lengths
    for name, width in zip(message.ordered_fieldnames, widths, strict=True):
        kind = _TYPES[types[name]]
        layout[name] = (kind, place, int(width))
        place += np.dtype(kind).itemsize * max(int(width), 1)
    return layout


def _field(
    raw: AnyArray,
    found: IntArray,
    mine: IntArray,
    layout: dict[str, tuple[str, int, int]],
    name: str,
    index: int | None,
) -> AnyArray:
    """One field of all messages of a stream; version 2 omits zeros at the end of a payload; shape (n,)."""
    kind, place, _ = layout[name]
    size = np.dtype(kind).itemsize
    place += size * (index or 0)
    starts, lengths = found[mine, 1], found[mine, 2]
    at = np.arange(size)
    there = place + at < lengths[:, None]
    source = np.minimum(starts[:, None] + place + at, raw.size - 1)
    return np.ascontiguousarray(np.where(there, raw[source], 0).astype(np.uint8)).view(kind).ravel()


def _on_own_clock(streams: list[Stream]) -> list[Stream]:
    """Stamps of the aircraft's messages without one of their own: the last one before them."""
    stamped = [s for s in streams if s.order is not None and s.clocks[0].name in _OWN and ":" not in s.name]
    if not stamped:
        return streams
    order = np.concatenate([s.order for s in stamped if s.order is not None])
    seconds = np.concatenate([s.clocks[0].seconds() for s in stamped])
    rank = np.argsort(order, kind="stable")
    # A message whose source is not running is sent with stamp 0.
    rank = rank[seconds[rank] > 0.0]
    order, seconds = order[rank], seconds[rank]
    moved = []
    for stream in streams:
        if stream.order is not None and stream.clocks[0].name not in _OWN and ":" not in stream.name:
            before = np.clip(np.searchsorted(order, stream.order) - 1, 0, None)
            own = Clock("last stamp before it", np.round(seconds[before] * 1e3).astype(np.int64), TICKS["ms"])
            stream = replace(stream, clocks=(own, *stream.clocks))
        moved.append(stream)
    return moved
