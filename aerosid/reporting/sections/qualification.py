"""The tolerances of 14 CFR Part 60, for the flights that are a manoeuvre that it names."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.roles import label_of
from aerosid.reporting.simulator_tolerances import Comparison, comparisons


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The comparisons, flight by flight and paragraph by paragraph; nothing where no tolerance applies."""
    groups: dict[tuple[str, str, str], list[Comparison]] = {}
    for row in comparisons(result):
        groups.setdefault((row.log, row.role, row.source), []).append(row)
    labels = {role: label_of(role, result) for _, role, _ in groups}
    sources = list(dict.fromkeys(source for _, _, source in groups))
    return {"groups": groups, "sources": sources, "labels": labels} if groups else None
