"""Atomic writing of files that belong together: all of them, or none under its final name."""

from __future__ import annotations

import os
import secrets
import shutil
import stat
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from aerosid.errors import UsageError

Writer = Callable[[Path], object]
"""Writes one file to the path that it is given."""


def text(content: str) -> Writer:
    """The writer of a text, UTF-8 with plain line ends."""
    return lambda path: path.write_bytes(content.encode("utf-8", "backslashreplace"))


def require_folder(directory: Path) -> None:
    """Make the folder; a long computation calls `require_writable` before, which leaves none where it is refused.

    Raises
    ------
    UsageError
        Where it cannot be made or written.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            pass
    except OSError as error:
        raise _unwritable(directory, error) from None


def require_writable(directory: Path) -> None:
    """Nothing, where the folder, or the nearest one above it that exists, can be written; makes none.

    Raises
    ------
    UsageError
        Where it cannot.
    """
    standing = next(path for path in (directory, *directory.absolute().parents) if path.exists())
    try:
        with tempfile.TemporaryFile(dir=standing):
            pass
    except OSError as error:
        raise _unwritable(directory, error) from None


def require_writable_file(file: Path) -> None:
    """Nothing, where the file can be written or replaced; makes none.

    Raises
    ------
    UsageError
        Where its folder cannot be written, or a folder stands in its place.
    """
    if file.is_dir():
        raise UsageError(f"{file}: is a folder, expected the name of a file; give one with --out.")
    if file.exists() and not file.is_file():
        raise UsageError(f"{file}: is a device or pipe, expected the name of a file; give one with --out.")
    require_writable(file.parent)


def require_apart(outputs: Iterable[Path], inputs: Iterable[str | Path | None]) -> None:
    """Nothing, where no output would replace a file that the same call reads; called before any work.

    Parameters
    ----------
    outputs : iterable of Path
        All files that the call writes.
    inputs : iterable of str or Path or None
        Files that it reads, as given; those that do not exist, such as bundled names, do not matter.

    Raises
    ------
    UsageError
        Where an output is an input, by whatever path or link.
    """
    read = {identity for given in inputs if given is not None and (identity := _identity(Path(given)))}
    for output in outputs:
        if read and _identity(output) in read:
            raise UsageError(
                f"{output}: it is an input of this call and would be replaced by its output; give another --out."
            )


def _identity(path: Path) -> tuple[int, int] | None:
    """What is the same of two paths to one file; None where there is no file."""
    try:
        found = path.stat()
    except (OSError, ValueError):  # a text that cannot be a path
        return None
    return (found.st_dev, found.st_ino) if stat.S_ISREG(found.st_mode) else None


_UNFINISHED: set[Path] = set()
_MAKING = threading.RLock()
"""Held while a folder is made, so that none is made behind the back of a thread that ends the process."""


@contextmanager
def unfinished_folder(directory: Path, name: str) -> Iterator[Path]:
    """A folder of this name in a directory for files that are moved when all are complete; removed behind the block."""
    folder = directory / f".{name}-{secrets.token_hex(6)}.part"
    with _MAKING:
        _UNFINISHED.add(folder)
        folder.mkdir(mode=0o700)
    try:
        yield folder
    finally:
        try:
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            # Again: a signal raises an exception wherever the main thread is, here too.
            shutil.rmtree(folder, ignore_errors=True)
            _UNFINISHED.discard(folder)


def end_process(code: int) -> NoReturn:
    """End this process at once, from any thread or signal handler, with no unfinished folder left."""
    with _MAKING:
        for folder in tuple(_UNFINISHED):
            for _ in range(_TRIES):
                shutil.rmtree(folder, ignore_errors=True)
                if not folder.exists():
                    break
        os._exit(code)


_TRIES = 10
"""Numerical: times that a folder is removed into which another thread may still be writing."""


def write_files(directory: Path, writers: Mapping[str, Writer]) -> tuple[Path, ...]:
    """The paths of the files written.

    Parameters
    ----------
    directory : Path
        Where to; made where it does not exist. Files of these names are replaced, others stay.
    writers : mapping of str to callable
        What writes each file, by its name.

    Raises
    ------
    UsageError
        Where the folder cannot be made or written.
    """
    require_folder(directory)
    try:
        with unfinished_folder(directory, "files") as temporary:
            for name, write in writers.items():
                write(temporary / name)
            for name in writers:
                if (directory / name).is_dir():
                    raise IsADirectoryError(0, f"{name} is a folder there")
            for name in writers:
                os.replace(temporary / name, directory / name)
    except OSError as error:
        raise _unwritable(directory, error) from None
    return tuple(directory / name for name in writers)


def _unwritable(directory: Path, error: OSError) -> UsageError:
    return UsageError(f"{directory}: cannot be written ({error.strerror or error}); choose another folder with --out.")
