"""Decision summary: verdict, effects, error before and after, and open points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any

from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.effect_rows import Effect
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.error_rows import by_log, noise_scale
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.judgement import DECISIONS, TONES, headline_rows, noise_is_the_measure, open_points
from aerosid.reporting.remarks import remarks


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """Verdict, effects, and the error before and after on the flights that were not used for the fit."""
    rows = headline_rows(result)
    scale = noise_scale(rows) if result.identified and noise_is_the_measure(result) else None
    lead, stop, rest = result.summary.partition(". ")
    beside = 0 < len(result.effects) <= _BESIDE and len({(row.log, row.role) for row in rows}) == 1
    return {
        "lead": lead + stop.strip(),
        "rest": rest,
        "tone": TONES[result.verdict],
        "verdict": result.verdict.name.lower().replace("_", " "),
        "meaning": "" if result.verdict.value in result.summary else result.verdict.value,
        "decision": DECISIONS[result.verdict],
        "open_points": open_points(result),
        "remarks": remarks(result),
        "derivatives": [_columns(part) for part in _threes(result.derivatives)],
        "logs": by_log(rows, result),
        "senses": list(_senses(result.effects)) if beside else [],
        "scale": scale or False,
        "beside": beside,
    }


_SENSES = {
    "sensor_bias": "a bias is measured − true",
    "sensor_scale": "a scale is measured / true",
    "sensor_delay": "what is recorded late has a positive delay",
    "thrust_scale": "a scale of thrust is acting / recorded",
    "thrust_asymmetry": "an arm of thrust is positive to the left",
}
"""Positive senses of the errors of instruments and of thrust, which their short names do not tell."""


def _senses(effects: Sequence[Effect]) -> Iterator[str]:
    """The positive senses of the kinds among the effects, and what their mark means."""
    kinds = {effect.kind for effect in effects}
    yield from (words for kind, words in _SENSES.items() if kind in kinds)
    if any(effect.evidence.unseen_better is False for effect in effects):
        yield "one that is not confirmed does not improve the prediction of validation data"


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
