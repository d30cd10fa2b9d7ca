"""Autocorrelations of the residuals of a log, channel by channel."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from aerosid.loop.model_validation.goodness import FitRow
from aerosid.reporting.figures.chart import Band, Chart, Line, Mark, Role
from aerosid.reporting.figures.layout import Tile, tiled
from aerosid.reporting.words import subscripted

_ROLES: dict[str, Role] = {"before": "before", "after": "after"}


def autocorrelations(rows: Sequence[FitRow], samples: int) -> Chart:
    """The autocorrelation of every channel's residual over the lag, with the 95 % band of white noise.

    Parameters
    ----------
    rows : sequence of FitRow
        Residuals of one log.
    samples : int
        Samples N of the log: 95 % of the lags of white noise are within 1.96 / sqrt(N).
    """
    bound = 1.96 / math.sqrt(samples)
    channels = list(dict.fromkeys(row.channel for row in rows))
    tiles = []
    for channel in channels:
        own = [row for row in rows if row.channel == channel and row.autocorrelation]
        lags = max((len(row.autocorrelation) for row in own), default=2) - 1
        lines = [Line(np.arange(len(r.autocorrelation), dtype=float), _array(r), _ROLES[r.variant]) for r in own]
        marks: tuple[Mark, ...] = (Band(-bound, bound), *lines)
        tiles.append(Tile("lag [samples]", subscripted(channel), (0.0, float(max(lags, 1))), (-0.6, 1.05), marks))
    return tiled(tiles, columns=4, tile_height=52.0, shared=True)


def _array(row: FitRow) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array(row.autocorrelation, dtype=np.float64)
