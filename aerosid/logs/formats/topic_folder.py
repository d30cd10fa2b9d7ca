"""A recording in a folder of CSV files on one clock, one file per topic, as written by PX4's ulog2csv."""

from __future__ import annotations

import gzip
import hashlib
import os.path
import re
from dataclasses import replace
from pathlib import Path

from aerosid.errors import LogError
from aerosid.logs.formats.delimited_text import read_delimited_text
from aerosid.logs.recording import Recording, Stream

_TOPIC = re.compile(r"(?P<name>.+)_(?P<instance>\d+)")


def topic_files(folder: Path) -> list[Path]:
    """The files of topics in a folder, by name; empty where there are none."""
    return sorted(path for path in folder.iterdir() if path.name.lower().endswith((".csv", ".csv.gz")))


def read_topic_folder(folder: Path) -> tuple[Recording, str]:
    """All topics of a folder as the streams of one recording, and the SHA-256 of all its files in order of name.

    Parameters
    ----------
    folder : Path
        With at least one file of a topic.

    Raises
    ------
    LogError
        If a file cannot be read.

    Notes
    -----
    `FLIGHT_vehicle_attitude_0.csv` is instance 0 of topic vehicle_attitude: the common prefix names the flight.
    """
    files = topic_files(folder)
    stems = [path.name.lower().removesuffix(".gz").removesuffix(".csv") for path in files]
    begin = os.path.commonprefix(stems) if len(stems) > 1 else ""  # noqa: RUF071  character by character, as intended
    cut = begin.rfind("_") + 1
    digest = hashlib.sha256()
    streams: list[Stream] = []
    notes: list[str] = []
    for path, stem in zip(files, stems, strict=True):
        packed = path.read_bytes()
        digest.update(packed)
        try:
            data = gzip.decompress(packed) if path.suffix.lower() == ".gz" else packed
        except (OSError, EOFError) as error:
            raise LogError(f"{path}: the gzip file is damaged or truncated ({error}); copy it again.") from None
        recording = read_delimited_text(data, str(path))
        name = path.name[cut : len(stem)]
        match = _TOPIC.fullmatch(name)
        topic, instance = (match["name"], int(match["instance"])) if match else (name, None)
        streams += [replace(stream, name=topic, instance=instance) for stream in recording.streams]
        notes += [f"{name}: {note}" for note in recording.notes]
    return Recording("topics", tuple(streams), tuple(notes)), digest.hexdigest()
