"""Appendix of the candidates screened against the model error, largest gain first."""

from __future__ import annotations

import math
from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.model_error.paper_chain.screening import ScreeningRow
from aerosid.reporting.figures.numbered import FigureBook

LISTED = 16
"""Display: candidates in the report: those further down improve nothing; result.json contains all."""


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The candidates with the largest gain, those that entered the model among them; None where none was screened."""
    if not result.screening:
        return None
    # The equations score their candidates in other columns than d(t): there is no gain by which to sort.
    scored = any(row.gain for row in result.screening)
    rows = sorted(result.screening, key=_by_gain if scored else _by_partial)
    shown = [row for n, row in enumerate(rows) if n < LISTED or row.chosen]
    return {"shown": shown, "left_out": len(rows) - len(shown), "scored": scored}


def _by_gain(row: ScreeningRow) -> float:
    return -row.gain if math.isfinite(row.gain) else math.inf


def _by_partial(row: ScreeningRow) -> float:
    return -abs(row.partial) if math.isfinite(row.partial) else math.inf
