"""Decision summary: verdict, effects, error before and after, and open points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.error_rows import by_log, noise_scale
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.judgement import DECISIONS, TONES, headline_rows, noise_is_the_measure, open_points


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """Verdict, effects, and the error before and after on the flights that were not used for the fit."""
    rows = headline_rows(result)
    scale = noise_scale(rows) if noise_is_the_measure(result) else None
    lead, stop, rest = result.summary.partition(". ")
    return {
        "lead": lead + stop.strip(),
        "rest": rest,
        "tone": TONES[result.verdict],
        "verdict": result.verdict.name.lower().replace("_", " "),
        "meaning": result.verdict.value,
        "decision": DECISIONS[result.verdict],
        "open_points": open_points(result),
        "derivatives": [_columns(part) for part in _threes(result.derivatives)],
        "logs": by_log(rows, result),
        "scale": scale or False,
        "beside": 0 < len(result.effects) <= _BESIDE and len({(row.log, row.role) for row in rows}) == 1,
    }


_BESIDE = 9
"""Display: effects up to which they are placed beside the errors on paper: more would fill a column that cannot
continue on the next page."""

_SIDE_BY_SIDE = 3
"""Display: coefficients whose derivatives are next to each other."""


def _threes(rows: Sequence[DerivativeRow]) -> list[dict[str, list[DerivativeRow]]]:
    """The derivatives by coefficient, three coefficients at a time."""
    groups: dict[str, list[DerivativeRow]] = {}
    for row in rows:
        groups.setdefault(row.coefficient, []).append(row)
    names = list(groups)
    parts = [names[n : n + _SIDE_BY_SIDE] for n in range(0, len(names), _SIDE_BY_SIDE)]
    return [{name: groups[name] for name in part} for part in parts]


def _columns(groups: Mapping[str, Sequence[DerivativeRow]]) -> dict[str, Any]:
    """Coefficients, and row by row the derivatives of each; None after the last."""
    return {"coefficients": list(groups), "rows": list(zip_longest(*groups.values()))}
