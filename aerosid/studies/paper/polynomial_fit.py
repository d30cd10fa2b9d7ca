"""Polynomial regression of the model error of one state equation on two states, as in (29) and (32)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.response import respond
from aerosid.signals.least_squares import recursive_least_squares

Array = NDArray[np.float64]

COEFFICIENTS = ("a1", "a2", "a3", "a4")


@dataclass(frozen=True)
class PolynomialFit:
    """Coefficients of one case.

    Attributes
    ----------
    case : str
        As in the paper.
    removed : tuple of str
        Terms removed from the true model.
    values : dict of str to (float or None)
        a1 .. a4; None for a coefficient that is in the model and not estimated.
    truth : dict of str to (float or None)
        True values.
    samples : int
        Number of points used.
    history : ModelErrorHistory
        Result of the estimator.
    """

    case: str
    removed: tuple[str, ...]
    values: dict[str, float | None]
    truth: dict[str, float | None]
    samples: int
    history: ModelErrorHistory

    @property
    def worst(self) -> float:
        """Largest deviation of an estimated coefficient from its true value."""
        pairs = zip(self.values.values(), self.truth.values(), strict=True)
        return max(abs(value - truth) for value, truth in pairs if value is not None and truth is not None)


def fit_polynomial(
    history: ModelErrorHistory, columns: Array, estimated: tuple[int, ...], *, skipped: int = 0, responded: bool = True
) -> dict[str, float | None]:
    """a1 .. a4 of d1 by recursive least squares at its last sample.

    Parameters
    ----------
    history : ModelErrorHistory
    columns : (M, 4)
        The four candidate functions at the estimated states of each d^.
    estimated : tuple of int
        Which of the four are estimated; the others are None.
    skipped : int
        First points excluded, for poor initial states.
    responded : bool
        Whether the candidates pass through the estimator first; otherwise they are used unchanged.
    """
    chosen = columns[:, list(estimated)]
    if responded:
        candidates = np.zeros((*history.model_error.shape, len(estimated)))
        candidates[:, 0, :] = chosen
        chosen = respond(history, candidates)[:, 0, :]
    fit = recursive_least_squares(chosen[skipped:], history.model_error[skipped:, 0])
    values: dict[str, float | None] = dict.fromkeys(COEFFICIENTS)
    for index, value in zip(estimated, fit.coefficients, strict=True):
        values[COEFFICIENTS[index]] = float(value)
    return values
