"""What was read: which columns of the files became which channels, and what was done to them."""

from __future__ import annotations

from typing import Any

import numpy as np

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """The channels of every log with their sources."""
    logs: list[dict[str, Any]] = []
    roles = [("identification", log) for log in result.identification]
    for role, log in [*roles, *(("validation", log) for log in result.validation)]:
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
        logs.append({"log": log, "role": role, "channels": channels})
    return {"logs": logs}
