"""Columns of a recording by name: `topic.field`, `TYPE[1].Field`, or a whole header."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from aerosid.logs.formats.table import shown
from aerosid.logs.recording import Column, Recording, Stream

_SEPARATORS = (".", "/")
_NAMED = 12
"""Display: names of available columns in a message."""


class LookupProblem(ValueError):
    """A column that does not exist, or is ambiguous; the message is a clause."""


@dataclass(frozen=True)
class Found:
    """A column and its location.

    Attributes
    ----------
    stream : Stream
        The stream that contains it.
    name : str
        Its name in that stream.
    others : tuple of str
        Labels of further instances of the stream that also contain it and were not selected.
    """

    stream: Stream
    name: str
    others: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """The name of the column, preceded by that of its stream."""
        return f"{self.stream.label}.{self.name}" if self.stream.label else self.name

    @property
    def column(self) -> Column:
        """The values of the column."""
        return self.stream.columns[self.name]


def find_column(recording: Recording, wanted: int | str) -> Found:
    """The column with the given name or number.

    Parameters
    ----------
    recording : Recording
        The recording to search.
    wanted : int or str
        A number from 1 where the recording is one table; or a column's name, with its stream's name (`ATT.Pitch`) and,
        several senders, the instance (`XKF1[1].Pitch`). Without an instance the lowest is used.

    Raises
    ------
    LookupProblem
        If there is no such column, or several match.
    """
    if isinstance(wanted, int):
        return _by_number(recording, wanted)
    exact = list(_exactly(recording, wanted))
    if exact:
        return exact[0]
    named = list(_without_instance(recording, wanted)) or list(_bare(recording, wanted))
    if not named:
        raise LookupProblem(_not_there(recording, wanted))
    names = {found.stream.name for found in named}
    clocked = {len(found.stream.clocks) > 0 for found in named}
    if len(names) > 1 or (len(named) > 1 and any(found.stream.instance is None for found in named) and clocked):
        raise LookupProblem(
            f"is mapped to {shown(wanted)}, which {_listed([found.label for found in named])} hold; name one of them"
        )
    first, *rest = sorted(named, key=lambda found: found.stream.instance or 0)
    return Found(first.stream, first.name, tuple(found.stream.label for found in rest))


def _by_number(recording: Recording, number: int) -> Found:
    if len(recording.streams) > 1:
        raise LookupProblem(
            f"is mapped to column {number}, but the recording is not a single table; give the column's name"
        )
    (stream,) = recording.streams
    if number > len(stream.columns):
        raise LookupProblem(f"is mapped to column {number}, but there are {len(stream.columns)}; correct the number")
    return Found(stream, list(stream.columns)[number - 1])


def _held(stream: Stream, name: str) -> str | None:
    if name in stream.columns:
        return name
    return stream.aliases.get(name)


def _after_prefix(stream: Stream, prefix: str, wanted: str) -> str | None:
    for separator in _SEPARATORS:
        if prefix and wanted.startswith(prefix + separator):
            name = _held(stream, wanted[len(prefix) + 1 :])
            if name is not None:
                return name
    return None


def _exactly(recording: Recording, wanted: str) -> Iterator[Found]:
    for stream in recording.streams:
        name = _after_prefix(stream, stream.label, wanted)
        if name is not None:
            yield Found(stream, name)


def _without_instance(recording: Recording, wanted: str) -> Iterator[Found]:
    for stream in recording.streams:
        name = _after_prefix(stream, stream.name, wanted)
        if name is not None and stream.instance is not None:
            yield Found(stream, name)


def _bare(recording: Recording, wanted: str) -> Iterator[Found]:
    for stream in recording.streams:
        name = _held(stream, wanted)
        if name is not None:
            yield Found(stream, name)


def _not_there(recording: Recording, wanted: str) -> str:
    """The alternatives: the stream's instances or columns where its name is right, else the streams."""
    streams = [s for s in recording.streams if s.name and wanted.startswith((f"{s.name}.", f"{s.name}[", f"{s.name}/"))]
    if streams:
        field = next((wanted.split(mark, 1)[1] for mark in ("].", "]/") if mark in wanted), None)
        with_field = [s.label for s in streams if field is not None and _held(s, field) is not None]
        if with_field:
            return f"is mapped to {shown(wanted)}, but the recording holds {_listed(with_field)}; correct the instance"
        return (
            f"is mapped to {shown(wanted)}, but {streams[0].label} holds {_listed(list(streams[0].columns))}; correct "
            "the name"
        )
    if len(recording.streams) == 1 or not any(stream.name for stream in recording.streams):
        names = [name for stream in recording.streams for name in stream.columns]
        return f"is mapped to {shown(wanted)}, but the recording holds {_listed(names)}; correct the name"
    labels = [stream.label for stream in recording.streams]
    return f"is mapped to {shown(wanted)}, but the recording holds {_listed(labels)}; correct the name"


def _listed(names: list[str]) -> str:
    text = ", ".join(shown(name, 40) for name in names[:_NAMED])
    return f"{text}, … {len(names)} in all" if len(names) > _NAMED else text or "nothing"
