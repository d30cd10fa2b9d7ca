"""ArduPilot DataFlash logs (.bin): self-describing messages, columns decoded with numpy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from typing import Any

import numpy as np

from aerosid.compiled import njit
from aerosid.errors import LogError
from aerosid.logs.gps_time import utc_of_gps
from aerosid.logs.recording import TICKS, AnyArray, Clock, Column, FloatArray, IntArray, Recording, Stream
from aerosid.logs.stamps import boot_numbers

MAGIC = b"\xa3\x95\x80"
_HEAD_LENGTH = 3
"""Format: first bytes of each message: two marks and its type."""

_FMT = 128
"""Format: type of the message that declares the other types."""

_FMT_LENGTH = 89
"""Format: bytes of that message."""

# The format of this message is assumed: some files contain its declaration late or never.
FMT_FIELDS = ("Type", "Length", "Name", "Format", "Columns")
# Letter of a field: its numpy type and the divisor implied by the letter. Division, because 250/100 is 2.5
# and 250*0.01 is not. (https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html)
_LETTERS: dict[str, tuple[str, float]] = {
    "a": ("64V", 1.0), "b": ("<i1", 1.0), "B": ("<u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0), "i": ("<i4", 1.0),
    "I": ("<u4", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0), "g": ("<f2", 1.0), "n": ("S4", 1.0), "N": ("S16", 1.0),
    "Z": ("S64", 1.0), "c": ("<i2", 1e2), "C": ("<u2", 1e2), "e": ("<i4", 1e2), "E": ("<u4", 1e2), "L": ("<i4", 1e7),
    "M": ("<u1", 1.0), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
}  # fmt: skip
_SCALED = "cCeEL"
# Fields that hold stamps, the sample's own first.
_STAMPS = {"SampleUS": "us", "TimeUS": "us", "TimeMS": "ms"}
_INSTANCE_UNIT = "#"
_NO_MULTIPLIER = "-?"
BOOKKEEPING = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG")
_FIX_3D = 3
"""Format: status of a GPS message from which on position and time are fixed."""


@dataclass
class MessageFormat:
    """Declaration of a message type (FMT)."""

    name: str
    length: int
    letters: str
    fields: tuple[str, ...]

    def layout(self) -> np.dtype[Any]:
        """The message's body as a packed numpy record."""
        return np.dtype([(name, _LETTERS[letter][0]) for name, letter in zip(self.fields, self.letters, strict=True)])

    @property
    def sound(self) -> bool:
        """Whether letters, fields and length are consistent."""
        known = all(letter in _LETTERS for letter in self.letters)
        unique = len(set(self.fields)) == len(self.fields) == len(self.letters)
        return known and unique and self.layout().itemsize == self.length - _HEAD_LENGTH


@dataclass
class _Described:
    """Contents of FMTU, UNIT and MULT: by type, the letters of its fields' units and multipliers."""

    units: dict[str, str] = field(default_factory=dict)
    multipliers: dict[str, float] = field(default_factory=dict)
    letters: dict[int, tuple[str, str]] = field(default_factory=dict)


def read_dataflash(data: bytes, path: str) -> Recording:
    """The messages of a binary DataFlash log, one stream per type and instance.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If it contains no message of a declared type, or those that give units are damaged.

    Notes
    -----
    A message is read with the last declaration before it. After damaged bytes, reading continues at the next header
    of a declared type. A field is raw * multiplier in its unit; letters with a divisor are already scaled. Stamps are
    not sorted across types: the EKF's are those of the data that it used.
    """
    raw = np.frombuffer(data, dtype=np.uint8)
    positions, kinds, skipped, unknown = _walk(raw)
    formats = _formats(raw, positions, kinds)
    if positions.size == 0 or all(kind == _FMT for kind in np.unique(kinds)):
        raise LogError(
            f"{path}: no message of this DataFlash log is described; download the log from the aircraft again."
        )
    described = _descriptions(raw, positions, kinds, formats, path)
    streams, counts, unsound = _streams(raw, positions, kinds, formats, described)
    notes = _notes(skipped, unknown, int(positions.size), raw.size, unsound)
    return finished_recording("dataflash", streams, counts, notes)


@njit
def _index(
    raw: AnyArray, lengths: IntArray, positions: IntArray, kinds: AnyArray, unknown: IntArray
) -> tuple[int, int, int]:
    """Positions and types of all messages; returns their number, the bytes skipped, and the bytes left at the end."""
    count, skipped, place, size = 0, 0, 0, raw.size
    while place + 3 <= size:
        kind = raw[place + 2]
        if raw[place] != 0xA3 or raw[place + 1] != 0x95:
            place += 1
            skipped += 1
            continue
        length = lengths[kind]
        if length == 0:
            unknown[kind] += 1
            place += 1
            skipped += 1
            continue
        if place + length > size:
            break
        positions[count] = place
        kinds[count] = kind
        count += 1
        if kind == 128:
            lengths[raw[place + 3]] = raw[place + 4]
        place += length
    return count, skipped, size - place


