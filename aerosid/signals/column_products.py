"""Products of the columns of sensitivities, summed over the samples, output by output."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def output_products(block: NDArray[np.float64], measured: NDArray[np.int64]) -> NDArray[np.float64]:
    """Sums over the samples of every product of two columns of each output.

    Parameters
    ----------
    block : (n, m, C)
        No NaN.
    measured : (k,) int
        The outputs, in rising order, whose columns are not zero throughout.

    Returns
    -------
    (m, C, C), symmetric.
    """
    products = np.zeros((block.shape[1], block.shape[2], block.shape[2]))
    first, last = (int(measured[0]), int(measured[-1]) + 1) if measured.size else (0, 0)
    columns = block[:, first:last]
    np.matmul(columns.transpose(1, 2, 0), columns.transpose(1, 0, 2), out=products[first:last])
    return products
