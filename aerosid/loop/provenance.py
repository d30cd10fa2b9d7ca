"""Provenance of a result: non-default settings, command line and analyst."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from aerosid.loop.settings import LoopSettings


@dataclass(frozen=True)
class Provenance:
    """Provenance that a signature refers to, in addition to the inputs.

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
"""Provenance without analyst or command line."""


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
