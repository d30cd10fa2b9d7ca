"""Noise of a study's flights: white, autocorrelated, or resampled from the residuals of a real one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from aerosid.signals.resampling import across_gaps

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ColouredNoise:
    """Noise of unit variance, independent between channels, whose correlation decreases by `memory` per sample.

    AR(1); white for memory 0.
    """

    memory: float

    def draw(self, generator: np.random.Generator, samples: int, channels: int) -> FloatArray:
        """One realisation, (N, p), stationary from the first sample on."""
        fresh = generator.standard_normal((samples, channels))
        if self.memory == 0.0:
            return fresh
        fresh[1:] *= np.sqrt(1.0 - self.memory**2)
        return np.asarray(signal.lfilter([1.0], [1.0, -self.memory], fresh, axis=0))

    def autocovariance(self, samples: int, channels: int) -> FloatArray:
        """[i, j, k]: covariance of channel i with channel j k samples later, (p, p, N)."""
        return np.asarray(np.eye(channels)[:, :, None] * self.memory ** np.arange(samples))


@dataclass(frozen=True)
class RedrawnNoise:
    """Noise of unit variance composed of blocks of recorded residuals, all channels from the same samples.

    Attributes
    ----------
    residuals : ndarray, shape (N, p)
        Residuals without their means, divided by their standard deviations.
    block : int
        Samples per block.

    Notes
    -----
    Circular block bootstrap (Politis & Romano 1992), the first block cut at a random place so that the result is
    stationary: its autocovariance at lag k is that of the residuals times 1 - k/block.
    """

    residuals: FloatArray
    block: int

    def draw(self, generator: np.random.Generator, samples: int, channels: int) -> FloatArray:
        """One realisation, (N, p)."""
        length = self.residuals.shape[0]
        blocks = samples // self.block + 2
        starts = generator.integers(length, size=blocks)
        places = (starts[:, None] + np.arange(self.block)).ravel() % length
        first = int(generator.integers(self.block))
        return self.residuals[places[first : first + samples], :channels]

    def autocovariance(self, samples: int, channels: int) -> FloatArray:
        """[i, j, k]: covariance of channel i with channel j k samples later, (p, p, N)."""
        length = self.residuals.shape[0]
        spectrum = np.fft.rfft(self.residuals[:, :channels], axis=0)
        cross = np.conj(spectrum)[:, :, None] * spectrum[:, None, :]
        circular = np.moveaxis(np.fft.irfft(cross, length, axis=0), 0, 2) / length
        lags = np.arange(samples)
        within = np.maximum(1.0 - lags / self.block, 0.0)
        return np.asarray(circular[:, :, lags % length] * within)


NoiseSource = ColouredNoise | RedrawnNoise


def redrawn(residuals: FloatArray) -> tuple[RedrawnNoise, FloatArray]:
    """The source that draws from residuals (N, p), missing samples interpolated, and standard deviations (p,), SI.

    Notes
    -----
    Block length by Carlstein's rule (Annals of Statistics 14, 1986) for the slowest channel:
    (sqrt(6) rho / (1 - rho^2))^(2/3) N^(1/3), rho the correlation of neighbouring samples.
    """
    filled = across_gaps(residuals)
    filled = filled - filled.mean(axis=0)
    deviation = filled.std(axis=0)
    unit = filled / np.where(deviation > 0.0, deviation, 1.0)
    samples = unit.shape[0]
    rho = min(max(float(np.max(np.mean(unit[1:] * unit[:-1], axis=0))), 0.0), 0.98)
    block = int(np.ceil((np.sqrt(6.0) * rho / (1.0 - rho**2)) ** (2.0 / 3.0) * samples ** (1.0 / 3.0)))
    return RedrawnNoise(unit, int(np.clip(block, 1, max(samples // 4, 1)))), deviation
