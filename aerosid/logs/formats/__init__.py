"""Reads a recorded manoeuvre: one file a format, one table of formats, one function."""

from __future__ import annotations

import gzip
import hashlib
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats.ascii_columns import read_ascii_columns
from aerosid.logs.formats.assembly import Assembled, assemble_mapped, assemble_native
from aerosid.logs.formats.matlab5 import read_matlab5
from aerosid.logs.formats.native_csv import looks_native, read_native_csv
from aerosid.logs.formats.table import RawTable, shown

__all__ = ["FORMATS", "Format", "read_log"]


@dataclass(frozen=True)
class Format:
    """One recorder format.

    Attributes
    ----------
    read : callable
        From the file's bytes and its name, for messages, to its columns.
    suffixes : tuple of str
        File suffixes by which the format is guessed; each may be followed by `.gz`.
    self_describing : bool
        Whether the file itself names channels and units, so that it needs no channel map.
    description : str
        One line for `aerosid formats`.
    """

    read: Callable[[bytes, str], RawTable]
    suffixes: tuple[str, ...]
    self_describing: bool
    description: str


FORMATS: dict[str, Format] = {
    "csv": Format(read_native_csv, (".csv",), True, "aerosid's own: a header row `name [unit], ...`, then numbers"),
    "ascii": Format(
        read_ascii_columns,
        (".asc", ".txt", ".dat", ".tsv", ".csv"),
        False,
        "columns separated by white space, comma, semicolon or tab, with or without header text",
    ),
    "mat": Format(read_matlab5, (".mat",), False, "MATLAB 5 to 7: one matrix, a struct, or one variable a channel"),
}


def read_log(path: str | Path, channel_map: str | Path | None = None) -> FlightLog:
    """The recorded manoeuvre as an immutable log in SI on its own time base.

    Parameters
    ----------
    path : str or Path
        The recording; may be compressed with gzip.
    channel_map : str or Path, optional
        The channel map. Without it: LOG.channels.toml beside the log, or channels.toml in its folder.

    Raises
    ------
    LogError
        If the recording cannot be read or used.
    ChannelMapError
        If the map is wrong or does not fit the recording, or the format needs a map and there is none.
    """
    path = Path(path)
    label = str(path)
    packed = _read_bytes(path)
    data = _unpacked(packed, label)
    map_path = None if channel_map is None else Path(channel_map)
    assembled = _assemble(path, data, map_path)
    return FlightLog(
        name=_log_name(path),
        time=assembled.time,
        channels=assembled.channels,
        units=assembled.units,
        sources=assembled.sources,
        positions=assembled.positions,
        notes=tuple(assembled.notes),
        path=label,
        sha256=hashlib.sha256(packed).hexdigest(),
    )


def _assemble(path: Path, data: bytes, given_map: Path | None) -> Assembled:
    from aerosid.logs.formats.channel_map import find_channel_map, load_channel_map

    label = str(path)
    map_path = find_channel_map(path, given_map)
    if map_path is None:
        name = _guess_format(path, data, mapped=False)
        if not FORMATS[name].self_describing:
            raise ChannelMapError(
                f"{label}: a file of format `{name}` does not say what its columns mean; write a channel map "
                f"{path.name}.channels.toml beside it, or name one with --channels."
            )
        return assemble_native(FORMATS[name].read(data, label), label)
    mapping = load_channel_map(map_path)
    name = mapping.format or _guess_format(path, data, mapped=True)
    if name not in FORMATS:
        raise ChannelMapError(
            f"{map_path}: key 'format' is {shown(name)}, but one of {', '.join(FORMATS)} was expected; correct it."
        )
    return assemble_mapped(FORMATS[name].read(data, label), mapping, label, str(map_path))


def _guess_format(path: Path, data: bytes, *, mapped: bool) -> str:
    """The format by the file's suffix; a CSV with a map is native only where its header carries units in brackets."""
    suffix = Path(path.name.lower().removesuffix(".gz")).suffix
    candidates = [name for name, form in FORMATS.items() if suffix in form.suffixes]
    if not candidates:
        known = sorted({known for form in FORMATS.values() for known in form.suffixes})
        raise LogError(
            f"{path}: the suffix {shown(suffix)} tells no format (known are {', '.join(known)}); rename the file, or "
            "name the format in a channel map."
        )
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
