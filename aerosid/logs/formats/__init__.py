"""Log formats: one file a format, one table of formats, one function that reads."""

from __future__ import annotations

import gzip
import hashlib
import importlib
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats.ascii_columns import holds_words, read_ascii_columns
from aerosid.logs.formats.assembly import Assembled, Place, assemble_mapped, assemble_native, cut_at_holes
from aerosid.logs.formats.matlab5 import read_matlab5
from aerosid.logs.formats.native_csv import looks_native, read_native_csv
from aerosid.logs.formats.table import RawTable, shown
from aerosid.logs.recording import Recording, Stream, column

if TYPE_CHECKING:
    from aerosid.logs.formats.channel_map import ChannelMap

__all__ = ["FORMATS", "Channels", "Format", "format_of", "read_log", "read_recording", "read_segments", "ready_maps"]

Channels = str | Path | Mapping[str, Any]
"""A channel map: its file, the name of a ready one, or its content."""


@dataclass(frozen=True)
class Format:
    """One recorder format.

    Attributes
    ----------
    read : callable
        From the file's bytes and its name, for messages, to its columns or, of several clocks, its streams.
    suffixes : tuple of str
        File suffixes by which the format is guessed; each may be followed by `.gz`.
    self_describing : bool
        Whether the file itself names channels and units, so that it needs no channel map.
    description : str
        One line for `aerosid formats`.
    magic : tuple of bytes
        How such a file begins, where that tells it from others; it then goes before the suffix.
    ready_map : str or None
        The channel map that comes with aerosid and is used where there is no other.
    extra : str or None
        The extra of aerosid that installs what reads it.
    several_clocks : bool
        Whether its streams have stamps of their own.
    """

    read: Callable[[bytes, str], RawTable | Recording]
    suffixes: tuple[str, ...]
    self_describing: bool
    description: str
    magic: tuple[bytes, ...] = ()
    ready_map: str | None = None
    extra: str | None = None
    several_clocks: bool = False


def _late(module: str, function: str) -> Callable[[bytes, str], Recording]:
    """A reader that is imported when a file needs it: some bring compilers and libraries along."""

    def read(data: bytes, path: str) -> Recording:
        found = getattr(importlib.import_module(f"aerosid.logs.formats.{module}"), function)(data, path)
        assert isinstance(found, Recording)  # by the readers' annotations
        return found

    return read


