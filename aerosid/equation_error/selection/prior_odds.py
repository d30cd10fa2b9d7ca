"""Prior odds of the terms of coefficients that lose likelihood when the identified instrument errors are corrected.

Kinematics identify instrument errors without aerodynamics. If the terms of a coefficient are complete, correcting an
error cannot reduce their likelihood by much: the probability that the wrong data are likelier by Delta in ln L is
exp(-Delta) at most (Markov's inequality on the likelihood ratio). By that factor it is likelier that the coefficient
lacks a term, and that its terms compensated the instrument error.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.coefficient import TOUCHED
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.least_squares import log_likelihoods
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion


def likelihood_losses(corrected: Estimate, errors: slice) -> dict[str, float]:
    """Loss in ln L of each coefficient's equations by correcting the instrument errors; only those with a loss.

    Parameters
    ----------
    corrected : Estimate
        Of the coefficient equations.
    errors : slice
        Those of its effects that are identified instrument errors and not declared.
    """
    effects = corrected.point.effects
    if not effects[errors]:
        return {}
    recorded = replace(corrected.point, effects=(*effects[: errors.start], *effects[errors.stop :]))
    declared = estimate(corrected.problem, recorded, corrected.solution.weights)
    before, after = log_likelihood_by_coefficient(declared), log_likelihood_by_coefficient(corrected)
    return {name: before[name] - after[name] for name in before if before[name] > after[name]}


def log_likelihood_by_coefficient(found: Estimate) -> dict[str, float]:
    """Ln L of each coefficient's equations on all records, up to a constant."""
    each = log_likelihoods(found.design, found.solution.whitened, found.solution.weights)
    parts: dict[str, float] = defaultdict(float)
    for (_, name), part in zip(found.design.segments, each, strict=True):
        parts[name] += part
    return parts


def with_raised_odds(
    criterion: SelectionCriterion, hypotheses: Sequence[Hypothesis], losses: Mapping[str, float], most: float
) -> SelectionCriterion:
    """The criterion with raised prior odds of the terms of coefficients that lose likelihood.

    Parameters
    ----------
    losses : mapping of coefficient to float
        Loss of each in ln L by correcting the identified instrument errors.
    most : float
        Largest probability that any term of one coefficient is missing.
    """
    odds_factors: dict[Label, float] = {}
    for name, loss in losses.items():
        terms = [hypothesis.label for hypothesis in hypotheses if _is_term_of(hypothesis, name)]
        if not terms:
            continue
        prior = criterion.false_alarm * sum(criterion.odds_shares[label] for label in terms)
        factor = max(min(float(np.exp(min(loss, 700.0))), most / prior), 1.0)
        odds_factors.update({label: max(factor, odds_factors.get(label, 1.0)) for label in terms})
    return replace(criterion, odds_factors=odds_factors)


def _is_term_of(hypothesis: Hypothesis, equation: str) -> bool:
    """Whether all terms of a hypothesis act in an equation."""
    touched = [TOUCHED.get(coefficient, (coefficient,)) for coefficient, _ in hypothesis.entries]
    return bool(touched) and all(equation in equations for equations in touched)
