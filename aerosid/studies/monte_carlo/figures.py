"""The figures of a study: errors and bounds, coverage, detection and prediction, each against the noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.reporting.figures.chart import Chart, Limits, Line, Mark, Points, Role
from aerosid.reporting.figures.layout import Tile, tiled
from aerosid.reporting.words import shown_unit, subscripted, term_label
from aerosid.studies.monte_carlo.statistics import DerivativeStatistics, LevelStatistics

FloatArray = NDArray[np.float64]

_ACROSS = "noise over signal, 1/SNR [%]"


def noise_share(level: LevelStatistics, signal: dict[str, float]) -> float:
    """Noise over signal of a level in per cent; the mean over the channels where it is a recording's."""
    if level.snr is None:
        return 0.0
    if isinstance(level.snr, float):
        return 100.0 / level.snr
    return 100.0 * float(np.mean([level.noise[name] / signal[name] for name in signal if signal[name] > 0.0]))


def error_chart(levels: Sequence[LevelStatistics], shares: Sequence[float]) -> Chart:
    """Root-mean-square error, its bound and the bias of each derivative, in per cent of its true value."""
    return _by_derivative(
        levels,
        shares,
        "error [%]",
        lambda row: [
            ("measured", None if row.crlb is None else _percent(row, row.crlb)),
            ("after", _percent(row, row.rmse)),
            ("declared", _percent(row, abs(row.bias))),
        ],
    )


def coverage_chart(levels: Sequence[LevelStatistics], shares: Sequence[float]) -> Chart:
    """Coverage of the true value by the 95 % interval of each derivative: corrected, as published, plain."""
    return _by_derivative(
        levels,
        shares,
        "coverage [%]",
        lambda row: [
            ("declared", _hundredfold(row.coverage95_plain)),
            ("before", _hundredfold(row.coverage95_published)),
            ("after", _hundredfold(row.coverage95)),
        ],
        level=95.0,
        highest=101.0,
    )


def detection_chart(levels: Sequence[LevelStatistics], shares: Sequence[float]) -> Chart:
    """Fraction of runs that identify all missing effects, and of runs that identify a wrong one."""
    found = [_hundredfold(level.detected) for level in levels]
    false = [_hundredfold(level.false_alarms) for level in levels]
    tiles = []
    detection: tuple[tuple[str, list[float | None], Role], ...] = (
        ("detected [%]", found, "after"),
        ("false alarms [%]", false, "declared"),
    )
    for label, values, role in detection:
        if any(value is not None for value in values):
            tiles.append(_tile(label, shares, [(role, values)], (0.0, 105.0) if role == "after" else None))
    return tiled(tiles)


def prediction_chart(levels: Sequence[LevelStatistics], shares: Sequence[float]) -> Chart:
    """Median error of the predicted flight in each channel, re-estimated and completed model."""
    tiles = []
    for n, row in enumerate(levels[0].prediction):
        unit = shown_unit(row.unit)
        lines: list[tuple[Role, list[float | None]]] = []
        for role in ("before", "after"):
            values = [getattr(level.prediction[n], role) if level.prediction else None for level in levels]
            lines.append((role, [None if value is None else unit.factor * value for value in values]))
        tiles.append(_tile(f"{subscripted(row.channel)} [{unit.text or '1'}]", shares, lines))
    return tiled(tiles, columns=3)


def _hundredfold(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _percent(row: DerivativeStatistics, value: float) -> float:
    return 100.0 * value / abs(row.true) if row.true else np.nan


def _by_derivative(
    levels: Sequence[LevelStatistics],
    shares: Sequence[float],
    label: str,
    numbers: Callable[[DerivativeStatistics], list[tuple[Role, float | None]]],
    level: float | None = None,
    highest: float | None = None,
) -> Chart:
    held = [(share, found) for share, found in zip(shares, levels, strict=True) if found.derivatives]
    across = [share for share, _ in held]
    tiles = []
    for n, first in enumerate(held[0][1].derivatives):
        columns = [numbers(found.derivatives[n]) for _, found in held]
        lines: list[tuple[Role, list[float | None]]] = [
            (role, [column[k][1] for column in columns]) for k, (role, _) in enumerate(columns[0])
        ]
        name = f"{subscripted(first.coefficient)} {_formula(first.term)}: {label}"
        limits = None
        if highest is not None:
            known = [value for _, values in lines for value in values if value is not None]
            limits = (min(min(known, default=90.0) - 3.0, 90.0), highest)
        tiles.append(_tile(name, across, lines, limits, level))
    return tiled(tiles, columns=3)


def _formula(term: str) -> str:
    """A term short enough for an axis."""
    return term_label(term) if len(term) <= 14 else f"{term[:13]}…"


def _tile(
    label: str,
    across: Sequence[float],
    lines: Sequence[tuple[Role, Sequence[float | None]]],
    limits: Limits | None = None,
    level: float | None = None,
) -> Tile:
    x = np.array(across, dtype=np.float64)
    order = np.argsort(x, kind="stable")
    marks: list[Mark] = []
    span = (0.0, 1.08 * max(float(x.max()), 1e-9))
    if level is not None:
        marks.append(Line(np.array(span), np.array([level, level]), "muted", 0.7))
    highest = 0.0
    for role, values in lines:
        y = np.array([np.nan if value is None else value for value in values], dtype=np.float64)[order]
        marks += [Line(x[order], y, role), Points(x[order], y, role, ordered=False)]
        highest = max(highest, float(np.max(y[np.isfinite(y)], initial=0.0)))
    return Tile(_ACROSS, label, span, limits or (0.0, 1.1 * highest if highest > 0.0 else 1.0), tuple(marks))
