"""Element by element in kernels: copies of arrays and small linear systems.

numba compiles an assignment to a slice together with the text of its possible error, and `np.linalg.solve` with several
wrappers of LAPACK: seconds at first use, in every process that compiles. A loop takes neither.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline


@njit_inline
def copy_row(target: NDArray[np.float64], source: NDArray[np.float64]) -> None:
    """The first elements of a vector `target` become those of `source`, of the same size or less."""
    for i in range(source.shape[0]):
        target[i] = source[i]


@njit_inline
def copy_rows(target: NDArray[np.float64], source: NDArray[np.float64]) -> None:
    """The upper left block of a matrix `target` becomes `source`, of the same shape or less."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@njit_inline
def multiply_in_place(left: NDArray[np.float64], matrix: NDArray[np.float64], product: NDArray[np.float64]) -> None:
    """`matrix` (S, M) becomes the product of `left` (S, S) and itself; `product`, as large, is work space."""
    size, width = matrix.shape
    for i in range(size):
        for j in range(width):
            product[i, j] = 0.0
        for k in range(size):
            for j in range(width):
                product[i, j] += left[i, k] * matrix[k, j]
    copy_rows(matrix, product)


@njit_inline
def pivot_row(matrix: NDArray[np.float64], column: int, size: int) -> int:
    """The row, of the first `size`, with the column's largest element on the diagonal or below: partial pivoting."""
    best = column
    for r in range(column + 1, size):
        if abs(matrix[r, column]) > abs(matrix[best, column]):
            best = r
    return best


@njit_inline
def exchange_rows(matrix: NDArray[np.float64], one: int, other: int, first: int, last: int) -> None:
    """Two rows change places in the columns `first` to `last` - 1; left of a pivot nothing is read any more."""
    for c in range(first, last):
        matrix[one, c], matrix[other, c] = matrix[other, c], matrix[one, c]


@njit_inline
def solve_by_elimination(system: NDArray[np.float64], right: NDArray[np.float64]) -> None:
    """Solve `system` (S, S) for the columns of `right` (S, M), in place, by elimination with row exchanges."""
    size, width = right.shape
    for p in range(size):
        best = pivot_row(system, p, size)
        if best != p:
            exchange_rows(system, p, best, p, size)
            exchange_rows(right, p, best, 0, width)
        for r in range(p + 1, size):
            factor = system[r, p] / system[p, p]
            if factor != 0.0:
                for s in range(p + 1, size):
                    system[r, s] -= factor * system[p, s]
                for c in range(width):
                    right[r, c] -= factor * right[p, c]
    for back in range(size):
        p = size - 1 - back
        for r in range(p + 1, size):
            if system[p, r] != 0.0:
                for c in range(width):
                    right[p, c] -= system[p, r] * right[r, c]
        for c in range(width):
            right[p, c] /= system[p, p]
