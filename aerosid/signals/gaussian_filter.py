"""Gaussian low-pass of a sampled signal by the fast Fourier transform."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import NDArray

Array = NDArray[np.float64]

REACH = 4.0
"""Numerical: standard deviations at which the bell is cut off; 6e-5 of its weight lies beyond."""

KEPT_SPECTRA = 64
"""Numerical: pairs of length and standard deviation whose transform is kept; a search comes back to the same few."""


def gaussian_filtered(values: Array, samples: float) -> Array:
    """The signal (N,) averaged with the weights of a Gaussian, held at its end values beyond both ends.

    Parameters
    ----------
    values : ndarray, shape (N,)
    samples : float
        Standard deviation of the Gaussian, samples.

    Notes
    -----
    Cyclic convolution over the record and the Gaussian's reach on both sides: the cost does not grow with the
    Gaussian's width, as that of a direct sum does.
    """
    reach = _reach(samples)
    length = scipy.fft.next_fast_len(values.size + 2 * reach, real=True)
    padded = np.empty(length)
    padded[:reach] = values[0]
    padded[reach : reach + values.size] = values
    padded[reach + values.size :] = values[-1]
    cyclic = scipy.fft.irfft(scipy.fft.rfft(padded) * _transfer(samples, length), length)
    return np.asarray(cyclic[reach : reach + values.size])


def _reach(samples: float) -> int:
    return int(REACH * samples + 0.5)


@lru_cache(maxsize=KEPT_SPECTRA)
def _transfer(samples: float, length: int) -> Array:
    """Real transform of the weights, centred on sample zero of so many; they are symmetric, so that it has no phase."""
    reach = _reach(samples)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / samples) ** 2)
    centred = np.zeros(length)
    np.add.at(centred, np.arange(-reach, reach + 1), bell / bell.sum())
    return np.asarray(scipy.fft.rfft(centred).real)
