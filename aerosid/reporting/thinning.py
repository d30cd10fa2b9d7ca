"""Thinning of long records for figures, with all extremes kept."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

DRAWN_WHOLE = 2000
"""Display: samples up to which a history is drawn as it is."""

BINS = 600
"""Display: intervals into which a longer one is thinned: more than a figure of 19 cm can show on paper."""


def envelope(
    time: FloatArray, values: FloatArray, whole: int = DRAWN_WHOLE, bins: int = BINS
) -> tuple[FloatArray, FloatArray]:
    """The history, or the smallest and largest sample of each of `bins` intervals where it exceeds `whole` samples.

    Parameters
    ----------
    time, values : ndarray, shape (N,)
        Any units; NaN in `values` is a missing sample.
    whole, bins : int
        As many as paper can show, or as given.

    Returns
    -------
    time, values : ndarray, shape (M,)
        Samples of the history in order of time, M = N or at most 2 `bins`. An interval without samples leaves a gap.
    """
    samples = time.size
    if samples <= whole:
        return time, values
    width = -(-samples // bins)
    padded = np.full(width * -(-samples // width), np.nan)
    padded[:samples] = values
    spans = padded.reshape(-1, width)
    start = width * np.arange(spans.shape[0])
    known = np.isfinite(spans)
    lowest = start + np.argmin(np.where(known, spans, np.inf), axis=1)
    highest = start + np.argmax(np.where(known, spans, -np.inf), axis=1)
    chosen = np.sort(np.stack([lowest, highest], axis=1), axis=1).ravel()
    return time[chosen], values[chosen]


def unbroken(x: FloatArray, y: FloatArray) -> Iterator[FloatArray]:
    """The stretches (M, 2) of samples between missing ones."""
    present = np.isfinite(x) & np.isfinite(y)
    edges = np.flatnonzero(np.diff(present.astype(np.int8), prepend=0, append=0))
    for start, stop in zip(edges[0::2], edges[1::2], strict=True):
        yield np.column_stack([x[start:stop], y[start:stop]])
