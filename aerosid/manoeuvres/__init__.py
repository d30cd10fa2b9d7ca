"""Manoeuvres in recordings: whole flights segmented into tests, trim points and turns by flight mechanics alone.

Nothing is imported before it is used: whether a log is a whole flight at all is asked of every one, and most are not.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aerosid.manoeuvres.found import CONDITIONS, KINDS
    from aerosid.manoeuvres.segmentation import (
        FlightSegmentation,
        FoundManoeuvre,
        RejectedStretch,
        find_manoeuvres,
    )
    from aerosid.manoeuvres.settings import FinderSettings
    from aerosid.manoeuvres.whole_flight import (
        elevator_manoeuvres,
        is_whole_flight,
        longitudinal_manoeuvres,
        require_manoeuvre,
        whole_flight_sentence,
    )

__all__ = [
    "CONDITIONS",
    "KINDS",
    "FinderSettings",
    "FlightSegmentation",
    "FoundManoeuvre",
    "RejectedStretch",
    "elevator_manoeuvres",
    "find_manoeuvres",
    "is_whole_flight",
    "longitudinal_manoeuvres",
    "require_manoeuvre",
    "whole_flight_sentence",
]

_HOMES = {
    "found": ("CONDITIONS", "KINDS"),
    "segmentation": ("FlightSegmentation", "FoundManoeuvre", "RejectedStretch", "find_manoeuvres"),
    "settings": ("FinderSettings",),
    "whole_flight": (
        "elevator_manoeuvres",
        "is_whole_flight",
        "longitudinal_manoeuvres",
        "require_manoeuvre",
        "whole_flight_sentence",
    ),
}
"""Module of each public name."""


def __getattr__(name: str) -> Any:
    """A public name, imported from its module; AttributeError for any other."""
    home = next((module for module, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{home}"), name)
    globals()[name] = value
    return value
