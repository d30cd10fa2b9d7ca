"""Writing of a flight log as native CSV, and of the channel map with the properties that its header cannot give."""

from __future__ import annotations

import json

import numpy as np

from aerosid.logs.flight_log import FlightLog


def native_csv(log: FlightLog, remark: str, digits: int = 7) -> str:
    """The text of the log: a comment, one header row `name [unit], ...`, then numbers; a missing sample is empty.

    Parameters
    ----------
    log : FlightLog
    remark : str
        One line on its origin.
    digits : int
        Significant digits of every number.
    """
    header = ",".join(["time [s]", *(f"{name} [{log.units[name]}]" for name in log.channels)])
    table = np.column_stack([log.time, *log.channels.values()])
    rows = "\n".join(",".join("" if value != value else f"{value:.{digits}g}" for value in row) for row in table)
    return f"# {' '.join(remark.split())}\n{header}\n{rows}\n"


def channel_map_text(log: FlightLog, remark: str) -> str:
    """The text of a channel map for the log as native CSV: every channel unchanged, with its sensor's position.

    Parameters
    ----------
    log : FlightLog
    remark : str
        One line on its origin.
    """
    lines = [f"# {' '.join(remark.split())}", "schema = 1", 'format = "csv"', 'time = { column = "time", unit = "s" }']
    lines += ["", "[channels]"]
    for name in log.channels:
        place = log.positions.get(name)
        where = f", position = [{', '.join(f'{float(number)!r}' for number in place)}]" if place is not None else ""
        lines.append(f"{_quoted(name)} = {{ column = {_quoted(name)}, unit = {_quoted(log.units[name])}{where} }}")
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """The text as a basic string of TOML."""
    return json.dumps(text)
