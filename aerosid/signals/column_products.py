"""Normal equations of candidate columns taken one at a time, without their mutual products."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Apart(NamedTuple):
    """Columns by what they are multiplied with: those of `others` (k,) with all, those of groups within theirs.

    `groups`: of each size beyond one, the columns (G, size) of the groups.
    """

    others: NDArray[np.int64]
    groups: tuple[NDArray[np.int64], ...]


def columns_apart(count: int, apart: Sequence[Sequence[int]]) -> Apart:
    """What `column_products` takes of groups of columns, among `count` columns."""
    together = np.ones(count, dtype=bool)
    for group in apart:
        together[list(group)] = False
    sizes = sorted({len(group) for group in apart if len(group) > 1})
    groups = tuple(np.array([group for group in apart if len(group) == size], dtype=np.int64) for size in sizes)
    return Apart(np.flatnonzero(together), groups)


def output_products(
    block: NDArray[np.float64], measured: NDArray[np.int64], apart: Apart | None = None
) -> NDArray[np.float64]:
    """As `column_products` of each output's columns, block (n, m, C), all together: (m, C, C).

    `measured` (k,) are the outputs, in rising order, whose columns are not zero throughout.
    """
    products = np.zeros((block.shape[1], block.shape[2], block.shape[2]))
    if apart is not None:
        for i in measured:
            products[i] = column_products(block[:, i], apart)
        return products
    first, last = (int(measured[0]), int(measured[-1]) + 1) if measured.size else (0, 0)
    columns = block[:, first:last]
    np.matmul(columns.transpose(1, 2, 0), columns.transpose(1, 0, 2), out=products[first:last])
    return products


def column_products(block: NDArray[np.float64], apart: Apart | None = None) -> NDArray[np.float64]:
    """Sums over the samples of every product of two columns.

    Parameters
    ----------
    block : (n, C)
        No NaN.
    apart : Apart, optional
        Groups of columns. Two columns of which each is in a group have a product only where some group holds both;
        a catalogue of hundreds would cost a hundred times what is asked of it otherwise.

    Returns
    -------
    (C, C), symmetric; 0 where no product is wanted.
    """
    if apart is None:
        return np.asarray(block.T @ block)
    products = np.zeros((block.shape[1], block.shape[1]))
    np.fill_diagonal(products, np.einsum("nc,nc->c", block, block))
    for places in apart.groups:
        columns = block[:, places.ravel()].reshape(-1, *places.shape)
        products[places[:, :, None], places[:, None, :]] = np.einsum("ngs,ngt->gst", columns, columns)
    rows = block[:, apart.others].T @ block
    products[apart.others] = rows
    products[:, apart.others] = rows.T
    return products
