"""The inverse of an information matrix, directions without information left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri

Array = NDArray[np.float64]


def inverse_of_shown(correlation: Array) -> Array:
    """The inverse (P, P) without the unidentifiable directions, whose eigenvalue is below 1e-10.

    The inverse's trace is the sum of the eigenvalues' inverses: where it is below 1e10, all are above, and Cholesky's
    factor is sufficient. Of an unknown without a column all elements are zero.
    """
    has_column = np.diag(correlation) > 0.0
    if not has_column.all():
        whole = np.zeros_like(correlation)
        whole[np.ix_(has_column, has_column)] = inverse_of_shown(correlation[np.ix_(has_column, has_column)])
        return whole
    factor, failed = dpotrf(correlation)
    if not failed:
        inverse, failed = dpotri(factor)
        if not failed and float(np.trace(inverse)) < 1e10:
            whole = inverse + inverse.T  # of which LAPACK writes the upper half
            np.fill_diagonal(whole, np.diag(inverse))
            return np.asarray(whole)
    eigenvalues, vectors = np.linalg.eigh(correlation)
    shown = np.where(eigenvalues > 1e-10, 1.0 / np.maximum(eigenvalues, 1e-10), 0.0)
    return np.asarray((vectors * shown) @ vectors.T)
