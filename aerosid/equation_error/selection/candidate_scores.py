"""Score test of candidate hypotheses: their gains in ln L to first order, and how independent their columns are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import InputEffect
from aerosid.equation_error.equations.points import Unknown
from aerosid.equation_error.regression.design import compared_columns
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.candidates import Candidate, distinct_name
from aerosid.flight_model.aerodynamics import Entry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CandidateScores:
    """First-order gains of candidates (score test).

    Attributes
    ----------
    gains : ndarray, shape (C,)
        In ln L at the base's colour.
    independent : ndarray, shape (C,)
        Fraction of each candidate's whitened columns that no other column explains, the least of its parameters.
    """

    gains: Array
    independent: Array


def score_candidates(base: Estimate, candidates: Sequence[Candidate]) -> CandidateScores:
    """Score test of each candidate, and the independent fraction of its columns."""
    gains, own = np.zeros(len(candidates)), np.zeros(len(candidates))
    if not candidates:
        return CandidateScores(gains, own)
    stacked = np.column_stack([each.columns for each in candidates])
    white = compared_columns(base.design, stacked, base.solution.weights)
    slopes, covariance = base.solution.slopes, base.solution.covariance
    products = slopes.T @ white
    innovations = base.solution.whitened
    index = 0
    for n, each in enumerate(candidates):
        k = each.columns.shape[1]
        whitened_part, along_known = white[:, index : index + k], products[:, index : index + k]
        index += k
        total = whitened_part.T @ whitened_part
        residuals = total - along_known.T @ covariance @ along_known
        own[n] = float(np.linalg.eigvalsh(residuals)[0]) / max(float(np.trace(total)), 1e-300)
        if own[n] <= COLLINEAR:
            continue
        score = whitened_part.T @ innovations
        step = np.linalg.solve(residuals, score)
        if _points_away(each, score) and not _reverses_control(base, each, -covariance @ along_known @ step):
            continue
        gains[n] = 0.5 * float(score @ step)
    return CandidateScores(gains, own)


def best_candidates(
    scored: CandidateScores,
    candidates: Sequence[Candidate],
    most: int,
    is_eligible: Callable[[int], bool] = lambda _n: True,
) -> list[int]:
    """Indices of the candidates of highest gain, one of each name, at most a given number."""
    order: list[int] = []
    names: set[tuple[str, ...]] = set()
    for n in np.argsort(-scored.gains):
        name = distinct_name(candidates[n].hypothesis)
        if name not in names and is_eligible(int(n)):
            names.add(name)
            order.append(int(n))
            if len(order) >= most:
                break
    return order


def _points_away(candidate: Candidate, score: Array) -> bool:
    """Whether a secant to a trial value predicts a value beyond the null.

    Such a value is impossible, or nearer to another trial value.
    """
    if not candidate.hypothesis.effects or score.size > 1:
        return False
    first = candidate.hypothesis.effects[0].effect.parameters[0]
    away = np.array([trial - first.null for trial in first.trials])
    here = away[candidate.trial]
    other_side = first.lowest < first.null if here > 0.0 else first.highest > first.null
    if other_side and not (away.min() < 0.0 < away.max()):
        return False
    return bool(score[0] * here < 0.0)


def _reverses_control(base: Estimate, candidate: Candidate, change: Array) -> bool:
    """Whether a change (P,) of the base's unknowns reverses a derivative of the candidate's control.

    The columns of a delay are proportional to the control's derivatives at the base. Where a large undeclared delay has
    given one of them the wrong sign, its sign in the regression with the delay counts: a secant that points away is
    then one that points to the trial value.
    """
    (active, *_) = candidate.hypothesis.effects
    if not isinstance(active.effect, InputEffect):
        return False
    before = base.solution.values
    after = before[: change.size] + change
    return any(
        before[p] * after[p] < 0.0
        for p, unknown in enumerate(base.design.unknowns)
        if _is_derivative_by(unknown, active.effect.where)
    )


def _is_derivative_by(unknown: Unknown, control: str) -> bool:
    """Whether an unknown of the regression is the linear derivative by a control."""
    if unknown[0] != "term":
        return False
    _, term = cast("Entry", unknown[1])
    return len(term.factors) == 1 and term.factors[0].power == 1 and term.factors[0].variable == control


COLLINEAR = 1e-6
"""Numerical: independent fraction, 1, below which a column is collinear with others: rounding of its square."""
