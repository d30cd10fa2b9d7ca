"""Journal of results, one line each, from which an interrupted run of the same work continues.

A line contains the key of a work item, its result and a checksum, and is flushed to disk before the item counts as
done. A termination at any time leaves at most one incomplete line at the end, which is cut off when the journal is
opened again; a key that is already present is not written a second time.
"""

from __future__ import annotations

import json
import os
import sys
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from aerosid.errors import UsageError

Row = dict[str, Any]
"""A JSON value; numbers finite, None where there is none."""


class Journal:
    """The results of one set of work items, in a file of lines; use it in a `with` statement.

    Parameters
    ----------
    path : Path
        The file; created where it does not exist, with its folder.
    identity : str
        Identification of the work: a hash of all inputs that determine a result. Results of other work are never
        mixed in.

    Raises
    ------
    UsageError
        Where the file contains other work, another process has it open, or it cannot be written.
    """

    def __init__(self, path: Path, identity: str) -> None:
        self.path = path
        self.identity = identity
        self._done: set[str] = set()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[bytes] = path.open("a+b")
        except OSError as error:
            raise self._unusable(f"it cannot be written ({error.strerror or error})") from None
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def _open(self) -> None:
        if not _locked(self._file):
            raise self._unusable("another process is at work on it; wait for it")
        end = 0
        head: str | None = None
        for line, stop in self._lines():
            if head is None:
                head = str(line.get("identity", ""))
            else:
                self._done.add(str(line["key"]))
            end = stop
        if head is not None and head != self.identity:
            raise self._unusable("it holds the results of other settings, inputs or another state of aerosid")
        self._file.truncate(end)
        if head is None:
            self._append([{"identity": self.identity}])

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def __contains__(self, key: object) -> bool:
        return key in self._done

    def __len__(self) -> int:
        return len(self._done)

    def write(self, rows: Sequence[tuple[str, Row]]) -> None:
        """Append results by their keys, flushed to disk; keys that are already present are skipped."""
        fresh = {key: row for key, row in rows if key not in self._done}
        self._append([{"key": key, "row": row} for key, row in fresh.items()])
        self._done.update(fresh)

    def rows(self) -> Iterator[tuple[str, Row]]:
        """Every result with its key, in the order of writing; one in memory at a time."""
        for line, _ in self._lines():
            if "key" in line:
                yield str(line["key"]), line["row"]

    def _append(self, lines: Sequence[Row]) -> None:
        if not lines:
            return
        texts = [json.dumps(line, allow_nan=False, separators=(",", ":")).encode() for line in lines]
        block = b"".join(b"%08x %s\n" % (zlib.crc32(text), text) for text in texts)
        try:
            self._file.write(block)
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise self._unusable(f"it cannot be written ({error.strerror or error})") from None

    def _lines(self) -> Iterator[tuple[Row, int]]:
        """The complete lines from the beginning to the first incomplete one, each with the offset of its end."""
        with self.path.open("rb") as file:
            stop = 0
            for raw in file:
                stop += len(raw)
                text = raw[9:-1]
                if raw[-1:] != b"\n" or raw[:9] != b"%08x " % zlib.crc32(text):
                    return
                yield json.loads(text), stop

    def _unusable(self, found: str) -> UsageError:
        return UsageError(f"{self.path}: {found}; choose another folder with --out, or remove that file.")


def _locked(file: IO[bytes]) -> bool:
    """Lock the file for this process until it ends in any way; False where another process has locked it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            file.seek(1 << 40)  # far beyond the content, which other processes may read
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
