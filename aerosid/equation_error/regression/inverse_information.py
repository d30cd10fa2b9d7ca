"""The inverse of an information matrix, directions without information left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri

Array = NDArray[np.float64]


LEAST = 1e-10
"""Numerical: eigenvalue of a matrix of unit diagonal below which a direction is not identifiable: rounding."""


def inverse_of_shown(correlation: Array, least: float = LEAST) -> Array:
    """The inverse (P, P) of a matrix of unit diagonal without the unidentifiable directions.

    Those of an eigenvalue below `least`. The inverse's trace is the sum of the eigenvalues' inverses: where it is below
    the inverse of `least`, all are above, and Cholesky's factor is sufficient. Of an unknown without a column, whose
    diagonal element is zero, all elements are zero.
    """
    has_column = np.diag(correlation) > 0.0
    if not has_column.all():
        whole = np.zeros_like(correlation)
        whole[np.ix_(has_column, has_column)] = inverse_of_shown(correlation[np.ix_(has_column, has_column)], least)
        return whole
    factor, failed = dpotrf(correlation)
    if not failed:
        inverse, failed = dpotri(factor)
        if not failed and float(np.trace(inverse)) < 1.0 / least:
            whole = inverse + inverse.T  # of which LAPACK writes the upper half
            np.fill_diagonal(whole, np.diag(inverse))
            return np.asarray(whole)
    eigenvalues, vectors = np.linalg.eigh(correlation)
    shown = np.where(eigenvalues > least, 1.0 / np.maximum(eigenvalues, least), 0.0)
    return np.asarray((vectors * shown) @ vectors.T)
