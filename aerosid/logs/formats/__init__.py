"""Log formats: one file per format, one table of formats, and the functions that read a recording or a log."""

from __future__ import annotations

import gzip
import hashlib
import zlib
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.flight_log import FlightLog, chosen_stretch, stretches, with_fuel_used
from aerosid.logs.formats.ascii_columns import holds_words
from aerosid.logs.formats.assembly import Assembled, Place, assemble_mapped, assemble_native, cut_at_holes
from aerosid.logs.formats.catalogue import FORMATS, Format
from aerosid.logs.formats.missing_library import require_extra
from aerosid.logs.formats.native_csv import looks_native
from aerosid.logs.formats.table import RawTable, shown
from aerosid.logs.recording import Recording, Stream, column
from aerosid.logs.settings import READING

if TYPE_CHECKING:
    from aerosid.logs.formats.channel_map import ChannelMap

__all__ = ["FORMATS", "Channels", "Format", "format_of", "read_log", "read_recording", "read_segments", "ready_maps"]

Channels = str | Path | Mapping[str, Any]
"""A channel map: its file, the name of a ready one, or its contents."""


_READY = Path(__file__).resolve().parents[1] / "ready_maps"


def ready_maps() -> dict[str, Path]:
    """The channel maps bundled with aerosid, by the name given as `channels`."""
    return {path.stem: path for path in sorted(_READY.glob("*.toml"))}


def read_log(
    path: str | Path,
    channels: Channels | None = None,
    start: float | None = None,
    stop: float | None = None,
    *,
    across_holes: bool = False,
    recording: Recording | None = None,
) -> FlightLog:
    """The recorded manoeuvre as an immutable log in SI units on its own time base.

    Parameters
    ----------
    path : str or Path
        The recording; may be compressed with gzip.
    channels : str, Path or mapping, optional
        The channel map: its file, the name of a ready one (`px4`), or its content, of which `{"theta": "ATT.Pitch"}` is
        the shortest. Without it: LOG.channels.toml next to the log, channels.toml in its folder, or the ready map of
        its format.
    start, stop : float, optional
        The span, s in the log's own time; the longest stretch without a gap inside it is read.
    across_holes : bool
        All stretches in one log, with nothing between them: for whole flights that are searched for manoeuvres.
    recording : Recording, optional
        The result of `read_recording` for the same file, which is then not parsed again.

    Raises
    ------
    LogError
        If the recording cannot be read or used, or nothing lies within the span.
    ChannelMapError
        If the map is wrong or does not fit the recording, or the format needs a map and there is none.
    """
    whole = _read_whole(Path(path), channels, recording)
    if start is not None or stop is not None:
        whole = whole.between(start, stop)
    return whole if across_holes else chosen_stretch(whole)


def read_segments(path: str | Path, channels: Channels | None = None) -> tuple[FlightLog, ...]:
    """All stretches of a recording without a gap, each as a log, in order of time.

    Parameters
    ----------
    path, channels
        As for `read_log`.

    Raises
    ------
    LogError, ChannelMapError
        As `read_log`.
    """
    return stretches(_read_whole(Path(path), channels))


def _read_whole(path: Path, channels: Channels | None, recording: Recording | None = None) -> FlightLog:
    """Every stretch of a recording in one log that records the gaps between them."""
    if _is_topic_folder(path):
        parts, digest = _assemble_folder(path, channels)
    else:
        packed = _read_bytes(path)
        parts = _assemble(path, _unpacked(packed, str(path)), channels, recording)
        digest = hashlib.sha256(packed).hexdigest()
    first = parts[0]
    used = _used_map(path, channels)
    log = FlightLog(
        name=_log_name(path),
        time=np.concatenate([part.time for part in parts]),
        channels={name: np.concatenate([part.channels[name] for part in parts]) for name in first.channels},
        units=first.units,
        sources=first.sources,
        positions=first.positions,
        noise=first.noise,
        resolution=first.resolution,
        notes=tuple(first.notes),
        path=str(path),
        sha256=digest,
        channel_map="" if used is None else str(used),
        channel_map_sha256="" if used is None else hashlib.sha256(_read_bytes(used)).hexdigest(),
        holes=tuple((float(a.time[-1]), float(b.time[0])) for a, b in pairwise(parts)),
    )
    _require_measurable(log)
    return with_fuel_used(log)


def _require_measurable(log: FlightLog) -> None:
    """None; checks that every number is within the range of a sensor.

    Raises
    ------
    LogError
        Where a channel, or the time, contains a number beyond `READING.largest`.
    """
    for name, values in {"time": log.time, **log.channels}.items():
        beyond = np.flatnonzero(np.abs(values) > READING.largest)
        if beyond.size:
            k = int(beyond[0])
            place = f"{values[k]:.3g} at {log.time[k]:g} s (sample {k + 1})"
            raise LogError(
                f"{log.path}: channel {name} holds {place}, which is not a sensor reading (at most "
                f"{READING.largest:g}); check its column and unit, or leave the field empty for a missing sample."
            )


def _used_map(path: Path, channels: Channels | None) -> Path | None:
    """The file of the channel map, next to the recording or given as one; None for the ready maps of aerosid."""
    from aerosid.logs.formats.channel_map import find_channel_map

    if isinstance(channels, Mapping) or (channels is not None and not Path(channels).is_file()):
        return None
    return find_channel_map(path, None if channels is None else Path(channels))


def _is_topic_folder(path: Path) -> bool:
    from aerosid.logs.formats.topic_folder import topic_files

    return path.is_dir() and bool(topic_files(path))


