"""A-priori values of derivatives as evidence in the choice between structures.

An aircraft file that declares a derivative with a standard deviation predicts what the flights show. The estimates do
not use it. A structure with whose estimates the prediction disagrees is the less probable one, though: a moment by a
shifted centre of gravity, say, that needs a static stability ten times the declared one. Such a disagreement reduces ln
L by Huber's function of its distance in standard deviations of both values, quadratic near zero and linear beyond
(Annals of Mathematical Statistics 35 (1), 1964: the logarithm of a normal density with exponential tails).

A-priori standard deviations are judgements, and may all be too small by one factor. It has a log-normal prior and takes
its likeliest value in each structure (hierarchical model; Gelman et al., Bayesian Data Analysis, section 5.4), so that
a file that is wrong throughout prefers no structure to another.

A search that starts from the declared values takes them as normal a-priori information (`inform`); its outcome is
estimated without them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.points import Unknown
from aerosid.flight_model.aerodynamics import Entry

Array = NDArray[np.float64]

FACTORS = 2.0 ** np.linspace(0.0, 5.0, 21)
"""Numerical: factors at which the likeliest is looked for, in quarters of an octave; beyond 32 a file says nothing."""
_LOGARITHMS = np.log(FACTORS)


@dataclass(frozen=True)
class DeclaredValues:
    """Derivatives with a-priori standard deviations.

    Attributes
    ----------
    values : mapping of Entry to (float, float)
        A-priori value and standard deviation.
    tail : float
        Distance, standard deviations, beyond which a disagreement counts linearly.
    misjudged : float
        Standard deviation of the logarithm of their common factor.
    inform : bool
        Whether they inform the estimates too, as normally distributed a-priori values: in a search that starts from
        them, never in one that reports.
    """

    values: Mapping[Entry, tuple[float, float]]
    tail: float
    misjudged: float
    inform: bool = False

    def among(self, unknowns: Sequence[Unknown]) -> DeclaredUnknowns | None:
        """Those among the unknowns of a regression; None without any."""
        rows = [
            (n, *self.values[unknown[1]])  # type: ignore[index]
            for n, unknown in enumerate(unknowns)
            if unknown[0] == "term" and unknown[1] in self.values
        ]
        if not rows:
            return None
        places, values, deviations = zip(*rows, strict=True)
        return DeclaredUnknowns(
            np.array(places), np.array(values), np.array(deviations), self.tail, self.misjudged, self.inform
        )


@dataclass(frozen=True)
class DeclaredUnknowns:
    """The unknowns of a regression that have an a-priori value.

    `places` (D,) among the unknowns, a-priori `values` (D,) and `deviations` (D,); the others as above.
    """

    places: NDArray[np.int64]
    values: Array
    deviations: Array
    tail: float
    misjudged: float
    inform: bool = False

    @property
    def precisions(self) -> Array:
        """Information (D,) that they contribute to estimates which they inform."""
        return 1.0 / self.deviations**2

    def disagreement(self, estimates: Array, covariance: Array) -> float:
        """Reduction of ln L by the disagreement of estimates (P,), of covariance (P, P), with the a-priori values.

        An unknown that the records do not determine agrees.
        """
        if self.inform:
            return 0.5 * float(np.sum(((estimates[self.places] - self.values) / self.deviations) ** 2))
        variance = covariance[self.places, self.places]
        shown = variance > 0.0
        widened = np.sqrt(np.outer(FACTORS, self.deviations[shown]) ** 2 + variance[shown])
        distances = np.abs(estimates[self.places] - self.values)[shown] / widened
        near = np.minimum(distances, self.tail)
        losses = near * (distances - 0.5 * near) + np.log(widened / widened[0])
        prior = 0.5 * (_LOGARITHMS / self.misjudged) ** 2
        return float(np.min(losses.sum(axis=1) + prior))
