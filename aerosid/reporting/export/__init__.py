"""The model of an aircraft file in other formats: JSBSim, JSON, CSV, LaTeX, DAVE-ML.

A format is a function from an `Aircraft` and `ExportOptions` to text, in a module here, and one entry in `FORMATS`.
"""

from __future__ import annotations

from collections.abc import Callable

from aerosid.aircraft import Aircraft
from aerosid.errors import UsageError
from aerosid.reporting.export.daveml import daveml_text
from aerosid.reporting.export.jsbsim import jsbsim_text
from aerosid.reporting.export.latex import latex_text
from aerosid.reporting.export.options import Exported, ExportOptions
from aerosid.reporting.export.tables import csv_text, json_text

FORMATS: dict[str, Callable[[Aircraft, ExportOptions], Exported]] = {
    "jsbsim": jsbsim_text,
    "json": json_text,
    "csv": csv_text,
    "latex": latex_text,
    "davem": daveml_text,
}


def export(aircraft: Aircraft, format_name: str, options: ExportOptions) -> Exported:
    """The aircraft's model in a format.

    Parameters
    ----------
    aircraft : Aircraft
        As declared, or as completed by close-loop.
    format_name : str
        A key of `FORMATS`.
    options : ExportOptions
        Data that the aircraft file does not contain.

    Raises
    ------
    UsageError
        Where the format is unknown, or an option does not apply to it.
    AircraftError
        Where the format cannot represent an effect declared in the aircraft file.
    """
    if format_name not in FORMATS:
        raise UsageError(f"--format is {format_name!r}, expected one of {', '.join(FORMATS)}; give one of them.")
    return FORMATS[format_name](aircraft, options)


__all__ = ["FORMATS", "ExportOptions", "Exported", "export"]
