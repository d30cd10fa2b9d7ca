"""Score test of a step change at every instant of a record, in work and memory linear in its length."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.regression.coloured_regression import Colour

Array = NDArray[np.float64]


def step_change_scores(
    target: Array, known: Array, covariance: Array, colour: Colour, ramp: float, moments: NDArray[np.int64]
) -> Array:
    """Reduction of the sum of squares by a step at each of some samples, in addition to the known regressors.

    Parameters
    ----------
    target : ndarray, shape (N,)
        Whitened residual, in innovations of unit variance.
    known : ndarray, shape (N, p)
        Whitened columns of the regression.
    covariance : ndarray, shape (p, p)
        Of their coefficients.
    colour : Colour
        The whitening filter, applied to the step as well.
    ramp : float
        Rise time of the step, samples, at least 1, its instant in the middle.
    moments : ndarray, shape (m,)
        Samples at which it is tried.

    Returns
    -------
    ndarray, shape (m,)
        Reduction of the sum of squares; 0 where the step is collinear with the known columns.

    Notes
    -----
    A whitened step is the same sequence wherever it begins, then constant: all products with it are one correlation
    with that sequence and one cumulative sum. Steps that begin within the first samples of the filter are whitened
    individually.
    """
    count, order = target.size, colour.start.shape[0]
    half = int(np.ceil(0.5 * ramp))
    first = half + order  # of the moments whose rise begins behind the filter's start
    early, late = moments[moments < first], moments[moments >= first]
    along, squares = np.empty((known.shape[1] + 1, moments.size)), np.empty(moments.size)
    rows = np.column_stack([known, target])
    if early.size:
        white = colour.whitened(_ramps(np.arange(count), early, ramp))
        along[:, : early.size] = rows.T @ white
        squares[: early.size] = np.sum(white * white, axis=0)
    if late.size:
        # From `half` before its instant to `order` behind its rise; constant from then on.
        length = 2 * half + order + 1
        shape = colour.whitened(_ramps(np.arange(order + length), np.array([first]), ramp))[order:, 0]
        level = float(shape[-1])
        padded = np.concatenate([rows, np.zeros((length, rows.shape[1]))])
        remaining = np.concatenate([np.cumsum(padded[::-1], axis=0)[::-1], np.zeros((1, rows.shape[1]))])
        begins = late - half
        products = level * remaining[begins + length]
        for lag, value in enumerate(shape):
            products += value * padded[begins + lag]
        along[:, early.size :] = products.T
        lengths = np.minimum(count - begins, length)
        within = np.concatenate([[0.0], np.cumsum(shape**2)])
        squares[early.size :] = within[lengths] + level**2 * np.maximum(count - begins - length, 0)
    known_along, score = along[:-1], along[-1]
    left = squares - np.sum(known_along * (covariance @ known_along), axis=0)
    return np.where(left > 1e-9 * squares, score**2 / np.maximum(left, 1e-300), 0.0)


def _ramps(samples: NDArray[np.int64], moments: NDArray[np.int64], ramp: float) -> Array:
    """Ramps (N, m) from 0 to 1 about each instant."""
    return np.clip((samples[:, None] - moments[None, :]) / ramp + 0.5, 0.0, 1.0)
