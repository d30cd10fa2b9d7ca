"""The derivative table."""

from __future__ import annotations

from typing import Any

from aerosid.loop.model_validation.goodness import CorrelationMatrix
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook

_MATRIX = 24
"""Display: parameters up to which the correlations are a matrix, legible on a sheet; of more the large are listed."""

_LISTED = 0.5
"""Display: absolute correlation from which one is listed."""


def _pairs(matrix: CorrelationMatrix) -> list[tuple[str, str, float]]:
    """Two parameters and their correlation, the largest first."""
    found = [
        (other, name, value)
        for n, (name, row) in enumerate(zip(matrix.parameters, matrix.rows, strict=True))
        for other, value in zip(matrix.parameters[:n], row, strict=False)
        if abs(value) >= _LISTED
    ]
    return sorted(found, key=lambda pair: -abs(pair[2]))


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
        "pairs": _pairs(result.correlation) if len(result.correlation.parameters) > _MATRIX else None,
        "least": _LISTED,
    }
