"""Explained variance of each model one step and five seconds ahead, and in open loop."""

from __future__ import annotations

from typing import Any

from aerosid.loop.model_validation.predictions import OPEN_LOOP, PredictionRow
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.roles import label_of


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The rows by log, flights not used in the fit first; None where no predictions were made."""
    if not result.predictions:
        return None
    logs: dict[tuple[str, str], dict[str, dict[str, PredictionRow]]] = {}
    for row in sorted(result.predictions, key=lambda row: -ROLES.index(row.role)):
        logs.setdefault((row.log, row.role), {}).setdefault(row.channel, {})[row.horizon] = row
    groups = [
        {"log": log, "role": role, "label": label_of(role, result), "channels": channels}
        for (log, role), channels in logs.items()
    ]
    partly = [row for row in result.predictions if row.horizon == OPEN_LOOP and row.predicted < 1.0]
    return {"logs": groups, "partly": dict.fromkeys(row.log for row in partly)}
