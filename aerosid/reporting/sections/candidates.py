"""Candidate effects for the residual, with the evidence for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.model_error.paper_chain.screening import RegressorPicture
from aerosid.notation import listed, number
from aerosid.reporting.figures.cross_plots import cross_plots
from aerosid.reporting.figures.numbered import Figure, FigureBook


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any]:
    """d(t) against the found terms and their closest rivals, and how many candidates were screened."""
    found = {(row.coefficient, row.term): row.value for row in result.derivatives}
    turned = [
        f"{picture.coefficient} {picture.term}"
        for picture in result.regressors
        if picture.chosen and picture.slope * found.get((picture.coefficient, picture.term), 0.0) < 0.0
    ]
    return {
        "screening": result.screening,
        "chosen": [row for row in result.screening if row.chosen],
        "plots": _plots(result.regressors, found, figures) if result.regressors else None,
        "entered": any(picture.chosen for picture in result.regressors),
        "rivals": any(not picture.chosen for picture in result.regressors),
        "equations": result.decided_by == "equations",
        "turned": listed(turned),
    }


_ACROSS, _TILES = 3, 6
"""Display: plots in a row, and number of plots where no more terms entered."""


def _plots(drawn: Sequence[RegressorPicture], found: Mapping[tuple[str, str], float], figures: FigureBook) -> Figure:
    coefficients = list(dict.fromkeys(picture.coefficient for picture in drawn))
    chosen = sum(picture.chosen for picture in drawn)
    # Rivals complete the rows begun by the terms that entered.
    room = max(_TILES, -(-chosen // _ACROSS) * _ACROSS) - chosen
    rivals = sorted((each for each in drawn if not each.chosen), key=lambda each: -abs(each.correlation))[:room]
    kept = [each for each in drawn if each.chosen or each in rivals]
    pictures = sorted(
        kept, key=lambda picture: coefficients.index(picture.coefficient)
    )  # a competing term next to the selected one
    evidence = "; ".join(
        f"{picture.coefficient} {picture.term}: slope {number(picture.slope, 3)}, correlation "
        f"{number(picture.correlation, 3)} ({_fate(picture, found)})"
        for picture in pictures
    )
    label = f"Cross-plots of d(t) against {', '.join(f'{p.coefficient} {p.term}' for p in pictures)}"
    what = "Unsmoothed model error of the recursion against single terms; slope and correlation of the points"
    return figures.add(cross_plots(pictures), f"{what}. {evidence}.", label)


def _fate(picture: RegressorPicture, found: Mapping[tuple[str, str], float]) -> str:
    """Outcome for the candidate: its value as in the tables, or none."""
    if not picture.chosen:
        return "not included"
    value = found.get((picture.coefficient, picture.term))
    return "included" if value is None else f"value {number(value, 3)}"
