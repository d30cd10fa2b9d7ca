"""IRIG 106 chapter 10 (.ch10, .c10), through pychapter10: experimental. Discretes and raw bus words."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.missing_library import library
from aerosid.logs.recording import Clock, Column, Recording, Stream, column

TICK = 1e-7
"""Format: s of one count: the relative time counter runs at 10 MHz."""

_COUNTER = (1 << 48) - 1
"""Format: largest count: the counter has 48 bits."""

_WORD = 4
"""Format: bytes of a discrete's state and of an ARINC 429 word."""


@dataclass
class _Collected:
    """The packets of one channel."""

    kind: str
    stamps: list[int] = field(default_factory=list)
    words: list[int] = field(default_factory=list)


def read_irig106(data: bytes, path: str) -> Recording:
    """The messages of a chapter 10 file on the recorder's relative time counter, one stream per channel.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If pychapter10 is not installed, or the file contains no packet.

    Notes
    -----
    Read are discretes (`bits`, and each bit by itself), ARINC 429 words (`word`, the label in its low eight bits) and
    MIL-STD-1553 messages (`command`, the command word). The meaning of a word is in no packet: the aircraft's own
    decoder has to be applied first. Packets of different channels need not be in order of time. Time packets give the
    day of the year without the year, so no absolute time is stated.
    """
    chapter10 = library("chapter10", path)
    channels: dict[str, _Collected] = {}
    counts: dict[str, int] = {}
    time_packets: list[tuple[int, datetime]] = []
    packets, stopped = _Collected("packet"), ""
    try:
        for packet in chapter10.C10(io.BytesIO(data)):
            kind = type(packet).__name__
            packets.stamps.append(int(packet.rtc))
            packets.words.append(int(packet.channel_id))
            label = f"{packet.channel_id}:{kind}"
            counts[label] = counts.get(label, 0) + 1
            if kind.startswith("Time"):
                time_packets.append((int(packet.rtc), packet.time))
            elif (reader := _READERS.get(kind)) is not None:
                reader(packet, channels.setdefault(label, _Collected(kind)))
    except Exception as error:  # noqa: BLE001  damaged bytes can raise any exception in pychapter10
        stopped = " ".join(str(error).split())[:80] or type(error).__name__
    if not packets.stamps:
        raise LogError(f"{path}: no chapter 10 packet was found; check that this is the right file.")
    notes = ["reading of IRIG 106 chapter 10 is experimental: discretes and undecoded bus words only"]
    if stopped:
        notes.append(f"reading stopped after {len(packets.stamps)} packets ({stopped}); the packets before are read")
    if time_packets:
        notes.append(
            f"{len(time_packets)} time packets give day {time_packets[0][1].timetuple().tm_yday} of an unnamed year"
        )
        notes.append(_drift(time_packets)) if len(time_packets) > 2 else None
    streams = [_stream(label, collected) for label, collected in channels.items() if collected.stamps]
    streams.append(_stream("packets", packets))
    return Recording("irig106", tuple(streams), tuple(notes), messages=len(packets.stamps), counts=counts)


def _drift(packets: list[tuple[int, datetime]]) -> str:
    """Rate of the counter relative to the time packets: slope of a straight line."""
    zero = packets[0][1].replace(tzinfo=UTC)
    absolute = np.array([(moment.replace(tzinfo=UTC) - zero) / timedelta(seconds=1) for _, moment in packets])
    counter = (np.array([count for count, _ in packets]) - packets[0][0]) * TICK
    slope = float(np.polynomial.polynomial.polyfit(absolute, counter, 1)[1])
    return f"the counter gains {(slope - 1.0) * 1e6:.1f} ppm on the time packets"


def _discrete(packet: Any, into: _Collected) -> None:
    for message in packet:
        into.stamps.append(int(message.ipts) & _COUNTER)
        into.words.append(int.from_bytes(message.data[:_WORD], "little"))


def _arinc429(packet: Any, into: _Collected) -> None:
    """Times of messages from gap times, which count from the preceding word of any bus, after the packet's stamp."""
    now = int(packet.rtc)
    for message in packet:
        now += int(message.gap_time)
        into.stamps.append(now)
        into.words.append(int.from_bytes(message.data[:_WORD], "little"))


def _mil1553(packet: Any, into: _Collected) -> None:
    for message in packet:
        into.stamps.append(int(message.ipts) & _COUNTER)
        into.words.append(int.from_bytes(message.data[:2], "little"))


_READERS: dict[str, Callable[[Any, _Collected], None]] = {
    "DiscreteF1": _discrete,
    "ARINC429F0": _arinc429,
    "MS1553F1": _mil1553,
}
_COLUMN = {"packet": "channel", "DiscreteF1": "bits", "ARINC429F0": "word", "MS1553F1": "command"}


def _stream(label: str, collected: _Collected) -> Stream:
    words = np.array(collected.words, dtype=np.int64)
    columns: dict[str, Column] = {_COLUMN[collected.kind]: column(words)}
    if collected.kind == "DiscreteF1":
        columns |= {f"bit {bit}": column((words >> bit) & 1) for bit in range(32) if np.any(words >> bit)}
    clock = Clock("relative time counter", np.array(collected.stamps, dtype=np.int64), TICK)
    return Stream(label, columns, (clock,))
