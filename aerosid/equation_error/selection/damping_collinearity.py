"""Collinearity of pitch-rate and alphadot derivatives: the sum that manoeuvres show, and its parts.

A term of alphadot that the model lacks is taken in by the others as far as its whitened column is theirs (omitted
variables: Klein & Morelli, Aircraft System Identification, section 5.1).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import whiten
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.candidates import score_candidates, term_candidates
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.terms import parse_term

MOMENT = "C_m"
DAMPING, DOWNWASH = parse_term("q_hat"), parse_term("alpha_dot_hat")

USUAL = (0.3, 0.5)
"""Physical: C_m alphadot over C_m q of conventional aircraft, 1: downwash that reaches the tail late (Etkin & Reid,
Dynamics of Flight, section 5.5, where both are tail terms and their ratio is the slope of the downwash)."""


def downwash_prior(model: AerodynamicModel) -> Mapping[Entry, float]:
    """Standard deviation about none of the alphadot derivatives of coefficients with a derivative of pitch rate, 1.

    Both are made by the tail, the one by the slope of the downwash times the other: its largest usual size is one
    deviation.

    Parameters
    ----------
    model : AerodynamicModel
        With declared values; a flight's own derivative of pitch rate goes wrong with that of alphadot.

    References
    ----------
    Etkin & Reid, Dynamics of Flight, section 5.5.
    """
    sizes = {coefficient: abs(model.value((coefficient, DAMPING))) for coefficient, _ in model.entries}
    return {(coefficient, DOWNWASH): USUAL[1] * size for coefficient, size in sizes.items() if size > 0.0}


@dataclass(frozen=True)
class DampingCollinearity:
    """What C_m q_hat holds of a C_m alpha_dot_hat that the model lacks.

    Attributes
    ----------
    value : float
        The estimate of C_m q_hat, which is the sum.
    aliased : float
        How much of an alphadot derivative is in it, 1.
    independent : float
        Share of alphadot's whitened column that no declared term explains, 1.
    """

    value: float
    aliased: float
    independent: float

    @property
    def parts(self) -> tuple[float, float]:
        """C_m q_hat's own part for the usual alphadot derivatives, the smaller size first."""
        own = sorted((self.value / (1.0 + self.aliased * ratio) for ratio in USUAL), key=abs)
        return own[0], own[1]


def damping_collinearity(found: Estimate) -> DampingCollinearity | None:
    """What C_m q_hat holds; None where the model has both terms or neither, or the flight tells them apart."""
    damping: tuple[object, ...] = ("term", (MOMENT, DAMPING))
    downwash = (MOMENT, DOWNWASH)
    if damping not in found.design.unknowns or downwash in found.point.free:
        return None
    omitted = Hypothesis("aero_term", MOMENT, str(DOWNWASH), entries=(downwash,))
    candidates = term_candidates(found.problem, found, [omitted])
    (own,) = score_candidates(found, candidates).independent
    if own >= found.problem.settings.distinct:
        return None
    white = whiten(found.design, candidates[0].columns, found.solution.weights)
    answers = found.solution.covariance @ (found.solution.slopes.T @ white)
    place = found.design.unknowns.index(damping)
    return DampingCollinearity(float(found.solution.values[place]), float(np.asarray(answers)[place, 0]), float(own))
