"""The derivative table."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """The derivatives, coefficient by coefficient, with the position of the estimate relative to the declared value."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for row in result.derivatives:
        shift = None
        if row.declared is not None and row.std_error and row.shown:
            shift = (row.value - row.declared) / row.std_error
        groups.setdefault(row.coefficient, []).append({"row": row, "found": row.declared is None, "shift": shift})
    return {
        "groups": groups,
        "hidden": any(not row.shown for row in result.derivatives),
        "scattered": any(row.scatter is not None for row in result.derivatives),
        "forced": any(row.filter_error is not None for row in result.derivatives),
        "correlation": result.correlation,
    }
