"""Provenance of a result: the day, the settings that are not the usual ones, and who asked for it how."""

from __future__ import annotations

import dataclasses
import datetime as dt
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from aerosid.errors import UsageError
from aerosid.loop.settings import LoopSettings

EPOCH = "SOURCE_DATE_EPOCH"
"""Environment variable that gives the day, s since 1970, where files are to be the same on every day."""


@dataclass(frozen=True)
class Provenance:
    """What a signature under a result refers to, beside its inputs.

    Attributes
    ----------
    date : str
        The day of the run, UTC, as 2026-11-22.
    settings : mapping of str to value
        Those that differ from the usual ones, by their dotted names.
    command : str
        The command line; empty where a script called.
    analyst, remarks : str
        As the user gave them.
    """

    date: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    command: str = ""
    analyst: str = ""
    remarks: str = ""


NOBODY = Provenance()
"""Where nobody says who asked."""


def today() -> str:
    """The day, UTC: that of SOURCE_DATE_EPOCH where it is set, so that the same input gives the same bytes.

    Raises
    ------
    UsageError
        Where SOURCE_DATE_EPOCH is no whole number of seconds.
    """
    given = os.environ.get(EPOCH)
    if given is None:
        return dt.datetime.now(dt.UTC).date().isoformat()
    try:
        return dt.datetime.fromtimestamp(int(given), dt.UTC).date().isoformat()
    except (ValueError, OverflowError, OSError):
        raise UsageError(
            f"{EPOCH} is {given[:40]!r}, expected whole seconds since 1970; correct or unset it."
        ) from None


def unusual_settings(settings: LoopSettings) -> dict[str, Any]:
    """The settings that differ from the usual ones, by dotted names, in the order of their definition."""
    usual = all_settings(LoopSettings())
    return {name: value for name, value in all_settings(settings).items() if name not in usual or usual[name] != value}


def all_settings(settings: LoopSettings) -> dict[str, Any]:
    """Every setting by its dotted name, in the order of their definition, as JSON holds it."""
    return dict(_flat(settings, ""))


def _flat(given: Any, path: str) -> Iterator[tuple[str, Any]]:
    if dataclasses.is_dataclass(given):
        for entry in dataclasses.fields(given):
            yield from _flat(getattr(given, entry.name), f"{path}.{entry.name}".lstrip("."))
    elif isinstance(given, Mapping):
        for name, value in given.items():
            yield from _flat(value, f"{path}.{name}")
    elif isinstance(given, tuple):
        yield path, list(given)
    elif given is None or isinstance(given, bool | int | float | str):
        yield path, given
    else:
        yield path, str(given)