def _walk(raw: AnyArray) -> tuple[IntArray, AnyArray, tuple[int, int], IntArray]:
    lengths = np.zeros(256, dtype=np.int64)
    lengths[_FMT] = _FMT_LENGTH
    room = raw.size // _HEAD_LENGTH + 1
    positions, kinds = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.uint8)
    unknown = np.zeros(256, dtype=np.int64)
    count, skipped, over = _index(raw, lengths, positions, kinds, unknown)
    return positions[:count].copy(), kinds[:count].copy(), (skipped, over), unknown


def _gathered(raw: AnyArray, positions: IntArray, start: int, size: int) -> AnyArray:
    """`size` bytes, `start` bytes after each position, shape (n, size)."""
    windows = np.lib.stride_tricks.sliding_window_view(raw, size)
    return np.ascontiguousarray(windows[positions + start])


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("latin-1").strip()


def _formats(raw: AnyArray, positions: IntArray, kinds: AnyArray) -> dict[int, MessageFormat]:
    found: dict[int, MessageFormat] = {_FMT: MessageFormat("FMT", _FMT_LENGTH, "BBnNZ", FMT_FIELDS)}
    for place in positions[kinds == _FMT]:
        body = raw[place + _HEAD_LENGTH : place + _FMT_LENGTH].tobytes()
        fields = tuple(name for name in _text(body[22:86]).split(",") if name)
        found[body[0]] = MessageFormat(_text(body[2:6]), body[1], _text(body[6:22]), fields)
    return found


def _records(raw: AnyArray, positions: IntArray, form: MessageFormat) -> AnyArray:
    layout = form.layout()
    return _gathered(raw, positions, _HEAD_LENGTH, layout.itemsize).view(layout).ravel()


def _descriptions(
    raw: AnyArray, positions: IntArray, kinds: AnyArray, formats: dict[int, MessageFormat], path: str
) -> _Described:
    described = _Described()
    for kind, form in formats.items():
        here = positions[kinds == kind]
        if form.name not in ("FMTU", "UNIT", "MULT") or not form.sound or here.size == 0:
            continue
        try:
            for record in _records(raw, here, form):
                _describe(described, form, record)
        except (ValueError, TypeError) as error:
            # Without them the numbers of other messages would be read in wrong units.
            raise LogError(
                f"{path}: message {form.name}, which gives the units of the others, does not have the fields that it "
                f"has in a DataFlash log ({error}); download the log from the aircraft again."
            ) from None
    return described


def _describe(described: _Described, form: MessageFormat, record: Any) -> None:
    if form.name == "UNIT":
        described.units[chr(int(record["Id"]) & 0xFF)] = _text(bytes(record["Label"]))
    elif form.name == "MULT":
        # Stored as a double with the value of a single: 0.009999999776482582 stands for 0.01.
        described.multipliers[chr(int(record["Id"]) & 0xFF)] = float(f"{record['Mult']:.7g}")
    else:
        described.letters[int(record["FmtType"])] = (_text(bytes(record["UnitIds"])), _text(bytes(record["MultIds"])))


def _streams(
    raw: AnyArray, positions: IntArray, kinds: AnyArray, formats: dict[int, MessageFormat], described: _Described
) -> tuple[list[Stream], dict[str, int], list[str]]:
    streams: list[Stream] = []
    counts: dict[str, int] = {}
    unsound: list[str] = []
    for kind, form in formats.items():
        here = positions[kinds == kind]
        if here.size == 0:
            continue
        counts[form.name] = counts.get(form.name, 0) + int(here.size)
        if form.name in BOOKKEEPING:
            continue
        if not form.sound:
            unsound.append(form.name)
        else:
            streams += _split_instances(raw, here, form, *described.letters.get(kind, ("", "")), described)
    return streams, counts, unsound


def _split_instances(
    raw: AnyArray, here: IntArray, form: MessageFormat, units: str, multipliers: str, described: _Described
) -> Iterator[Stream]:
    """A stream for each sender of one message; none where the message has no stamp."""
    stamps = list(stamp_fields(form.name, form.fields))
    if not stamps:
        return
    at = units.find(_INSTANCE_UNIT)
    which = None
    if 0 <= at < len(form.fields) and form.letters[at] in "bBhHiIM":
        which = _field(raw, here, form, form.fields[at], 1.0).astype(np.int64)
    for instance in [None] if which is None else [int(one) for one in np.unique(which)]:
        mine = here if which is None or instance is None else here[which == instance]
        clocks = tuple(
            Clock(name, _field(raw, mine, form, name, 1.0).astype(np.int64), TICKS[unit]) for name, unit in stamps
        )
        columns: dict[str, Column] = {}
        for index, name in enumerate(form.fields):
            letter = form.letters[index]
            if name in dict(stamps) or letter in "anNZ" or index == at:
                continue
            factor, unit = _unit_of(index, letter, units, multipliers, described)
            columns[name] = Column(partial(_field, raw, mine, form, name, factor), unit)
        yield Stream(form.name, columns, clocks, instance, mine)


