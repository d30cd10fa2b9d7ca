"""The residual of the declared structure: the affected channels, and the equation in which it acts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from aerosid.loop.result import ClosedLoop
from aerosid.model_error.aircraft_error.force_history import ErrorHistory
from aerosid.notation import listed, number
from aerosid.reporting.error_rows import note_on_unknown_noise
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.figures.strip_charts import model_error_chart
from aerosid.reporting.judgement import noise_is_the_measure


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any]:
    """Channels by their error over the noise, equations by d(t), and d(t) of every identification log."""
    counted = noise_is_the_measure(result)
    missed = _over_noise(result) if counted else _over_variation(result)
    return {
        "counted": counted,
        "channels": {log: sorted(rows, reverse=True) for log, rows in missed.items()},
        "doubts": {log: note_on_unknown_noise([row for row in result.errors if row.log == log]) for log in missed},
        "explained": any(history.terms or history.effects for history in result.model_error),
        "effects": any(history.effects for history in result.model_error),
        "what": _what(result.model_error),
        "kept": _kept(result.model_error),
        "banded": any(history.deviation is not None for history in result.model_error),
        "equations": [_equation(history) for history in result.model_error],
        "figures": [_figure(log, result, figures) for log in dict.fromkeys(h.log for h in result.model_error)],
    }


def _over_noise(result: ClosedLoop) -> dict[str, list[tuple[float, str]]]:
    """By log, the residual of each channel of the re-estimated declared structure in units of its noise."""
    times: dict[str, list[tuple[float, str]]] = {}
    for row in result.errors:
        if row.role == "identification" and row.before is not None and row.noise > 0.0:
            known = times.setdefault(row.log, [])
            if not row.noise_doubt:
                known.append((row.before / row.noise, row.channel))
    return times


def _over_variation(result: ClosedLoop) -> dict[str, list[tuple[float, str]]]:
    """By log, the residual of each channel of the re-estimated declared structure, per cent of its variation."""
    shares: dict[str, list[tuple[float, str]]] = {}
    for row in result.fit:
        if row.role == "identification" and row.variant == "before" and row.r2 is not None:
            shares.setdefault(row.log, []).append((100.0 * max(1.0 - row.r2, 0.0) ** 0.5, row.channel))
    return shares


def _equation(history: ErrorHistory) -> dict[str, Any]:
    """Size of d(t), time of its largest value, and the fraction of its variance that the found terms explain."""
    present = np.isfinite(history.d)
    d, time = history.d[present], history.time[present]
    spread = float(np.std(d)) if d.size else None
    share = None
    if (history.terms or history.effects) and spread and not history.left_its_range:
        share = 1.0 - float(np.var(d - history.explained[present])) / spread**2
    return {
        "history": history,
        "spread": spread,
        "largest_at": float(time[np.argmax(np.abs(d - np.mean(d)))]) if d.size else None,
        "share": share,
    }


def _what(histories: Sequence[ErrorHistory]) -> str:
    """What was identified and is compared with d(t)."""
    if not any(history.effects for history in histories):
        return "identified terms"
    return "identified terms and effects" if any(history.terms for history in histories) else "identified effects"


def _kept(histories: Sequence[ErrorHistory]) -> str:
    """A sentence on identified effects that remain in the model whose error d(t) is; empty where there is none."""
    names = dict.fromkeys(name for history in histories for name in history.kept)
    if not names:
        return ""
    return f"The identified {listed(list(names))} {'are' if len(names) > 1 else 'is'} held by that structure already"


def _told_of(history: ErrorHistory) -> str:
    """The found terms and effects of one equation, and how well they reproduce its d(t)."""
    if history.left_its_range:
        at = history.time[np.nanargmax(np.abs(history.d))]
        return (
            f"{history.coefficient}: at {at:.1f} s d(t) exceeds any plausible error of the coefficient; the estimator "
            "left its range there, and no term is compared with it"
        )
    if not history.terms and not history.effects:
        return f"{history.coefficient}: no term identified"
    names = f"{', '.join(history.terms)}, " if history.terms else ""
    return f"{history.coefficient}: {names}correlation {number(history.correlation, 3)}"


def _figure(log: str, result: ClosedLoop, figures: FigureBook) -> Any:
    histories = [history for history in result.model_error if history.log == log]
    found = [_told_of(history) for history in histories]
    smoothed = any(history.deviation is not None for history in histories)
    which = f"Model error d(t) of {log}{', smoothed over the whole record' if smoothed else ''}"
    acting = dict.fromkeys(name for history in histories for name in history.effects)
    comparison = f" Compared with it in every equation: {listed(list(acting))}." if acting else ""
    caption = f"{which}.{comparison} {'; '.join(found)}."
    label = f"Time histories of d(t) in {', '.join(history.coefficient for history in histories)}"
    return figures.add(model_error_chart(histories), caption, label)
