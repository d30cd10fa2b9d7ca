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
"""Numerical: pairs of length and standard deviation whose transforms are kept; a search comes back to the same few."""


def gaussian_filtered(values: Array, samples: float) -> Array:
    """Signals (..., N) averaged with the weights of a Gaussian, held at their end values beyond both ends.

    Parameters
    ----------
    values : ndarray, shape (..., N)
    samples : float
        Standard deviation of the Gaussian, samples.

    Notes
    -----
    Cyclic convolution over the record and the Gaussian's reach on both sides: the cost does not grow with the
    Gaussian's width, as that of a direct sum does.
    """
    reach = reach_of(samples)
    count = values.shape[-1]
    length = scipy.fft.next_fast_len(count + 2 * reach, real=True)
    padded = np.empty((*values.shape[:-1], length))
    padded[..., :reach] = values[..., :1]
    padded[..., reach : reach + count] = values
    padded[..., reach + count :] = values[..., -1:]
    cyclic = scipy.fft.irfft(scipy.fft.rfft(padded) * bell_spectrum(samples, length, 0).real, length)
    return np.asarray(cyclic[..., reach : reach + count])


def reach_of(samples: float) -> int:
    """Samples on either side of the middle that the bell has."""
    return int(REACH * samples + 0.5)


@lru_cache(maxsize=3 * KEPT_SPECTRA)
def bell_spectrum(samples: float, length: int, power: int) -> NDArray[np.complex128]:
    """Transform of the weights times the distance ahead, in standard deviations, to a power.

    Centred on sample zero of so many; the weights themselves are symmetric, so that they have no phase.
    """
    reach = reach_of(samples)
    ahead = np.arange(-reach, reach + 1) / samples
    bell = np.exp(-0.5 * ahead**2)
    about = np.zeros(length)
    # A sample at a distance ahead reaches back to the one in question: the weights run the other way.
    np.add.at(about, -np.arange(-reach, reach + 1), ahead**power * bell / bell.sum())
    return np.asarray(scipy.fft.rfft(about))
