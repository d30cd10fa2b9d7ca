"""A flight log as native CSV."""

from __future__ import annotations

import numpy as np

from aerosid.logs.flight_log import FlightLog


def native_csv(log: FlightLog, remark: str, digits: int = 7) -> str:
    """The text of the log: a remark, one header row `name [unit], ...`, then numbers; a missing sample is empty.

    Parameters
    ----------
    log : FlightLog
    remark : str
        One line about where it comes from.
    digits : int
        Significant digits of every number.
    """
    header = ",".join(["time [s]", *(f"{name} [{log.units[name]}]" for name in log.channels)])
    table = np.column_stack([log.time, *log.channels.values()])
    rows = "\n".join(",".join("" if value != value else f"{value:.{digits}g}" for value in row) for row in table)
    return f"# {' '.join(remark.split())}\n{header}\n{rows}\n"
