"""Covariance of regression scores in residuals coloured within and between channels, by smoothed cross-spectra.

A noise model of each channel by itself leaves what neighbouring channels share at other lags: what a filter of the
wrong noise makes of one sensor's noise comes out of all of them. Cross-spectra of the residuals hold both.
"""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from aerosid.signals.moving_window import moving_mean
from aerosid.signals.settings import COLOUR

FloatArray = NDArray[np.float64]


def score_covariance(columns: FloatArray, residuals: FloatArray) -> tuple[FloatArray, float]:
    """Covariance (k, k) of sum_n sum_i columns[n, i, :] residuals[n, i], and its degrees of freedom.

    Parameters
    ----------
    columns : (N, p, k) array
        Regressors of one record, uniformly sampled; zero where a sample is missing.
    residuals : (N, p) array
        Of the regression on them; zero where missing.

    Notes
    -----
    sum_f X(f)* P(f) X(f) with the transforms X of the columns and the cross-spectra P of the residuals, averaged over
    some frequencies: the covariance of least-squares scores in stationary noise of any spectrum (Hannan 1970,
    Multiple Time Series, chapter VII). Degrees of freedom as Satterthwaite (1946) of a sum of independent parts.
    """
    samples = columns.shape[0]
    length = scipy.fft.next_fast_len(2 * samples, real=True)
    waves = scipy.fft.rfft(columns, length, axis=0)
    noise = scipy.fft.rfft(residuals, length, axis=0)
    cross = noise[:, :, None] * noise[:, None, :].conj()
    real, imaginary = (moving_mean(part, COLOUR.neighbours) for part in (cross.real, cross.imag))
    cross = real + 1j * imaginary
    # A channel that is seldom sampled has its noise where it is: products are means over what is there.
    there = np.sqrt(np.maximum(np.count_nonzero(residuals, axis=0), 1))
    cross /= there[:, None] * there
    parts = np.real(np.einsum("fik,fij,fjl->fkl", waves.conj(), cross, waves)) / length
    # Negative frequencies are those above zero again, but for the one in the middle.
    parts[1 : (length + 1) // 2] *= 2.0
    whole = parts.sum(axis=0)
    sizes = np.trace(parts, axis1=1, axis2=2)
    # Padding doubles the number of frequencies; each tells two numbers, and shares what it knows with its neighbours.
    total = float(sizes.sum())
    freedom = COLOUR.neighbours * total**2 / max(float(np.sum(sizes**2)), np.finfo(float).tiny) if total > 0.0 else 1.0
    return 0.5 * (whole + whole.T), max(freedom, 1.0)
