"""How well every flight is fitted, in numbers beyond the root-mean-square error."""

from __future__ import annotations

from typing import Any

from aerosid.reporting.figures.numbered import FigureBook
from aerosid.results import ClosedLoop, FitRow


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """Explained shares, Theil's coefficient and whiteness of every channel, and the innovations' whiteness."""
    if not (result.coefficients or result.fit or result.innovations):
        return None
    logs: dict[str, list[FitRow]] = {}
    for row in result.fit:
        if row.variant == "after":
            logs.setdefault(row.log, []).append(row)
    return {"coefficients": result.coefficients, "logs": logs, "innovations": result.innovations}
