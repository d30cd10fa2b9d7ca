"""The effects that were chosen, with the evidence for each."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The effects; None where none was found."""
    confirmed = any(effect.evidence.confirmation is not None for effect in result.effects)
    # Only effects of moving air have a scale length.
    air = any("length" in effect.parameters for effect in result.effects)
    return {"effects": result.effects, "confirmed": confirmed, "air": air} if result.effects else None
