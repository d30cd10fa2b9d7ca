"""Cross-plots: the model error against single terms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.model_error.paper_chain.screening import RegressorPicture
from aerosid.reporting.figures.chart import Chart, FloatArray, Limits, Line, Points, Role
from aerosid.reporting.figures.layout import Tile, tiled
from aerosid.reporting.words import subscripted, term_label

_DRAWN = 1500
"""Display: maximum number of points of one plot: a longer record is decimated."""


def cross_plots(pictures: Sequence[RegressorPicture]) -> Chart:
    """d(t) against each term, both passed through the same estimator, with the least-squares line."""
    return tiled([_tile(picture) for picture in pictures], columns=3, tile_height=84.0)


def _tile(picture: RegressorPicture) -> Tile:
    step = max(1, -(-picture.candidate.size // _DRAWN))
    x, y = picture.candidate[::step], picture.left[::step]
    across, up = _around(picture.candidate), _around(picture.left)
    ends = np.array(across)
    line = picture.slope * (ends - np.mean(picture.candidate)) + np.mean(picture.left)
    role: Role = "after" if picture.chosen else "declared"
    return Tile(
        f"{term_label(picture.term)} in {subscripted(picture.coefficient)}",
        "d less other terms" if picture.chosen else "d",
        across,
        up,
        (Points(x, y, ordered=False), Line(ends, line, role, 1.4)),
    )


def _around(values: FloatArray) -> Limits:
    low, high = float(np.min(values, initial=np.inf)), float(np.max(values, initial=-np.inf))
    if not low < high:
        return (low - 1.0, low + 1.0) if np.isfinite(low) else (-1.0, 1.0)
    margin = 0.06 * (high - low)
    return low - margin, high + margin
