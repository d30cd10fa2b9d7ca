"""What the engineer has to decide: verdict, effects, error before and after, and what is not proven."""

from __future__ import annotations

from typing import Any

from aerosid.loop.error_reduction import told_of_reduction
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.error_rows import by_log, noise_scale
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.judgement import DECISIONS, TONES, headline_rows, unproven


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """Verdict, effects, and the error before and after on the flights that were not used for the fit."""
    rows = headline_rows(result)
    return {
        "tone": TONES[result.verdict],
        "verdict": result.verdict.name.lower().replace("_", " "),
        "meaning": result.verdict.value,
        "decision": DECISIONS[result.verdict],
        "open_points": unproven(result),
        "held_back": bool(rows) and rows[0].role != "identification",
        "reduction": told_of_reduction(result.errors),
        "logs": by_log(rows, result),
        "scale": noise_scale(rows),
    }
