"""The candidates that could explain the residual, with the evidence for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.model_error.screening import RegressorPicture
from aerosid.notation import number
from aerosid.reporting.figures.cross_plots import cross_plots
from aerosid.reporting.figures.numbered import Figure, FigureBook


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any]:
    """d(t) against the found terms and their closest rivals, and how many candidates were screened."""
    return {
        "screening": result.screening,
        "chosen": [row for row in result.screening if row.chosen],
        "plots": _plots(result.regressors, figures) if result.regressors else None,
    }


def _plots(found: Sequence[RegressorPicture], figures: FigureBook) -> Figure:
    coefficients = list(dict.fromkeys(picture.coefficient for picture in found))
    pictures = sorted(found, key=lambda picture: coefficients.index(picture.coefficient))  # a rival beside its victor
    said = "; ".join(
        f"{picture.coefficient} {picture.term}: slope {number(picture.slope, 3)}, correlation "
        f"{number(picture.correlation, 3)}{'' if picture.chosen else ' (did not enter)'}"
        for picture in pictures
    )
    label = f"Cross-plots of d(t) against {', '.join(f'{p.coefficient} {p.term}' for p in pictures)}"
    what = "Model error of the recursion, not smoothed, against single terms; slope and correlation of the points"
    return figures.add(cross_plots(pictures), f"{what}. {said}.", label)
