"""Stationary multivariate noise: products with the inverse of its covariance, by its spectrum.

The covariance of N samples of p channels is block Toeplitz, so that a product with it is a convolution; its inverse is
applied by conjugate gradients, preconditioned with the circulant that lies nearest. Cost and memory grow as N log N.
"""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_TOLERANCE = 1e-11
"""Numerical: residual over the right-hand side at which conjugate gradients end."""

_MOST_STEPS = 2000
"""Numerical: steps of conjugate gradients at most."""


class StationaryNoise:
    """The covariance of noise at the samples that were measured.

    Parameters
    ----------
    covariance : ndarray, shape (p, p, N)
        [i, j, k]: covariance of channel i with channel j k samples later.
    held : ndarray of bool, shape (p, N)
        Which samples were measured; the rest take no part.

    Raises
    ------
    ValueError
        Where a channel has no noise, or the covariance is not positive definite.
    """

    def __init__(self, covariance: FloatArray, held: NDArray[np.bool_]) -> None:
        deviation = np.sqrt(np.maximum(np.diagonal(covariance[:, :, 0]), 0.0))
        if not np.all(deviation > 0.0):
            raise ValueError("an output without noise has no bound")
        self._scale = 1.0 / deviation  # channels differ by powers of ten
        self._held = held.astype(np.float64)
        samples = covariance.shape[2]
        later = covariance * np.multiply.outer(self._scale, self._scale)[:, :, None]
        earlier = later.transpose(1, 0, 2)[:, :, :0:-1]  # of i with j k samples before
        self._length = scipy.fft.next_fast_len(2 * samples - 1, real=True)
        embedded = np.zeros((*later.shape[:2], self._length))
        embedded[:, :, :samples] = later.transpose(1, 0, 2)
        embedded[:, :, self._length - samples + 1 :] = earlier.transpose(1, 0, 2)
        self._kernel = np.moveaxis(scipy.fft.rfft(embedded), 2, 0)
        self._nearest = self._nearest_circulant(later)

    def _nearest_circulant(self, later: FloatArray) -> NDArray[np.complex128]:
        """The inverse, frequency by frequency, of the circulant nearest to the covariance: T. Chan, 1988, in blocks."""
        samples = later.shape[2]
        share = np.arange(samples) / samples
        ahead = later.transpose(1, 0, 2)
        around = np.zeros_like(ahead)
        around[:, :, 1:] = later[:, :, :0:-1]
        spectrum = np.moveaxis(scipy.fft.rfft((1.0 - share) * ahead + share * around), 2, 0)
        lowest = np.linalg.eigvalsh(spectrum)
        if not float(lowest.min()) > 1e-12 * float(lowest.max()):
            raise ValueError("the noise's covariance is not positive definite")
        return np.asarray(np.linalg.inv(spectrum))

    def solve(self, columns: FloatArray) -> FloatArray:
        """The inverse covariance times columns (p, N, M); rows of missing samples are zero.

        Raises
        ------
        ValueError
            Where the covariance is not positive definite.
        """
        given = columns * (self._scale[:, None] * self._held)[:, :, None]
        solved = np.stack([self._solve_one(given[:, :, m]) for m in range(columns.shape[2])], axis=2)
        return np.asarray(solved * self._scale[:, None, None])

    def _solve_one(self, right: FloatArray) -> FloatArray:
        x = np.zeros_like(right)
        residual = right.copy()
        size = float(np.linalg.norm(right))
        if size == 0.0:
            return x
        moved = self._precondition(residual)
        direction, before = moved.copy(), float(np.vdot(residual, moved))
        for _ in range(_MOST_STEPS):
            product = self._multiply(direction)
            curvature = float(np.vdot(direction, product))
            if not curvature > 0.0:
                break
            x += before / curvature * direction
            residual -= before / curvature * product
            if np.linalg.norm(residual) <= _TOLERANCE * size:
                return x
            moved = self._precondition(residual)
            after = float(np.vdot(residual, moved))
            direction = moved + after / before * direction
            before = after
        raise ValueError("the noise's covariance is not positive definite")

    def _multiply(self, x: FloatArray) -> FloatArray:
        spectrum = scipy.fft.rfft(x, self._length)
        product = np.matmul(self._kernel, spectrum.T[:, :, None])[:, :, 0].T
        return np.asarray(scipy.fft.irfft(product, self._length)[:, : x.shape[1]] * self._held)

    def _precondition(self, x: FloatArray) -> FloatArray:
        spectrum = np.matmul(self._nearest, scipy.fft.rfft(x).T[:, :, None])[:, :, 0].T
        return np.asarray(scipy.fft.irfft(spectrum, x.shape[1]) * self._held)
