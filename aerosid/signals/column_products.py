"""Normal equations of candidate columns taken one at a time, without their mutual products."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def column_products(block: NDArray[np.float64], apart: Sequence[Sequence[int]] = ()) -> NDArray[np.float64]:
    """Sums over the samples of every product of two columns.

    Parameters
    ----------
    block : (n, C)
        No NaN.
    apart : sequence of sequence of int
        Groups of columns. Two columns of which each is in a group have a product only where some group holds both;
        a catalogue of hundreds would cost a hundred times what is asked of it otherwise.

    Returns
    -------
    (C, C), symmetric; 0 where no product is wanted.
    """
    if not apart:
        return np.asarray(block.T @ block)
    grouped = np.unique(np.concatenate([np.asarray(group, dtype=np.int64) for group in apart]))
    others = np.setdiff1d(np.arange(block.shape[1]), grouped)
    products = np.zeros((block.shape[1], block.shape[1]))
    products[grouped, grouped] = np.einsum("nc,nc->c", block[:, grouped], block[:, grouped])
    for size in {len(group) for group in apart if len(group) > 1}:
        places = np.array([group for group in apart if len(group) == size], dtype=np.int64)
        columns = block[:, places.ravel()].reshape(-1, *places.shape)
        products[places[:, :, None], places[:, None, :]] = np.einsum("ngs,ngt->gst", columns, columns)
    rows = block[:, others].T @ block
    products[others] = rows
    products[:, others] = rows.T
    return products
