"""What was read: which columns of the files became which channels, and what was done to them."""

from __future__ import annotations

from typing import Any

import numpy as np

from aerosid.loop.result import ClosedLoop
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.figures.sign_sketch import sign_sketch


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any]:
    """The channels of every log with their sources, and the glossary's entries for them."""
    logs: list[dict[str, Any]] = []
    names: dict[str, None] = {}
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
        names.update(dict.fromkeys(log.channels))
    label = (
        "Aircraft from the side, nose to the right. Body x forward, z down; positive angle of attack: the nose above "
        "the flight path; positive pitch angle: the nose above the horizon; positive pitch rate and moment: nose up; "
        "positive elevator: trailing edge down."
    )
    sketch = figures.add(sign_sketch(), "Positive senses of axes, angles, the pitch rate and the elevator.", label)
    return {"logs": logs, "sketch": sketch, "glossary": [CHANNELS[name] for name in names if name in CHANNELS]}