def _assemble_folder(path: Path, channels: Channels | None) -> tuple[list[Assembled], str]:
    from aerosid.logs.formats.topic_folder import read_topic_folder
    from aerosid.logs.mapped_recording import map_recording

    recording, digest = read_topic_folder(path)
    mapped = _mapping(path, channels) or _mapping(path, ready_maps()["px4"])
    assert mapped is not None  # the ready map is part of the package
    mapping, map_label = mapped
    return map_recording(recording, mapping, Place(str(path), map_label)), digest


def format_of(path: str | Path) -> str:
    """The key of `FORMATS` by which a file is read with a map that names none.

    Raises
    ------
    LogError
        If it cannot be opened, or neither its contents nor its suffix identify the format.
    """
    path = Path(path)
    if _is_topic_folder(path):
        return "ulog"
    return _guess_format(path, _unpacked(_read_bytes(path), str(path)), mapped=True)


def read_recording(path: str | Path, form: str | None = None) -> Recording:
    """The contents of a file, as the recorder wrote them: nothing renamed, converted or resampled.

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
    """A table as the single stream of a recording; its columns are numbered where they have no names."""
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
    """The channel map and its source; None where there is none."""
    from aerosid.logs.formats.channel_map import checked_map, find_channel_map, load_channel_map

    if isinstance(channels, Mapping):
        return checked_map(channels, "channels"), "channels"
    given = None if channels is None else Path(channels)
    # A folder may have the name of a ready map: recordings of PX4 often are in a folder `px4`.
    if given is not None and not given.is_file():
        given = ready_maps().get(str(channels), given)
    found = find_channel_map(path, given)
    return None if found is None else (load_channel_map(found), str(found))


def _assemble(path: Path, data: bytes, channels: Channels | None, recording: Recording | None) -> list[Assembled]:
    label = str(path)
    mapped = _mapping(path, channels)
    if mapped is None:
        name = _guess_format(path, data, mapped=False)
        if FORMATS[name].self_describing:
            return cut_at_holes(assemble_native(_native(path, data), label), label)
        extra, ready = FORMATS[name].extra, FORMATS[name].ready_map
        if extra is not None:
            require_extra(extra, label)
        if ready is None:
            raise ChannelMapError(
                f"{label}: a file of format `{name}` does not describe its columns; write a channel map "
                f"{path.name}.channels.toml beside it (`aerosid channels` proposes one), or name one with "
                f"--channels.{_ready_hint(path)}"
            )
        mapped = _mapping(path, ready_maps()[ready])
        assert mapped is not None  # part of the package
    mapping, map_label = mapped
    name = mapping.format or _guess_format(path, data, mapped=True)
    if name not in FORMATS:
        raise ChannelMapError(
            f"{map_label}: key 'format' is {shown(name)}, but one of {', '.join(FORMATS)} was expected; correct it."
        )
    if name == "ascii" and mapping.text is not None:
        name = "text"
    parts = _mapped(name, data, mapping, Place(label, map_label), recording)
    if Path(map_label).parent == _READY:
        for part in parts:
            part.notes.insert(0, f"read with the channel map {Path(map_label).stem} that comes with aerosid")
    return parts


def _native(path: Path, data: bytes) -> RawTable:
    """The table of a self-describing file; an error names the format that was assumed for it."""
    try:
        table = FORMATS["csv"].read(data, str(path))
    except LogError as error:
        hint = "" if looks_native(data) else _ready_hint(path)
        raise LogError(f"{error}{hint}") from None
    assert isinstance(table, RawTable)  # self-describing formats are single tables
    return table


def _ready_hint(path: Path) -> str:
    """A sentence on the ready map that fits a file's columns; empty where none does."""
    from aerosid.logs.fitting_map import fitting_ready_map

    try:
        fitting = fitting_ready_map(read_recording(path))
    except LogError:
        return ""
    return "" if fitting is None else f" Its columns are those of a map that comes with aerosid: --channels {fitting}."


def _mapped(name: str, data: bytes, mapping: ChannelMap, place: Place, recording: Recording | None) -> list[Assembled]:
    content: RawTable | Recording
    if recording is not None and recording.format == name:
        content = recording
    elif name == "text":
        from aerosid.logs.formats.delimited_text import Dialect, read_delimited_text

        text = mapping.text
        dialect = None if text is None else Dialect(text.delimiter, text.decimal, text.names_line)
        content = read_delimited_text(data, place.log, dialect)
    else:
        content = FORMATS[name].read(data, place.log)
    if isinstance(content, RawTable) and mapping.resamples:
        content = _as_recording(name, content)
    if isinstance(content, RawTable):
        return cut_at_holes(assemble_mapped(content, mapping, place.log, place.map), place.log)
    from aerosid.logs.mapped_recording import map_recording

    return map_recording(content, mapping, place)


def _guess_format(path: Path, data: bytes, *, mapped: bool) -> str:
    """The format by the first bytes of the file, else by its suffix.

    A CSV is native only where its header gives units in brackets, and text where its rows contain words.
    """
    begun = next((name for name, form in FORMATS.items() if form.magic and data.startswith(form.magic)), None)
    if begun is not None:
        return begun
    suffix = Path(path.name.lower().removesuffix(".gz")).suffix
    candidates = [name for name, form in FORMATS.items() if suffix in form.suffixes]
    if not candidates:
        known = sorted({known for form in FORMATS.values() for known in form.suffixes})
        raise LogError(
            f"{path}: the suffix {shown(suffix)} indicates no format (known: {', '.join(known)}); rename the file, or "
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
