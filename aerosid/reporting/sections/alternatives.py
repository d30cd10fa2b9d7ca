"""Alternatives: effects that the manoeuvres cannot distinguish from the chosen ones."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.judgement import fits_better


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """The alternatives, effect by effect."""
    groups: dict[str, list[Any]] = {}
    for effect in result.alternatives:
        groups.setdefault(effect.instead_of, []).append(effect)
    better = any(fits_better(effect) for effect in result.alternatives)
    # The margins of the equations are in terms of the likelihood.
    by_equations = result.decided_by == "equations"
    has_sigma = any(derivative.sigma is not None for derivative in result.aircraft.derivatives)
    return {
        "groups": groups,
        "second": result.second_opinion,
        "better": better,
        "priced": not by_equations,
        "declared": by_equations and has_sigma,
    }
