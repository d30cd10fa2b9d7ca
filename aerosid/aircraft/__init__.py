"""The aircraft file: load it, judge it, complete it, write it.

`model` holds what an aircraft is, `schema` which tables and keys a file may hold, `reading` turns a file into an
aircraft or into one sentence on what is wrong, `completion` writes what was found back into the text of the file,
`completion_record` what made it, `plausibility` warns of unusual numbers.
"""

from aerosid.aircraft.completion import save_aircraft
from aerosid.aircraft.model import Aircraft, CompletionRecord, DeclaredEffect, Derivative, LogOfCompletion
from aerosid.aircraft.plausibility import warnings_about
from aerosid.aircraft.reading import bundled_aircraft, load_aircraft

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
