"""The information of the filter's adjoint, backwards through a measurement and through a step, as the smoother has it.

Modified Bryson-Frazier form (Bierman, Automatica 9, 1973).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline

Array = NDArray[np.float64]


@njit_inline
def information_before_measurement(row: Array, gain: Array, spread: float, information: Array, through: Array) -> float:
    """Lambda <- (I - K h)' Lambda (I - K h) + h h' / s, (S, S), in place; `through` is work space.

    Returns 1/s + K' Lambda K.
    """
    size = row.shape[0]
    quadratic = 1.0 / spread
    for a in range(size):
        through[a] = 0.0
        for b in range(size):
            through[a] += information[a, b] * gain[b]
    for a in range(size):
        quadratic += gain[a] * through[a]
    for a in range(size):
        for b in range(size):
            information[a, b] += row[a] * row[b] * quadratic - row[a] * through[b] - through[a] * row[b]
    return quadratic


@njit_inline
def information_before_step(transition: Array, information: Array, half: Array) -> None:
    """Lambda <- Phi' Lambda Phi, (S, S), in place; `half` is work space."""
    size = information.shape[0]
    for a in range(size):
        for b in range(size):
            half[a, b] = 0.0
    for c in range(size):
        for a in range(size):
            share = transition[c, a]
            if share != 0.0:
                for b in range(size):
                    half[a, b] += share * information[c, b]
    for a in range(size):
        for b in range(size):
            information[a, b] = 0.0
        for c in range(size):
            share = half[a, c]
            for b in range(size):
                information[a, b] += share * transition[c, b]
