"""The aircraft file: load it, judge it, complete it, write it.

`model` holds what an aircraft is, `schema` turns a file into one and refuses wrong files with one sentence,
`completion` writes what was found back into the text of the file, `plausibility` warns of unusual numbers.
"""

from aerosid.aircraft.completion import save_aircraft
from aerosid.aircraft.model import Aircraft, DeclaredEffect, Derivative
from aerosid.aircraft.plausibility import warnings_about
from aerosid.aircraft.schema import bundled_aircraft, load_aircraft

__all__ = [
    "Aircraft",
    "DeclaredEffect",
    "Derivative",
    "bundled_aircraft",
    "load_aircraft",
    "save_aircraft",
    "warnings_about",
]