def stamp_fields(message: str, fields: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """The fields of a message that hold stamps, with their units, the autopilot's own first."""
    # Before 2014 TimeMS of a GPS message was the GPS time of week, and T the autopilot's clock.
    if message in ("GPS", "GPS2") and "T" in fields and "TimeMS" in fields:
        yield "T", "ms"
        yield "TimeMS", "ms"
        return
    for name, unit in _STAMPS.items():
        if name in fields:
            yield name, unit


def _unit_of(index: int, letter: str, units: str, multipliers: str, described: _Described) -> tuple[float, str | None]:
    """The factor from raw numbers to the unit, and the unit; None where the file names none."""
    unit = described.units.get(units[index]) if index < len(units) else None
    if not unit or unit == "UNKNOWN":
        return 1.0, None
    if letter in _SCALED or index >= len(multipliers) or multipliers[index] in _NO_MULTIPLIER:
        return 1.0, unit
    return described.multipliers.get(multipliers[index], 1.0) or 1.0, unit


def _field(raw: AnyArray, here: IntArray, form: MessageFormat, name: str, factor: float) -> AnyArray:
    """One field of all messages of one type, in the unit that the file names; shape (n,)."""
    layout = form.layout()
    fields = layout.fields
    assert fields is not None  # a declared type has fields
    dtype, start = fields[name][:2]
    values = _gathered(raw, here, _HEAD_LENGTH + start, dtype.itemsize).view(dtype).ravel()
    divisor = _LETTERS[form.letters[form.fields.index(name)]][1]
    if divisor != 1.0:
        return values / divisor
    return values if factor == 1.0 else _times(values, factor)


def _times(values: AnyArray, factor: float) -> AnyArray:
    """The product with a power of ten; divided where that rounds once instead of twice."""
    inverse = round(1.0 / factor) if factor < 1.0 else 0
    return values / inverse if inverse and abs(inverse * factor - 1.0) < 1e-9 else values * factor


def _notes(lost: tuple[int, int], unknown: IntArray, messages: int, size: int, unsound: list[str]) -> list[str]:
    skipped, over = lost
    notes = []
    kinds = np.flatnonzero(unknown)
    # In damaged bytes a header may occur by chance; an undeclared type that was logged occurs repeatedly.
    if kinds.size and int(unknown.sum()) >= 2:
        named = ", ".join(f"{kind} ({unknown[kind]} times)" for kind in kinds[:8])
        notes.append(
            f"messages of the types {named} have no format before them in the file: they are not read, the others are"
        )
    elif skipped:
        notes.append(f"{skipped} of {size} bytes are damaged and skipped; {messages} messages are read")
    if over > 0:
        # Counted from the end of the message's header, as in the format's reference library.
        behind = max(0, over - _HEAD_LENGTH)
        notes.append(f"the file ends inside a message ({behind} bytes over); the complete part is read")
    if unsound:
        notes.append(f"the format of {', '.join(sorted(unsound))} does not fit its own length: it is not read")
    return notes


def finished_recording(form: str, streams: list[Stream], counts: dict[str, int], notes: list[str]) -> Recording:
    """The parts common to binary and text: dropped messages, absolute time, the recorder's restarts."""
    dropped = [stream for stream in streams if stream.name == "DSF" and "Dp" in stream.columns]
    if dropped:
        lost = int(np.max(dropped[0].columns["Dp"].load(), initial=0))
        if lost:
            notes = [*notes, f"the recorder counts {lost} messages that it could not write (DSF.Dp)"]
    return Recording(
        form, tuple(boot_numbers(streams)), tuple(notes), (), _utc_of_zero(streams), sum(counts.values()), counts
    )


def _utc_of_zero(streams: list[Stream]) -> datetime | None:
    """Absolute time at zero of the autopilot's clock, from the first message with a fix in three dimensions."""
    for stream in streams:
        week = next((name for name in ("GWk", "Week") if name in stream.columns), None)
        of_week = _gps_seconds(stream)
        if stream.name != "GPS" or week is None or of_week is None or "Status" not in stream.columns:
            continue
        weeks = stream.columns[week].load()
        fixed = np.flatnonzero((stream.columns["Status"].load() >= _FIX_3D) & (weeks > 0) & np.isfinite(of_week))
        if fixed.size:
            at = int(fixed[0])
            return utc_of_gps(int(weeks[at]), float(of_week[at]) - float(stream.clocks[0].seconds()[at]))
    return None


def _gps_seconds(stream: Stream) -> FloatArray | None:
    """Seconds of the GPS week, from the field that contains them; None where none does."""
    if "GMS" in stream.columns:
        milliseconds = stream.columns["GMS"]
        return milliseconds.load() * (1e-3 if milliseconds.unit in (None, "ms") else 1.0)
    clock = stream.clock("TimeMS")
    return None if clock is None or len(stream.clocks) < 2 else clock.seconds()
