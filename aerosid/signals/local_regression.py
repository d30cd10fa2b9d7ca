"""Local linear regression of a sampled signal with Gaussian weights, by the fast Fourier transform.

Inside a record it is a low-pass without phase. At the ends, where an average would have to hold the signal, and half of
it would be the noise of one sample, a line through the samples that are there is as good as inside to first order
(Fan & Gijbels, Local Polynomial Modelling and Its Applications, 1996, section 3.2).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from aerosid.signals.gaussian_filter import KEPT_SPECTRA, bell_spectrum, reach_of

Array = NDArray[np.float64]


def locally_smoothed(values: Array, samples: float) -> Array:
    """At each sample the line through a signal (..., N) about it, by least squares with the weights of a Gaussian.

    Parameters
    ----------
    values : ndarray, shape (..., N)
        Two samples at least.
    samples : float
        Standard deviation of the Gaussian, samples.

    Notes
    -----
    With S_k the sum of the weights times the k-th power of the distance to the sample, and T_k that of the signal too,
    the line's value there is (S_2 T_0 - S_1 T_1)/(S_0 S_2 - S_1^2). The sums are convolutions over the record and the
    Gaussian's reach: the cost does not grow with the Gaussian's width, as that of a direct sum does.
    """
    count = values.shape[-1]
    length = scipy.fft.next_fast_len(count + reach_of(samples), real=True)
    s0, s1, s2 = _moments(samples, length, count)
    spectrum = scipy.fft.rfft(values, length)
    t0, t1 = (_sums(spectrum, samples, length, power)[..., :count] for power in (0, 1))
    return np.asarray((s2 * t0 - s1 * t1) / (s0 * s2 - s1 * s1))


@lru_cache(maxsize=KEPT_SPECTRA)
def _moments(samples: float, length: int, count: int) -> tuple[Array, Array, Array]:
    """S_0, S_1, S_2 at each of `count` samples."""
    there = scipy.fft.rfft(np.ones(count), length)
    s0, s1, s2 = (_sums(there, samples, length, power)[:count] for power in (0, 1, 2))
    return s0, s1, s2


def _sums(spectrum: NDArray[np.complex128], samples: float, length: int, power: int) -> Array:
    """Of a signal of that spectrum times weight and distance, over the standard deviation, to a power."""
    return np.asarray(scipy.fft.irfft(spectrum * bell_spectrum(samples, length, power), length))
