"""Appendix of the candidates screened against the model error, largest gain first."""

from __future__ import annotations

import math
from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook

LISTED = 16
"""Candidates in the report: what lies further back brought nothing; result.json holds all."""


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The candidates with the largest gain, those that entered the model among them; None where none was screened."""
    if not result.screening:
        return None
    rows = sorted(result.screening, key=lambda row: -row.gain if math.isfinite(row.gain) else math.inf)
    shown = [row for n, row in enumerate(rows) if n < LISTED or row.chosen]
    return {"shown": shown, "left_out": len(rows) - len(shown)}
