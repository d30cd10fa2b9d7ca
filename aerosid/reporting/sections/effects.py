"""The effects that were chosen, with the evidence for each."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The effects; None where none was found."""
    if not result.effects:
        return None
    confirmed = any(effect.evidence.confirmation is not None for effect in result.effects)
    # Only effects of moving air have a scale length.
    air = any("length" in effect.parameters for effect in result.effects)
    correlated = any(effect.evidence.correlation is not None for effect in result.effects)
    gains = (gain for e in result.effects for gain in (e.evidence.validation_gain, e.evidence.hold_out_gain))
    return {
        "effects": result.effects,
        "confirmed": confirmed,
        "air": air,
        "by_response": result.decided_by == "equations",
        "correlated": correlated,
        "validated": any(gain is not None for gain in gains),
    }
