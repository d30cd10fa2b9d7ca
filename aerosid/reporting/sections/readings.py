"""Channel sources: the columns of the files behind each channel, and their conversion."""

from __future__ import annotations

from typing import Any

import numpy as np

from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.roles import label_of


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """The channels of every log with their sources."""
    logs: list[dict[str, Any]] = []
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
        logs.append({"log": log, "role": role, "label": label_of(role, result), "channels": channels})
    return {"logs": logs}
