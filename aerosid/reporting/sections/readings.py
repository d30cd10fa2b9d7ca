"""Channel sources: the columns of the files behind each channel, and their conversion."""

from __future__ import annotations

from typing import Any

import numpy as np

from aerosid.logs.flight_log import FlightLog
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.roles import label_of


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """The channels of every log with their sources; where an earlier log was read in the same way, its name."""
    logs: list[dict[str, Any]] = []
    ways: list[tuple[FlightLog, object]] = []
    roles = [(role, log) for role in ROLES for log in getattr(result, role)]
    for role, log in roles:
        channels = []
        for name, values in log.channels.items():
            known = np.isfinite(values)
            channels.append(
                {
                    "channel": name,
                    "unit": log.units.get(name, "1"),
                    "source": log.sources.get(name),
                    "position": log.positions.get(name),
                    "missing": int(values.size - known.sum()),
                    "low": float(values[known].min()) if known.any() else None,
                    "high": float(values[known].max()) if known.any() else None,
                }
            )
        way = _way(log)
        alike = next((earlier.name for earlier, its_way in ways if its_way == way), "")
        ways.append((log, way))
        logs.append(
            {
                "log": log,
                "role": role,
                "label": label_of(role, result),
                "channels": channels,
                "alike": alike,
                "changes": "; ".join(note.rstrip(".") for note in log.notes),
                "missing": any(channel["missing"] for channel in channels),
            }
        )
    return {"logs": logs}


def _way(log: FlightLog) -> object:
    """How the log was read: of each channel the columns with their conversion, the sensor's position, and the unit."""
    return {name: (log.sources.get(name), log.positions.get(name), log.units.get(name)) for name in log.channels}
