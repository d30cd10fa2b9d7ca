"""The effects that were chosen, with the evidence for each."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The effects; nothing where none was found."""
    confirmed = any(effect.evidence.confirmation is not None for effect in result.effects)
    # A scale length is a number of moving air alone.
    air = any("length" in effect.parameters for effect in result.effects)
    return {"effects": result.effects, "confirmed": confirmed, "air": air} if result.effects else None
