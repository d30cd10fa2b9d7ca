"""Collinearity of pitch-rate and alphadot derivatives: the sum that manoeuvres determine, and its parts.

A term of alphadot that the model lacks is absorbed by the others in proportion to the collinearity of its whitened
column (omitted-variable bias: Klein & Morelli, Aircraft System Identification, section 5.1).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import whiten
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.candidate_scores import score_candidates
from aerosid.equation_error.selection.candidates import term_candidates
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.terms import parse_term

Array = NDArray[np.float64]

MOMENT = "C_m"
DAMPING, DOWNWASH = parse_term("q_hat"), parse_term("alpha_dot_hat")

USUAL = (0.3, 0.5)
"""Physical: C_m alphadot over C_m q of conventional aircraft, 1: downwash that reaches the tail late (Etkin & Reid,
Dynamics of Flight, section 5.5, where both are tail terms and their ratio is the slope of the downwash)."""


def downwash_prior(model: AerodynamicModel) -> Mapping[Entry, float]:
    """Prior standard deviation about zero of the alphadot derivatives of coefficients with a pitch-rate derivative, 1.

    Both are due to the tail, the one being the slope of the downwash times the other: its largest usual size is one
    standard deviation.

    Parameters
    ----------
    model : AerodynamicModel
        With declared values; the estimated pitch-rate derivative is biased together with that of alphadot.

    References
    ----------
    Etkin & Reid, Dynamics of Flight, section 5.5.
    """
    sizes = {coefficient: abs(model.value((coefficient, DAMPING))) for coefficient, _ in model.entries}
    return {(coefficient, DOWNWASH): USUAL[1] * size for coefficient, size in sizes.items() if size > 0.0}


@dataclass(frozen=True)
class AliasedDerivative:
    """Another derivative of C_m that contains a part of a C_m alpha_dot_hat missing from the model.

    Attributes
    ----------
    term : str
    aliased : float
        Fraction of the alphadot derivative contained in it, 1.
    std_error : float
        Its standard error, which does not contain that part.
    """

    term: str
    aliased: float
    std_error: float


@dataclass(frozen=True)
class DampingCollinearity:
    """Part of a C_m alpha_dot_hat missing from the model that C_m q_hat contains.

    Attributes
    ----------
    value : float
        The estimate of C_m q_hat, which is the sum.
    aliased : float
        Fraction of an alphadot derivative contained in it, 1.
    independent : float
        Fraction of alphadot's whitened column that no declared term explains, 1.
    others : tuple of AliasedDerivative
        The other derivatives of C_m, constants not among them.
    """

    value: float
    aliased: float
    independent: float
    others: tuple[AliasedDerivative, ...] = ()

    @property
    def parts(self) -> tuple[float, float]:
        """C_m q_hat without the usual alphadot derivatives, the smaller size first."""
        least, most = sorted(map(self._alone, USUAL), key=abs)
        return least, most

    def changes(self, other: AliasedDerivative) -> tuple[float, float]:
        """Part of another derivative that the usual alphadot derivatives are, the smaller size first."""
        least, most = sorted((other.aliased * ratio * self._alone(ratio) for ratio in USUAL), key=abs)
        return least, most

    @property
    def beyond_errors(self) -> tuple[AliasedDerivative, ...]:
        """The others that the largest usual alphadot derivative changes by more than their standard errors."""
        return tuple(other for other in self.others if abs(self.changes(other)[1]) > other.std_error)

    def _alone(self, ratio: float) -> float:
        """C_m q_hat without an alphadot derivative of that ratio to it."""
        return self.value / (1.0 + self.aliased * ratio)


def damping_collinearity(found: Estimate, covariance: Array) -> DampingCollinearity | None:
    """The part of C_m alpha_dot_hat in C_m q_hat; None where both or neither are modelled, or both are identifiable.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    covariance : ndarray, shape (P, P) or larger
        Of its unknowns, its first P rows and columns.
    """
    damping: tuple[object, ...] = ("term", (MOMENT, DAMPING))
    downwash = (MOMENT, DOWNWASH)
    unknowns = found.design.unknowns
    if damping not in unknowns or downwash in found.point.free:
        return None
    omitted = Hypothesis("aero_term", MOMENT, str(DOWNWASH), entries=(downwash,))
    candidates = term_candidates(found.problem, found, [omitted])
    (own,) = score_candidates(found, candidates).independent
    if own >= found.problem.settings.distinct:
        return None
    white = whiten(found.design, candidates[0].columns, found.solution.weights)
    sensitivities = np.asarray(found.solution.covariance @ (found.solution.slopes.T @ white))[:, 0]
    others = tuple(
        AliasedDerivative(str(unknown[1][1]), float(sensitivities[p]), float(np.sqrt(covariance[p, p])))  # type: ignore[index]
        for p, unknown in enumerate(unknowns)
        if unknown[0] == "term" and unknown != damping and unknown[1][0] == MOMENT  # type: ignore[index]
    )
    index = unknowns.index(damping)
    return DampingCollinearity(float(found.solution.values[index]), float(sensitivities[index]), float(own), others)
