"""Weights of the criterion J, their relation to covariances, and the factor 2 settled once.

The criterion is J = int (y - h)' Q1 (y - h) + d' Q2 d dt + (1/2) (x(0) - x0)' S0^-1 (x(0) - x0).

Its weights may be read in two ways, and the factor 2 in (9)-(12), (21)-(23) goes one way or the other:
Q1 = R^-1, Q2^-1 = Q makes x^ the Kalman filter's estimate and 2 S its covariance; (1/2) Q1^-1 = R, (1/2) Q2^-1 = Q
makes S itself the covariance. This package holds to the first: **covariance = 2 S, everywhere**.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import UsageError
from aerosid.model_error.invariant_embedding.step_map import read_map, step_map
from aerosid.model_error.invariant_embedding.step_work import step_work

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Weights:
    """Weights of the criterion; see the module for their reading.

    Attributes
    ----------
    Q1 : (p, p) or (N, p, p)
        Weight of the residual, positive semi-definite; the k-th of N holds from sample k to k + 1.
    Q2_inverse : (n, n) or (N, n, n)
        Inverse of the weight of the model error, positive semi-definite: zero where the model is exact.
    S0 : (n, n)
        Riccati matrix at the beginning, half the covariance of the initial state, positive semi-definite.
    """

    Q1: Array
    Q2_inverse: Array
    S0: Array

    def __post_init__(self) -> None:
        for name in ("Q1", "Q2_inverse", "S0"):
            value = np.array(getattr(self, name), dtype=np.float64, order="C")
            if value.ndim not in ((2, 3) if name != "S0" else (2,)) or value.shape[-1] != value.shape[-2]:
                raise UsageError(
                    f"{name} has shape {value.shape} where a square matrix, or one a sample, was expected."
                )
            _require_weight(name, value)
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def with_model_error_scaled(self, factor: float) -> Weights:
        """These weights with Q2^-1 times `factor`."""
        return Weights(self.Q1, self.Q2_inverse * factor, self.S0)


def _require_weight(name: str, value: Array) -> None:
    if not np.all(np.isfinite(value)):
        raise UsageError(f"{name} holds a value that is not finite; give finite weights.")
    diagonal = np.abs(np.diagonal(value, axis1=-2, axis2=-1))
    unit = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    # In units of its own diagonal, so that 1e-12 beside 1 is judged as strictly as 1 beside 1.
    scaled = value / (unit[..., :, None] * unit[..., None, :])
    if not np.allclose(scaled, np.swapaxes(scaled, -1, -2), rtol=0.0, atol=1e-9):
        raise UsageError(f"{name} is not symmetric; give a symmetric matrix.")
    smallest = float(np.linalg.eigvalsh(scaled).min()) if value.size else 0.0
    if smallest < -1e-9:
        raise UsageError(
            f"{name} is not positive semi-definite (its smallest eigenvalue is {smallest:.3g} in units of its "
            "diagonal); give variances or their inverses."
        )


def continuous_weights(R: ArrayLike, interval: ArrayLike, density: ArrayLike, P0: ArrayLike) -> Weights:
    """Weights of the continuous criterion for sampled data.

    Parameters
    ----------
    R : (p, p) or (N, p, p)
        Covariance of one sample's noise.
    interval : float or (N,)
        Time between samples, s; one value for an even record. With N values a gap in the record does not count as
        information.
    density : (n, n)
        Spectral density Qc of the model error, (state units / s)^2 s.
    P0 : (n, n)
        Covariance of the initial state.

    Returns
    -------
    Weights
        Q1 = (R dt)^-1, Q2^-1 = Qc, S0 = P0 / 2.
    """
    dt = np.asarray(interval, dtype=np.float64)
    Q1 = np.linalg.inv(np.asarray(R, dtype=np.float64)) / (dt if dt.ndim == 0 else dt[:, None, None])
    return Weights(Q1, np.asarray(density, dtype=np.float64), 0.5 * np.asarray(P0, dtype=np.float64))


def discrete_weights(R: ArrayLike, Q: ArrayLike, P0: ArrayLike) -> Weights:
    """Weights of the discrete criterion: Q1 = R^-1, Q2^-1 = Q, S0 = P0 / 2.

    Parameters
    ----------
    R : (p, p) or (N, p, p)
        Covariance of one sample's noise.
    Q : (n, n) or (N, n, n)
        Covariance of the model error of one step; `step_covariance` gives it from a density.
    P0 : (n, n)
        Covariance of the initial state.
    """
    Q1 = np.linalg.inv(np.asarray(R, dtype=np.float64))
    return Weights(Q1, np.asarray(Q, dtype=np.float64), 0.5 * np.asarray(P0, dtype=np.float64))


def step_covariance(F: Array, density: Array, dt: float) -> Array:
    """The integral of exp(F s) Qc exp(F' s) over a step: the covariance that a model error of density Qc leaves.

    Parameters
    ----------
    F : (n, n)
        f_x, 1/s times state units.
    density : (n, n)
        Qc.
    dt : float
        Length of the step, s.

    Returns
    -------
    (n, n) array
    """
    n = F.shape[0]
    work = step_work(n, 0, 0)
    F, W = np.array(F, dtype=np.float64, order="C"), np.array(density, dtype=np.float64, order="C")
    if not step_map(F, W, np.zeros((n, n)), float(dt), work):
        raise UsageError(f"The step of {dt} s cannot be formed: f_x or the density is not finite.")
    Phi, Q, G, none = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, 0))
    read_map(work, Phi, Q, G, none, none)
    return Q
