"""aerosid finds what an aircraft's declared model lacks, from measured manoeuvres.

    import aerosid

    result = aerosid.close_loop([aerosid.read_log("flight.csv")], aerosid.load_aircraft("aircraft.toml"))
    print(result.summary)

Nothing is imported before it is used: `import aerosid` costs no more than Python itself.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `typing`, whose import would take as long as all of this
if TYPE_CHECKING:
    from typing import Any

    from aerosid.aircraft import Aircraft, load_aircraft, save_aircraft
    from aerosid.aircraft.bundled import bundled_folder
    from aerosid.logs.flight_log import FlightLog
    from aerosid.logs.formats import read_log, read_recording, read_segments
    from aerosid.logs.recording import Recording
    from aerosid.loop.provenance import Provenance
    from aerosid.loop.result import ClosedLoop
    from aerosid.loop.settings import LoopSettings
    from aerosid.loop.verdict import Verdict
    from aerosid.manoeuvres import FlightSegmentation, find_manoeuvres
    from aerosid.reporting import write_report
    from aerosid.reporting.notebook import Result, close_loop

__version__ = "0.1.0"

_HOMES = {
    "Aircraft": "aerosid.aircraft",
    "ClosedLoop": "aerosid.loop.result",
    "FlightLog": "aerosid.logs.flight_log",
    "FlightSegmentation": "aerosid.manoeuvres",
    "LoopSettings": "aerosid.loop.settings",
    "Recording": "aerosid.logs.recording",
    "Provenance": "aerosid.loop.provenance",
    "Result": "aerosid.reporting.notebook",
    "Verdict": "aerosid.loop.verdict",
    "bundled_folder": "aerosid.aircraft.bundled",
    "close_loop": "aerosid.reporting.notebook",
    "find_manoeuvres": "aerosid.manoeuvres",
    "load_aircraft": "aerosid.aircraft",
    "read_log": "aerosid.logs.formats",
    "read_recording": "aerosid.logs.formats",
    "read_segments": "aerosid.logs.formats",
    "save_aircraft": "aerosid.aircraft",
    "write_report": "aerosid.reporting",
}
"""Where each public name is defined; it is imported when it is first asked for."""

__all__ = [
    "Aircraft",
    "ClosedLoop",
    "FlightLog",
    "FlightSegmentation",
    "LoopSettings",
    "Provenance",
    "Recording",
    "Result",
    "Verdict",
    "bundled_folder",
    "close_loop",
    "find_manoeuvres",
    "load_aircraft",
    "read_log",
    "read_recording",
    "read_segments",
    "save_aircraft",
    "write_report",
]


def __getattr__(name: str) -> Any:
    """A public name, imported from its home; AttributeError for any other."""
    if name not in _HOMES:
        raise AttributeError(f"module 'aerosid' has no attribute {name!r}")
    import importlib

    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names and the version."""
    return [*__all__, "__version__"]
