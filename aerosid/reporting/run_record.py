"""Record of one run for the title block: date, command line, settings off their defaults, map files, who signs."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from aerosid.errors import UsageError
from aerosid.notation import plain

_DROPPED = {"--out"}
"""Options that decide where files go and nothing of what they hold: the same inputs give the same bytes anywhere."""


@dataclass(frozen=True)
class ReadFile:
    """A file that the result depends on beside logs and aircraft: its path as named, its role and SHA-256."""

    path: str
    role: str
    sha256: str


@dataclass(frozen=True)
class RunRecord:
    """What a signature needs beside the result; empty texts where a run knows nothing of it.

    Attributes
    ----------
    date : str
        Year-month-day, UTC.
    command : str
        As typed in a shell, without where files go.
    settings : tuple of str
        One setting each that differs from its default, with both values.
    files : tuple of ReadFile
        Channel maps.
    analyst, remarks : str
        As the options gave them.
    """

    date: str = ""
    command: str = ""
    settings: tuple[str, ...] = ()
    files: tuple[ReadFile, ...] = ()
    analyst: str = ""
    remarks: str = ""


NO_RECORD = RunRecord()
"""Of a result that no command line made."""


def run_date(environment: Mapping[str, str]) -> str:
    """The date of a run: that of SOURCE_DATE_EPOCH (s since 1970, UTC) where it is set, else today's.

    Raises
    ------
    UsageError
        Where SOURCE_DATE_EPOCH is no number of seconds.
    """
    epoch = environment.get("SOURCE_DATE_EPOCH")
    if not epoch:
        return datetime.now(UTC).strftime("%Y-%m-%d")
    try:
        return datetime.fromtimestamp(int(epoch), UTC).strftime("%Y-%m-%d")
    except (ValueError, OverflowError, OSError):
        raise UsageError(
            f"SOURCE_DATE_EPOCH is {epoch!r}, expected seconds since 1970 as a whole number; correct or unset it."
        ) from None


def command_text(words: Sequence[str]) -> str:
    """The command as a shell takes it, without the options that only say where files go."""
    kept, skip = ["aerosid"], False
    for word in words:
        if skip:
            skip = False
        elif word in _DROPPED:
            skip = True
        elif word.split("=", 1)[0] not in _DROPPED:
            kept.append(word)
    return shlex.join(kept)


def changed_settings(settings: Any, defaults: Any) -> tuple[str, ...]:
    """A text for each field in which two settings of one kind differ, nested ones too: `priors: yes (default no)`."""
    return tuple(_changed(settings, defaults, ()))


def map_files(paths: Sequence[Path]) -> tuple[ReadFile, ...]:
    """The channel maps with their checksums, each once."""
    return tuple(
        ReadFile(str(path), "channel map", hashlib.sha256(path.read_bytes()).hexdigest())
        for path in dict.fromkeys(paths)
    )


def _changed(settings: Any, defaults: Any, above: tuple[str, ...]) -> Iterator[str]:
    for entry in fields(settings):
        value, usual = getattr(settings, entry.name), getattr(defaults, entry.name)
        path = (*above, entry.name.replace("_", " "))
        if is_dataclass(value) and type(value) is type(usual):
            yield from _changed(value, usual, path)
        elif value != usual:
            yield f"{', '.join(path)}: {_said(value)} (default {_said(usual)})"


def _said(value: Any) -> str:
    """A setting's value for a person."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return plain(value)
    if isinstance(value, Mapping):
        return "; ".join(f"{name} {_said(number)}" for name, number in value.items()) or "none"
    if isinstance(value, list | tuple):
        return ", ".join(map(_said, value)) or "none"
    return "none" if value is None else str(value)
