"""Which logs a batch is about: those of a folder, or those that a list names."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from aerosid.errors import LogError, UsageError
from aerosid.logs.formats import FORMATS
from aerosid.logs.formats.channel_map import find_channel_map


@dataclass(frozen=True)
class LogFile:
    """One log of a batch.

    Attributes
    ----------
    path : str
        As it is opened.
    name : str
        By which tables call it, and the folder of its report: its path below the batch's folder without the suffix,
        with it where two logs would have the same.
    content : str
        Hash of its bytes and of its channel map: a result holds for these.
    """

    path: str
    name: str
    content: str

    @property
    def key(self) -> str:
        """By which its result is known again."""
        return f"{self.name}|{self.content}"


def find_logs(source: Path, channels: Path | None, but_in: Path | None = None) -> tuple[LogFile, ...]:
    """The logs of a folder and the folders in it, sorted; or those that a text file lists, in its order.

    Parameters
    ----------
    source : Path
        A folder, or a file with one path a line, relative to its own folder; `#` begins a comment.
    channels : Path, optional
        The channel map for all of them.
    but_in : Path, optional
        A folder that is left out: where the results go.

    Raises
    ------
    UsageError
        Where there is no log.
    """
    if source.is_dir():
        root = source
        suffixes = {suffix for entry in FORMATS.values() for suffix in entry.suffixes}
        without = but_in.resolve() if but_in is not None else None
        paths = [
            path
            for path in sorted(source.rglob("*"))
            if Path(path.name.lower().removesuffix(".gz")).suffix in suffixes
            and path.is_file()
            and (without is None or without not in path.resolve().parents)
        ]
        if not paths:
            raise UsageError(f"{source}: no log is in this folder; known suffixes are {', '.join(sorted(suffixes))}.")
    else:
        root = source.parent
        paths = [root / line for line in _lines(source)]
        if not paths:
            raise UsageError(f"{source}: it lists no log; write one path a line.")
    names = _names(paths, root)
    return tuple(LogFile(str(path), name, _content(path, channels)) for path, name in zip(paths, names, strict=True))


def _lines(source: Path) -> list[str]:
    try:
        text = source.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UsageError(f"{source}: neither a folder nor a list of logs stands there; check the path.") from None
    except (OSError, UnicodeDecodeError):
        raise UsageError(
            f"{source}: it cannot be read as a list of logs; give a text file with one path a line."
        ) from None
    lines = [line.partition("#")[0].strip() for line in text.splitlines()]
    return [line for line in lines if line]


def _names(paths: Sequence[Path], root: Path) -> list[str]:
    whole = [_below(path, root) for path in paths]
    short = [str(Path(name).with_name(Path(Path(name).name.removesuffix(".gz")).stem)) for name in whole]
    shared = Counter(short)
    names = [full if shared[brief] > 1 else brief for full, brief in zip(whole, short, strict=True)]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise UsageError(f"{twice[0]}: the log is listed twice; strike one line.")
    return names


def _below(path: Path, root: Path) -> str:
    """The path below the batch's folder, with no step upwards: it names a folder of results as well."""
    try:
        below = path.resolve().relative_to(root.resolve())
    except ValueError:
        below = Path(*path.resolve().parts[1:])
    return below.as_posix()


def _content(path: Path, channels: Path | None) -> str:
    content = hashlib.sha256()
    try:
        content.update(path.read_bytes())
        mapping = find_channel_map(path, channels)
        if mapping is not None:
            content.update(b"map" + mapping.read_bytes())
    except (OSError, LogError):
        content.update(b"unreadable")  # the run itself says why, and begins anew once it can be read
    return content.hexdigest()
