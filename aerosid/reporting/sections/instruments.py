"""Data compatibility: whether the instruments agree with each other, before any aerodynamics."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.worse_channels import note_on_worse_channels


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The instrument errors, each with those indistinguishable from it; None where too few channels are recorded."""
    agreement = result.kinematics
    if agreement is None:
        return None
    instead = {group[0]: group[1:] for group in agreement.inseparable}
    rows = [(finding, instead.get(finding, ())) for finding in agreement.findings]
    doubted = {(row.log, row.channel) for row in result.errors if row.noise_doubt}
    several, worse = len(agreement.logs) > 1, note_on_worse_channels(agreement)
    return {"agreement": agreement, "rows": rows, "several": several, "worse": worse, "doubted": doubted}
