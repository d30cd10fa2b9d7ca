"""The result of a model-error estimator: states, model error and Riccati matrix over the record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.model_error.estimators.weights import Weights

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModelErrorHistory:
    """The filter's estimates; everything inside is read-only.

    For N samples, n states, p outputs; M = N for the continuous estimator, whose d^ belongs to the sample, and
    M = N - 1 for the discrete one, whose d^ belongs to the step that begins at the sample.

    Attributes
    ----------
    time : (N,)
        s, or the step number of a discrete model.
    states : (N, n)
        x^, each sample used.
    model_error : (M, n)
        d^ of (23), state units / s; or of (12), state units.
    S : (N, n, n)
        Riccati matrix; 2 S is the covariance of x^.
    innovations : (N, p)
        y - h at the open-loop prediction from the sample before (at the first sample: at x0); NaN where missing.
    F : (N - 1, n, n)
        f_x of each step.
    H : (N, p, n)
        h_x at x^ (continuous) or at the prediction (discrete).
    H_step : (N - 1, p, n)
        h_x frozen over each step (continuous); empty for a discrete model.
    present : (N, p)
        1 where the output was measured, else 0.
    weights : Weights
        As used.
    discrete : bool
        Whether the model is a map from sample to sample.
    """

    time: Array
    states: Array
    model_error: Array
    S: Array
    innovations: Array
    F: Array
    H: Array
    H_step: Array
    present: Array
    weights: Weights
    discrete: bool

    def __post_init__(self) -> None:
        for name in ("time", "states", "model_error", "S", "innovations", "F", "H", "H_step", "present"):
            getattr(self, name).setflags(write=False)

    @property
    def covariance(self) -> Array:
        """Covariance of x^, (N, n, n): 2 S."""
        return 2.0 * self.S

    @property
    def samples(self) -> int:
        """N."""
        return int(self.time.size)
