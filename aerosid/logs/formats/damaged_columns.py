"""Columns of possibly damaged files, read on demand."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from aerosid.errors import LogError
from aerosid.logs.formats.table import shown
from aerosid.logs.recording import AnyArray, Column


def guarded(load: Callable[[], AnyArray], path: str, name: str, unit: str | None = None) -> Column:
    """A column whose reading from a damaged file raises a LogError of one sentence.

    Parameters
    ----------
    load : callable
        Returns the values; may raise any exception of a library.
    path, name : str
        File and column, for the message.
    unit : str, optional
        As the file gives it.
    """
    return Column(partial(_loaded, load, path, name), unit)


def _loaded(load: Callable[[], AnyArray], path: str, name: str) -> AnyArray:
    try:
        return load()
    except Exception as error:  # noqa: BLE001  damaged bytes can raise any exception in the library
        detail = " ".join(str(error).split())[:80] or type(error).__name__
        raise LogError(
            f"{path}: column {shown(name)} cannot be read, the file is damaged there ({detail}); copy it again."
        ) from None
