"""Error rows grouped by log, and the scale on which they are compared with the noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.result import ClosedLoop
from aerosid.notation import SUPERSCRIPTS, listed
from aerosid.reporting.roles import label_of

MOST_TICKS = 2
"""Display: maximum number of intervals of the scale: more would make the numbers overlap."""


def by_log(rows: Sequence[ErrorRow], result: ClosedLoop) -> list[dict[str, Any]]:
    """The error rows of each log of a result, with its name, role and use, in their order."""
    logs = dict.fromkeys((row.log, row.role) for row in rows)
    return [
        {
            "log": log,
            "role": role,
            "label": label_of(role, result),
            "rows": (held := [row for row in rows if (row.log, row.role) == (log, role)]),
            "doubts": note_on_unknown_noise(held),
            "identified": result.identified,
        }
        for log, role in logs
    ]


def note_on_unknown_noise(rows: Sequence[ErrorRow]) -> str:
    """Channels of one log whose noise cannot be estimated, with the reason; empty where it can for all."""
    channels: dict[str, list[str]] = {}
    for row in rows:
        if row.noise_doubt:
            channels.setdefault(row.noise_doubt, []).append(row.channel)
    if not channels:
        return ""
    reasons = "; ".join(f"{listed(names)} ({doubt})" for doubt, names in channels.items())
    return f"The noise cannot be estimated from the recording for {reasons}: no error is given in units of it."


def noise_scale(rows: Sequence[ErrorRow]) -> dict[str, Any]:
    """Positions of errors on a scale from the noise (1) to the largest multiple of it, in per cent of its length."""
    known = [row for row in rows if row.noise > 0.0 and not row.noise_doubt]
    multiples = [value / row.noise for row in known for value in (row.before, row.after) if value]
    decades = max(1.0, math.log10(max(multiples, default=10.0)))

    def place(value: float | None, noise: float) -> float | None:
        if not value or not noise > 0.0 or not math.isfinite(value / noise):
            return None
        return round(100.0 * min(max(math.log10(value / noise) / decades, 0.0), 1.0), 1)

    step = -(-int(decades) // MOST_TICKS) or 1
    powers = range(0, int(decades) + 1, step)
    return {"place": place, "ticks": [(_power(k), round(100.0 * k / decades, 1)) for k in powers]}


def _power(exponent: int) -> str:
    """A power of ten as a multiple."""
    return f"{10**exponent}×" if exponent < 4 else f"10{str(exponent).translate(SUPERSCRIPTS)}×"
