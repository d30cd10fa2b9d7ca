"""Logs of a batch: those of a folder, or those listed in a file."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from aerosid.errors import LogError, UsageError
from aerosid.logs.formats import FORMATS
from aerosid.logs.formats.channel_map import find_channel_map
from aerosid.logs.spans import Span, is_segment_file, parse_span, read_segment_file, read_span
from aerosid.manoeuvres import find_manoeuvres, longitudinal_manoeuvres

UNREADABLE = "unreadable"
"""Format: in place of the hash of a log that cannot be read."""


@dataclass(frozen=True)
class LogFile:
    """One log of a batch.

    Attributes
    ----------
    path : str
        The recording, or a span of it as LOG@FROM:TO.
    name : str
        Its name in tables, and the folder of its report: its path below the batch's folder without the suffix, or with
        the suffix where two logs would have the same name.
    content : str
        Hash of its bytes and of its channel map: a result is valid for these.
    """

    path: str
    name: str
    content: str

    @property
    def key(self) -> str:
        """Key of its result in the journal."""
        return f"{self.name}|{self.content}"


def find_logs(source: Path, channels: Path | None, but_in: Path | None = None) -> tuple[LogFile, ...]:
    """The logs of a folder and its subfolders, sorted; those listed in a text file, in its order; or a single one.

    Parameters
    ----------
    source : Path
        A folder; a file with one path or LOG@FROM:TO per line, relative to its own folder, `#` begins a comment; a
        segment file; a recording, or LOG@FROM:TO.
    channels : Path, optional
        The channel map for all of them.
    but_in : Path, optional
        A folder that is skipped: that of the results.

    Raises
    ------
    UsageError
        Where there is no log.
    """
    if source.is_dir():
        root = source
        suffixes = _suffixes()
        without = but_in.resolve() if but_in is not None else None
        paths = [
            path
            for path in sorted(source.rglob("*"))
            if _named_as_a_log(path) and path.is_file() and (without is None or without not in path.resolve().parents)
        ]
        if not paths:
            raise UsageError(f"{source}: no log is in this folder; known suffixes are {', '.join(sorted(suffixes))}.")
    elif is_segment_file(source):
        return tuple(_of_span(span, channels) for span in read_segment_file(source))
    elif (lone := _lone(source)) is not None:
        return (_of_span(lone, channels),)
    else:
        root = source.parent
        spans = [parse_span(root / line) for line in _lines(source)]
        if not spans:
            raise UsageError(f"{source}: it lists no log; write one path a line.")
        if any(not span.whole for span in spans):
            return _named_apart(tuple(_of_span(span, channels) for span in spans))
        paths = [span.path for span in spans]
    names = _names(paths, root)
    return tuple(LogFile(str(path), name, _content(path, channels)) for path, name in zip(paths, names, strict=True))


def require_separate_logs(logs: Sequence[LogFile]) -> None:
    """Refuse two logs of the same bytes, channel map and span.

    Raises
    ------
    UsageError
        Where two are: a flight that is counted twice looks twice as certain.
    """
    known: dict[str, LogFile] = {}
    for log in logs:
        other = known.setdefault(log.content, log)
        if other is not log and log.content != UNREADABLE:
            raise UsageError(
                f"{log.path} holds the samples of {other.path}, but each flight is to be counted once; delete one of "
                "them, or leave it out of the list."
            )


def _suffixes() -> set[str]:
    return {suffix for entry in FORMATS.values() for suffix in entry.suffixes}


def _named_as_a_log(path: Path) -> bool:
    return Path(path.name.lower().removesuffix(".gz")).suffix in _suffixes()


def _lone(source: Path) -> Span | None:
    """The recording, or the span of one, given by a path itself; None where it is a list or neither.

    A list is distinguished from a recording in text by its first line, which names a log.
    """
    span = parse_span(source)
    if not span.path.is_file() or not _named_as_a_log(span.path):
        return None
    try:
        first = next(iter(_lines(span.path)), None)
        if first is None or _named_as_a_log(parse_span(first).path):
            return None
        return None if (span.path.parent / first).is_file() else span
    except (UsageError, OSError, ValueError):  # bytes that are not text, or a text that is not a path
        return span


def find_manoeuvres_of(logs: Sequence[LogFile], channels: Path | None) -> tuple[LogFile, ...]:
    """The elevator manoeuvres found in each log, in place of the log.

    Parameters
    ----------
    logs : sequence of LogFile
    channels : Path, optional
        The channel map for all of them.

    Raises
    ------
    LogError
        Where a log cannot be read, or no manoeuvre is found in any of them.
    """
    found = []
    for entry in logs:
        span = parse_span(entry.path)
        log = read_span(span, channels, across_holes=True)
        for manoeuvre in longitudinal_manoeuvres(find_manoeuvres(log)):
            name = f"{entry.name}_{manoeuvre.start:.0f}_{manoeuvre.kind}"
            cut = Span(span.path, round(manoeuvre.cut_from, 6), round(manoeuvre.cut_to, 6), "", name)
            found.append(_of_span(cut, channels))
    if not found:
        raise LogError(
            f"no elevator manoeuvre was found in {len(logs)} logs; see what `aerosid find LOG --rejected` lists."
        )
    return _named_apart(tuple(found))


def _of_span(span: Span, channels: Path | None) -> LogFile:
    stem = Path(span.path.name.removesuffix(".gz")).stem
    ends = "" if span.whole else f"_{span.start or 0.0:.6g}-{'end' if span.stop is None else f'{span.stop:.6g}'}"
    content = _content(span.path, channels)
    if content != UNREADABLE:
        content = hashlib.sha256(f"{content}|{span.start}|{span.stop}".encode()).hexdigest()
    return LogFile(str(span), span.name or f"{stem}{ends}", content)


def _named_apart(logs: tuple[LogFile, ...]) -> tuple[LogFile, ...]:
    _refuse_repeated([log.name for log in logs], "two spans have this name; name them in a segment file")
    return logs


def _refuse_repeated(names: Sequence[str], reason: str) -> None:
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise UsageError(f"{twice[0]}: {reason}.")


def _lines(source: Path) -> list[str]:
    try:
        text = source.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UsageError(f"{source}: it is neither a folder nor a list of logs; check the path.") from None
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
    _refuse_repeated(names, "the log is listed twice; delete one line")
    return names


def _below(path: Path, root: Path) -> str:
    """The path below the batch's folder, without upward steps: it is also the name of a folder of results."""
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
        return UNREADABLE  # the run reports the reason, and repeats the log once it can be read
    return content.hexdigest()
