"""The aircraft file: reading, plausibility, completion and writing.

`model` holds what an aircraft is, `schema` which tables and keys a file may hold, `reading` turns a file into an
aircraft or into one sentence on what is wrong, `completion` writes what was found back into the text of the file,
`completion_record` what made it, `plausibility` warns of unusual numbers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from aerosid.aircraft.model import Aircraft, CompletionRecord, DeclaredEffect, Derivative, LogOfCompletion
from aerosid.aircraft.plausibility import warnings_about
from aerosid.aircraft.reading import bundled_aircraft, load_aircraft

if TYPE_CHECKING:
    from aerosid.aircraft.completion import save_aircraft

__all__ = [
    "Aircraft",
    "CompletionRecord",
    "DeclaredEffect",
    "Derivative",
    "LogOfCompletion",
    "bundled_aircraft",
    "load_aircraft",
    "save_aircraft",
    "warnings_about",
]


def __getattr__(name: str) -> Any:
    """`save_aircraft`, imported when it is asked for: it needs another reader of TOML, which keeps comments."""
    if name != "save_aircraft":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from aerosid.aircraft.completion import save_aircraft

    return save_aircraft
