"""Bayesian model averaging: what the choice among alternatives adds to the deviations of the declared derivatives.

Where another effect does in place of a chosen one what it does, the recordings do not tell which of them is there, and
the derivatives differ from one to the other by more than either's deviations. The mean square of a derivative about its
estimate is then its variance in the chosen structure and the squares of its differences to those of the alternatives,
each by its probability (Hoeting, Madigan, Raftery & Volinsky, Statistical Science 14 (4), 1999, section 1, about the
estimate of the chosen structure and not about the mean of all, since it is that which is reported). The same
holds where one more effect nearly pays its price: one in ln L below, it is there with a probability of a quarter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import mapped
from aerosid.effects import frozen
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Point, Unknown
from aerosid.equation_error.regression.estimate import Estimate, maximise_likelihood
from aerosid.equation_error.selection.alternatives import Alternative
from aerosid.equation_error.selection.joint_time_delays import with_errors_held
from aerosid.equation_error.selection.near_significant import NearSignificant

Array = NDArray[np.float64]

LEAST = 0.01
"""Numerical: probability of an alternative below which it adds nothing: less than a deviation where it is ten away."""

STEPS = 2
"""Numerical: Gauss-Newton steps from the alternative's numbers on all recordings to those on the fitted ones."""


def averaged_covariance(
    completed: Estimate,
    covariance: Array,
    fitted: Estimate,
    alternatives: Sequence[Alternative],
    declared: Sequence[Unknown],
    omitted: Sequence[NearSignificant] = (),
) -> Array:
    """The covariance (P, P) of the completed structure's unknowns with that of the choice among alternatives.

    Parameters
    ----------
    completed : Estimate
        Whose unknowns they are.
    covariance : ndarray, shape (P, P)
        In the chosen structure.
    fitted : Estimate
        The chosen structure on the fitted recordings, faults of instruments held.
    alternatives : sequence of Alternative
        What could stand in place of something chosen.
    declared : sequence of Unknown
        The derivatives to which it applies: an effect's own number is that of the effect which is named.
    omitted : sequence of NearSignificant
        What would stand beside the chosen structure were it a little likelier.
    """
    places = {unknown: completed.design.unknowns.index(unknown) for unknown in declared}
    rows = [(row, weight) for row, weight in zip(alternatives, probabilities(alternatives), strict=True)]
    rows = [(row, weight) for row, weight in rows if weight >= LEAST]

    def change(point: Point | None) -> tuple[Array, float]:
        """What the derivatives are off by at a point, and how much likelier the fitted recordings are there."""
        difference = np.zeros(len(completed.design.unknowns))
        if point is None:
            return difference, 0.0
        found = maximise_likelihood(fitted.problem, point, fitted.solution.weights, STEPS)
        values = dict(zip(found.design.unknowns, found.solution.values.tolist(), strict=False))
        for unknown, place in places.items():
            difference[place] = values.get(unknown, 0.0) - completed.solution.values[place]
        return difference, found.gain_over(fitted)

    close = [row for row in omitted if probability_of(row.gain - row.penalty) >= LEAST]
    points = [
        *(_with_alternative(fitted.point, row) for row, _ in rows),
        *(_with_omitted(fitted.point, row) for row in close),
    ]
    changes = mapped(change, points)
    weights = [weight for _, weight in rows]
    for row, (_, gain) in zip(close, changes[len(rows) :], strict=True):
        # What kinematics nearly prove the forces may refute, or prove.
        coefficient_gain = 0.0 if row.estimate.problem.kinds == COEFFICIENT else gain
        weights.append(probability_of(row.gain + coefficient_gain - row.penalty))
    total = covariance.copy()
    for weight, (difference, _) in zip(weights, changes, strict=True):
        total += weight * np.outer(difference, difference)
    return total


def probability_of(surplus: float) -> float:
    """Probability of what brings so much more in ln L than its price, which holds its odds beforehand."""
    return float(1.0 / (1.0 + np.exp(-surplus)))


def probabilities(alternatives: Sequence[Alternative]) -> list[float]:
    """Probability of each alternative among those of the same chosen one: as likely beforehand but for their size."""
    odds = [float(np.exp(-max(row.deficit + row.prior_deficit, 0.0))) for row in alternatives]
    total_odds: dict[tuple[str, str, str], float] = {}
    for row, each in zip(alternatives, odds, strict=True):
        total_odds[row.replaces.label] = total_odds.get(row.replaces.label, 1.0) + each
    return [each / total_odds[row.replaces.label] for row, each in zip(alternatives, odds, strict=True)]


def _with_omitted(point: Point, row: NearSignificant) -> Point:
    """A point of the coefficient equations with one more effect; a fault of an instrument held, behind the others."""
    other = row.estimate.point
    if row.estimate.problem.kinds == COEFFICIENT or row.active is None:
        return other
    known = len(other.effects) - 1
    return replace(point, effects=(*point.effects[:known], frozen(row.active), *point.effects[known:]))


def _with_alternative(point: Point, row: Alternative) -> Point | None:
    """A point of the coefficient equations with an alternative in place of what it stands for."""
    other = row.estimate.point
    if row.estimate.problem.kinds == COEFFICIENT:
        return other
    names = {active.name for active in row.replaces.effects}
    if row.active is None or not names <= {active.name for active in point.effects}:
        return None  # kinematics chose between them before another one of the two was taken
    effects = tuple(row.active if active.name == row.active.name else active for active in other.effects)
    return with_errors_held(point, effects)
