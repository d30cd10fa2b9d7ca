"""Derivatives of many manoeuvres against flight condition, with error bars and the declared values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from aerosid.reporting.figures.chart import Chart, Line, Mark, Points
from aerosid.reporting.figures.layout import Tile, tiled
from aerosid.reporting.words import shown_unit, subscripted, term_label
from aerosid.studies.batch.one_log import CONDITION
from aerosid.studies.batch.table import Measured
from aerosid.studies.batch.table_texts import UNITS

DEVIATIONS = 2.0
"""Display: half length of an error bar in reported standard errors."""


def usual_abscissa(rows: Mapping[str, Mapping[str, float | None]]) -> str:
    """Default abscissa of the figures: Mach number where every log contains it, else alpha."""
    numbers = [condition.get("mach") for condition in rows.values()]
    known = [value for value in numbers if value is not None]
    return "mach" if len(known) == len(numbers) and np.ptp(known) > 0.02 else "alpha"


def condition_chart(entries: Sequence[Measured], against: str) -> Chart | None:
    """One panel per derivative: value and error bar of each manoeuvre that shows it, the declared value as a line.

    Parameters
    ----------
    entries : sequence of Measured
        All derivatives of all manoeuvres.
    against : str
        One of V, h, mach, alpha, mass.

    Returns
    -------
    None where no manoeuvre contains that channel.
    """
    assert against in CONDITION
    unit = shown_unit(UNITS[against])
    across = f"{subscripted(against)} [{unit.text}]" if unit.text else against
    drawn = [entry for entry in entries if entry.shown and entry.condition[against] is not None]
    tiles = []
    for coefficient, term in dict.fromkeys((entry.coefficient, entry.term) for entry in drawn):
        here = [entry for entry in drawn if (entry.coefficient, entry.term) == (coefficient, term)]
        x = np.array([unit.factor * float(entry.condition[against] or 0.0) for entry in here])
        y = np.array([entry.value for entry in here])
        bars = DEVIATIONS * np.array([entry.std_error for entry in here])
        declared = here[0].declared
        span = _widened(float(x.min()), float(x.max()))
        lowest, highest = float(np.min(y - bars)), float(np.max(y + bars))
        marks: list[Mark] = []
        if declared is not None:
            lowest, highest = min(lowest, declared), max(highest, declared)
            marks.append(Line(np.array(span), np.array([declared, declared]), "declared"))
        marks += [
            Line(np.array([at, at]), np.array([v - b, v + b]), "after", 0.8)
            for at, v, b in zip(x, y, bars, strict=True)
        ]
        marks.append(Points(x, y, "after", ordered=False))
        name = f"{subscripted(coefficient)} {term_label(term) if len(term) <= 14 else term[:13] + '…'}"
        tiles.append(Tile(across, name, span, _widened(lowest, highest), tuple(marks)))
    return tiled(tiles, columns=3) if tiles else None


def _widened(low: float, high: float) -> tuple[float, float]:
    margin = 0.08 * (high - low) or 0.05 * max(abs(high), 1e-6)
    return low - margin, high + margin
