"""How well every flight is fitted, in numbers beyond the root-mean-square error."""

from __future__ import annotations

from typing import Any

from aerosid.reporting.figures.numbered import FigureBook
from aerosid.results import ClosedLoop


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The share of the coefficients' variance that is explained; nothing where no sensor measures a coefficient."""
    return {"coefficients": result.coefficients} if result.coefficients else None
