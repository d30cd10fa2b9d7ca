"""Expected information of a planned flight: discrimination of models and standard deviations.

Two models that a record cannot tell apart are each fitted to it. On the flight to come the one predicts what the other
cannot follow, however its parameters move within what the record leaves open: the square of that distance, in units of
the noise, is the expected difference of -2 ln L.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, scaled_inverse, whiten


@dataclass(frozen=True)
class Prospect:
    """A flight to come as one model sees it, its initial state free; K parameters that all flights share.

    Attributes
    ----------
    square : float
        Squared distance of what is shown from what the model predicts, in units of the noise.
    slope : ndarray, shape (K,)
        Sensitivities times that distance.
    information : ndarray, shape (K, K)
        Fisher information of the shared parameters.
    """

    square: float
    slope: NDArray[np.float64]
    information: NDArray[np.float64]


def shared_information(estimate: Refinement) -> NDArray[np.float64]:
    """Information matrix (K, K) of the parameters common to all flights: free terms, then the effects' parameters.

    The initial states of the records are free: they are projected out.
    """
    free, states = len(estimate.free), sum(state.size for state in estimate.states)
    size = estimate.information.shape[0]
    shared = np.array([*range(free), *range(free + states, size)], dtype=np.int64)
    return _projected(estimate.information, np.zeros(size), 0.0, shared).information


def prospect(estimate: Refinement, manoeuvre: Manoeuvre) -> Prospect:
    """A planned flight as `estimate` sees it.

    Parameters
    ----------
    estimate : Refinement
        The model, with the initial state of the planned flight alone and noise variances at its sampling.
    manoeuvre : Manoeuvre
        The planned flight; what its sensors show is what another model predicts.

    Raises
    ------
    OutOfRangeError
        Where the model leaves |alpha| < 1.5 rad on it.
    """
    free = len(estimate.free)
    states = estimate.states[0].size
    size = free + states + sum(active.slopes for active in estimate.effects)
    normal, slope, square = np.zeros((size, size)), np.zeros(size), 0.0
    for part in whiten(estimate, [manoeuvre]):
        residual = np.nan_to_num(part.residual).ravel()
        columns = part.columns.reshape(-1, size)
        normal += columns.T @ columns
        slope += columns.T @ residual
        square += float(residual @ residual)
    shared = np.array([*range(free), *range(free + states, size)], dtype=np.int64)
    return _projected(normal, slope, square, shared)


def expected_difference(known: NDArray[np.float64], ahead: Prospect, repeats: int = 1) -> float:
    """By how much -2 ln L of this model would rise above the other's, its parameters re-fitted to first order.

    Parameters
    ----------
    known : ndarray, shape (K, K)
        Information of the present records: moving away from their estimate is penalised.
    ahead : Prospect
        One flight to come, showing what the other model predicts.
    repeats : int
        How often it is flown.

    Notes
    -----
    min over x of n |r - A x|^2 + x'F x = n r'r - n^2 r'A (F + n A'A)^-1 A'r: the criterion of T-optimality, Atkinson &
    Fedorov, Biometrika 62 (1), 1975, with the present information as a constraint on the competing parameters.
    """
    inverse = scaled_inverse(known + repeats * ahead.information)
    inverse[~np.isfinite(inverse)] = 0.0
    taken = repeats**2 * float(ahead.slope @ inverse @ ahead.slope)
    return max(repeats * ahead.square - taken, 0.0)


def expected_deviations(known: NDArray[np.float64], ahead: Prospect, repeats: int = 1) -> NDArray[np.float64]:
    """Standard deviations (K,) after the flight, residuals being white: Cramer-Rao bound of old and new together."""
    return np.asarray(np.sqrt(np.diag(scaled_inverse(known + repeats * ahead.information))))


def probability_distinguished(difference: float, present: float, reach: float) -> float:
    """Probability of distinguishing two models, whichever is true, for an expected difference of -2 ln L.

    Parameters
    ----------
    difference : float
        Expected from the flight to come.
    present : float
        The difference in the present records, which is against the true one in the worse case.
    reach : float
        From which difference on one of them is no longer an alternative.

    Notes
    -----
    The difference is normal with the mean given and a variance of four times it: twice the projection of the noise on
    the distance between the models (Cox, 1961, for Gaussian models).
    """
    if difference <= 0.0:
        return 0.0
    return float(ndtr((difference - abs(present) - reach) / (2.0 * np.sqrt(difference))))


def needed_difference(present: float, reach: float, certain: float) -> float:
    """The expected difference of -2 ln L from which the models are distinguished with a probability `certain`."""
    quantile = float(ndtri(certain))
    return float((quantile + np.sqrt(quantile**2 + abs(present) + reach)) ** 2)


def _projected(
    normal: NDArray[np.float64], slope: NDArray[np.float64], square: float, shared: NDArray[np.int64]
) -> Prospect:
    """The least-squares problem with all but the `shared` parameters solved for."""
    others = np.setdiff1d(np.arange(normal.shape[0]), shared)
    inner = scaled_inverse(normal[np.ix_(others, others)])
    inner[~np.isfinite(inner)] = 0.0
    cross = normal[np.ix_(shared, others)]
    return Prospect(
        square=max(square - float(slope[others] @ inner @ slope[others]), 0.0),
        slope=slope[shared] - cross @ inner @ slope[others],
        information=normal[np.ix_(shared, shared)] - cross @ inner @ cross.T,
    )