FORMATS: dict[str, Format] = {
    "csv": Format(read_native_csv, (".csv",), True, "aerosid's own: a header row `name [unit], ...`, then numbers"),
    "ascii": Format(
        read_ascii_columns,
        (".asc", ".txt", ".dat", ".tsv", ".csv"),
        False,
        "columns separated by blanks, comma, semicolon or tab; header or none",
    ),
    "text": Format(
        _late("delimited_text", "read_delimited_text"),
        (),
        False,
        "tables with clock times and words: Garmin, JSBSim, X-Plane, PX4's CSV",
    ),
    "mat": Format(
        read_matlab5, (".mat",), False, "MATLAB 5 to 7: one matrix, a struct, or one variable a channel", (b"MATLAB 5",)
    ),
    "hdf5": Format(
        _late("hdf5", "read_hdf5"),
        (".h5", ".hdf5", ".hdf"),
        False,
        "HDF5 and MATLAB 7.3: every data set of numbers by its path",
        (b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3"),
        extra="hdf5",
    ),
    "parquet": Format(_late("arrow", "read_parquet"), (".parquet",), False, "Apache Parquet, one table", (b"PAR1",)),
    "feather": Format(
        _late("arrow", "read_feather"), (".feather", ".arrow"), False, "Feather, Arrow IPC", (b"ARROW1", b"FEA1")
    ),
    "ulog": Format(
        _late("ulog", "read_ulog"), (".ulg",), False, "PX4 ULog", (b"ULog\x01\x12\x35",), "px4", several_clocks=True
    ),
    "dataflash": Format(
        _late("dataflash", "read_dataflash"),
        (".bin",),
        False,
        "ArduPilot DataFlash, binary",
        (b"\xa3\x95\x80",),
        "ardupilot",
        several_clocks=True,
    ),
    "dataflash_text": Format(
        _late("dataflash_text", "read_dataflash_text"),
        (".log",),
        False,
        "ArduPilot DataFlash, text",
        (),
        "ardupilot",
        several_clocks=True,
    ),
    "tlog": Format(
        _late("mavlink_log", "read_tlog"),
        (".tlog",),
        False,
        "MAVLink telemetry log",
        (),
        "mavlink",
        "mavlink",
        several_clocks=True,
    ),
    "mdf4": Format(
        _late("mdf4", "read_mdf4"),
        (".mf4", ".mdf"),
        False,
        "ASAM MDF 4",
        (b"MDF     ", b"UnFinMF "),
        extra="mdf4",
        several_clocks=True,
    ),
    "tdms": Format(
        _late("tdms", "read_tdms"), (".tdms",), False, "LabVIEW TDMS", (b"TDSm",), extra="tdms", several_clocks=True
    ),
    "irig106": Format(
        _late("irig106", "read_irig106"),
        (".ch10", ".c10"),
        False,
        "IRIG 106 chapter 10: discretes, raw bus words (experimental)",
        (b"\x25\xeb",),
        extra="irig106",
        several_clocks=True,
    ),
    "igc": Format(_late("igc", "read_igc"), (".igc",), False, "FAI IGC, gliders' fixes", extra="igc"),
}

_READY = Path(__file__).resolve().parents[1] / "ready_maps"


def ready_maps() -> dict[str, Path]:
    """The channel maps that come with aerosid, by the name that `channels` takes."""
    return {path.stem: path for path in sorted(_READY.glob("*.toml"))}


def read_log(
    path: str | Path, channels: Channels | None = None, start: float | None = None, stop: float | None = None
) -> FlightLog:
    """The recorded manoeuvre as an immutable log in SI on its own time base.

    Parameters
    ----------
    path : str or Path
        The recording; may be compressed with gzip.
    channels : str, Path or mapping, optional
        The channel map: its file, the name of a ready one (`px4`), or its content, of which `{"theta": "ATT.Pitch"}` is
        the shortest. Without it: LOG.channels.toml beside the log, channels.toml in its folder, or the ready map of
        its format.
    start, stop : float, optional
        The span, s of the log's own time; the longest stretch without a hole inside it is read.

    Raises
    ------
    LogError
        If the recording cannot be read or used, or nothing lies within the span.
    ChannelMapError
        If the map is wrong or does not fit the recording, or the format needs a map and there is none.
    """
    segments = read_segments(path, channels)
    if len(segments) == 1:
        return segments[0] if start is None and stop is None else segments[0].between(start, stop)
    low, high = float("-inf") if start is None else start, float("inf") if stop is None else stop

    def overlap(log: FlightLog) -> float:
        return min(float(log.time[-1]), high) - max(float(log.time[0]), low)

    longest = max(segments, key=overlap)
    others = ", ".join(f"{log.time[0]:.6g} to {log.time[-1]:.6g} s" for log in segments if log is not longest)
    note = (
        f"{longest.time[0]:.6g} to {longest.time[-1]:.6g} s is used, the longest of {len(segments)} stretches without "
        f"a hole; the others: {others}; choose one by its span"
    )
    return replace(longest, notes=(*longest.notes, note)).between(start, stop)


def read_segments(path: str | Path, channels: Channels | None = None) -> tuple[FlightLog, ...]:
    """All stretches of a recording without a hole, each a log, in order of time.

    Parameters
    ----------
    path, channels
        As for `read_log`.

    Raises
    ------
    LogError, ChannelMapError
        As `read_log`.
    """
    path = Path(path)
    if _is_topic_folder(path):
        parts, digest = _assemble_folder(path, channels)
    else:
        packed = _read_bytes(path)
        parts, digest = _assemble(path, _unpacked(packed, str(path)), channels), hashlib.sha256(packed).hexdigest()
    return tuple(
        FlightLog(
            name=_log_name(path),
            time=part.time,
            channels=part.channels,
            units=part.units,
            sources=part.sources,
            positions=part.positions,
            notes=tuple(part.notes),
            path=str(path),
            sha256=digest,
        )
        for part in parts
    )


def _is_topic_folder(path: Path) -> bool:
    from aerosid.logs.formats.topic_folder import topic_files

    return path.is_dir() and bool(topic_files(path))


def _assemble_folder(path: Path, channels: Channels | None) -> tuple[list[Assembled], str]:
    from aerosid.logs.formats.topic_folder import read_topic_folder
    from aerosid.logs.mapped_recording import map_recording

    recording, digest = read_topic_folder(path)
    mapped = _mapping(path, channels) or _mapping(path, "px4")
    assert mapped is not None  # the ready one comes with the package
    mapping, map_label = mapped
    return map_recording(recording, mapping, Place(str(path), map_label)), digest


def format_of(path: str | Path) -> str:
    """The key of `FORMATS` by which a file would be read with a map that names none.

    Raises
    ------
    LogError
        If it cannot be opened, or neither its content nor its suffix tells.
    """
    path = Path(path)
    if _is_topic_folder(path):
        return "ulog"
    return _guess_format(path, _unpacked(_read_bytes(path), str(path)), mapped=True)


def read_recording(path: str | Path, form: str | None = None) -> Recording:
    """Everything that a file holds, as the recorder wrote it: nothing renamed, converted or resampled.

    Parameters
    ----------
    path : str or Path
        The recording; may be compressed with gzip.
    form : str, optional
        A key of `FORMATS`; guessed from the file where absent.

    Raises
    ------
    LogError
        If it cannot be read.
    """
    path = Path(path)
    if form is None and _is_topic_folder(path):
        from aerosid.logs.formats.topic_folder import read_topic_folder

        return read_topic_folder(path)[0]
    data = _unpacked(_read_bytes(path), str(path))
    name = form or _guess_format(path, data, mapped=True)
    if name == "ascii" and holds_words(data):
        name = "text"
    found = FORMATS[name].read(data, str(path))
    return found if isinstance(found, Recording) else _as_recording(name, found)


def _as_recording(name: str, table: RawTable) -> Recording:
    """A table as the one stream of a recording; its columns go by their numbers where they have no names."""
    from aerosid.logs.formats.delimited_text import numeric_clocks

    names: list[str] = []
    for index, held in enumerate(table.names):
        plain = held or f"column {index + 1}"
        names.append(plain if plain not in names else f"{plain} ({index + 1})")
    columns = {held: column(table.values[:, index], table.units[index]) for index, held in enumerate(names)}
    whole = {
        f"{held} {left}{one.unit}{right}": held
        for held, one in columns.items()
        if one.unit
        for left, right in ("[]", "()")
    }
    return Recording(name, (Stream("", columns, numeric_clocks(columns), aliases=whole),))


def _mapping(path: Path, channels: Channels | None) -> tuple[ChannelMap, str] | None:
    """The channel map and where it is from; None where there is none."""
    from aerosid.logs.formats.channel_map import checked_map, find_channel_map, load_channel_map

    if isinstance(channels, Mapping):
        return checked_map(channels, "channels"), "channels"
    given = None if channels is None else Path(channels)
    if given is not None and not given.exists():
        given = ready_maps().get(str(channels), given)
    found = find_channel_map(path, given)
    return None if found is None else (load_channel_map(found), str(found))


def _assemble(path: Path, data: bytes, channels: Channels | None) -> list[Assembled]:
    label = str(path)
    mapped = _mapping(path, channels)
    if mapped is None:
        name = _guess_format(path, data, mapped=False)
        if FORMATS[name].self_describing:
            table = FORMATS[name].read(data, label)
            assert isinstance(table, RawTable)  # what describes itself is one table
            return cut_at_holes(assemble_native(table, label), label)
        ready = FORMATS[name].ready_map
        if ready is None:
            raise ChannelMapError(
                f"{label}: a file of format `{name}` does not say what its columns mean; write a channel map "
                f"{path.name}.channels.toml beside it (`aerosid channels` proposes one), or name one with --channels."
            )
        mapped = _mapping(path, ready)
        assert mapped is not None  # it comes with the package
    mapping, map_label = mapped
    name = mapping.format or _guess_format(path, data, mapped=True)
    if name not in FORMATS:
        raise ChannelMapError(
            f"{map_label}: key 'format' is {shown(name)}, but one of {', '.join(FORMATS)} was expected; correct it."
        )
    if name == "ascii" and mapping.text is not None:
        name = "text"
    return _mapped(name, data, mapping, Place(label, map_label))


def _mapped(name: str, data: bytes, mapping: ChannelMap, place: Place) -> list[Assembled]:
    if name == "text":
        from aerosid.logs.formats.delimited_text import Dialect, read_delimited_text

        text = mapping.text
        dialect = None if text is None else Dialect(text.delimiter, text.decimal, text.names_line)
        content: RawTable | Recording = read_delimited_text(data, place.log, dialect)
    else:
        content = FORMATS[name].read(data, place.log)
    if isinstance(content, RawTable):
        return cut_at_holes(assemble_mapped(content, mapping, place.log, place.map), place.log)
    from aerosid.logs.mapped_recording import map_recording

    return map_recording(content, mapping, place)


def _guess_format(path: Path, data: bytes, *, mapped: bool) -> str:
    """The format by how the file begins, else by its suffix.

    A CSV is native only where its header carries units in brackets, and text where its rows hold words.
    """
    begun = next((name for name, form in FORMATS.items() if form.magic and data.startswith(form.magic)), None)
    if begun is not None:
        return begun
    suffix = Path(path.name.lower().removesuffix(".gz")).suffix
    candidates = [name for name, form in FORMATS.items() if suffix in form.suffixes]
    if not candidates:
        known = sorted({known for form in FORMATS.values() for known in form.suffixes})
        raise LogError(
            f"{path}: the suffix {shown(suffix)} tells no format (known are {', '.join(known)}); rename the file, or "
            "name the format in a channel map."
        )
    if mapped and candidates[0] in ("csv", "ascii") and holds_words(data):
        return "text"
    if mapped and candidates[0] == "csv" and not looks_native(data):
        return "ascii"
    return candidates[0]


def _log_name(path: Path) -> str:
    return Path(path.name.removesuffix(".gz")).stem


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise LogError(f"{path}: the log does not exist; check the path.") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it cannot be read"
        raise LogError(f"{shown(path, 200)}: the log cannot be opened ({reason}); give a readable file.") from None


def _unpacked(data: bytes, label: str) -> bytes:
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        return gzip.decompress(data)
    except (OSError, EOFError, zlib.error) as error:
        raise LogError(f"{label}: the gzip file is damaged or truncated ({error}); copy it again.") from None
