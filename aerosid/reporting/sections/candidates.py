"""The candidates that could explain the residual, with the evidence for each."""

from __future__ import annotations

import math
from typing import Any

from aerosid.reporting.figures.numbered import FigureBook
from aerosid.results import ClosedLoop


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """The screening of d(t), largest gain first."""
    screening = sorted(result.screening, key=lambda row: -row.gain if math.isfinite(row.gain) else math.inf)
    return {"screening": screening, "chosen": [row for row in screening if row.chosen]}
