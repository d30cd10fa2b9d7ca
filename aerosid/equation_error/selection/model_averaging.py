"""Bayesian model averaging: standard errors of declared derivatives with the choice among alternatives included.

Where the records cannot distinguish an alternative from a selected effect, the derivatives may differ between both by
more than either's standard errors. The mean square of a derivative about its estimate is then its variance in the
selected structure plus the squared differences to those of the alternatives, each weighted by its probability (Hoeting,
Madigan, Raftery & Volinsky, Statistical Science 14 (4), 1999, section 1, about the estimate of the selected structure
instead of the mean of all, since that is what is reported). The same holds for a near-significant effect, at even odds
that anything is missing: the penalty of selection keeps false names rare and states no belief. The scale factor of a
vane that was not identified is a continuous choice: its posterior is represented by its root mean square.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from aerosid.compiled.cores import mapped
from aerosid.effects import ActiveEffect, frozen
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Point, Unknown
from aerosid.equation_error.regression.estimate import Estimate, maximise_likelihood
from aerosid.equation_error.selection.alternatives import Alternative
from aerosid.equation_error.selection.joint_errors import with_errors_held
from aerosid.equation_error.selection.near_significant import NearSignificant

Array = NDArray[np.float64]

LEAST = 0.01
"""Numerical: probability of an alternative below which it is neglected: less than a deviation where it is ten away."""

STEPS = 2
"""Numerical: Gauss-Newton steps from the alternative's parameters on all records to those on the identification
records."""


@dataclass(frozen=True)
class OmittedEffects:
    """What a structure omits although it may exist.

    Attributes
    ----------
    near_significant : tuple of NearSignificant
        Near-significant effects.
    scales : tuple of ActiveEffect
        Scale factor errors of vanes at their posterior root-mean-square size; they are not counted as near-significant.
    identified : int
        Number of instrument errors identified by kinematics, the first of the point's effects.
    """

    near_significant: tuple[NearSignificant, ...] = ()
    scales: tuple[ActiveEffect, ...] = ()
    identified: int = 0

    def probable(self, believed: float) -> list[NearSignificant]:
        """The near-significant effects of some probability, `believed`: logarithm by which their odds are raised."""
        scaled = {active.name for active in self.scales}
        return [
            row
            for row in self.near_significant
            if probability_of(row.gain - row.penalty + believed) >= LEAST
            and (row.active is None or row.active.name not in scaled)
        ]

    def scaled(self, point: Point) -> list[Point]:
        """A point of the coefficient equations with each of the scale factor errors."""
        return [_with_instrument_error(point, active, self.identified) for active in self.scales]


NOTHING_OMITTED = OmittedEffects()


def averaged_covariance(
    completed: Estimate,
    covariance: Array,
    fitted: Estimate,
    alternatives: Sequence[Alternative],
    declared: Sequence[Unknown],
    omitted: OmittedEffects = NOTHING_OMITTED,
) -> Array:
    """The covariance (P, P) of the completed structure's unknowns including the choice among alternatives.

    Parameters
    ----------
    completed : Estimate
        The estimate of the unknowns.
    covariance : ndarray, shape (P, P)
        In the selected structure.
    fitted : Estimate
        The selected structure on the identification records, instrument errors fixed.
    alternatives : sequence of Alternative
        Alternatives of the selected effects.
    declared : sequence of Unknown
        The derivatives and constants concerned: an effect's own parameters are those of the effect that is named.
    omitted : OmittedEffects
        What the structure omits although it may exist.
    """
    indices = {unknown: completed.design.unknowns.index(unknown) for unknown in declared}
    rows = [(row, weight) for row, weight in zip(alternatives, probabilities(alternatives), strict=True)]
    rows = [(row, weight) for row, weight in rows if weight >= LEAST]

    def change(point: Point | None) -> tuple[Array, float]:
        """Differences of the derivatives at a point, and its gain in ln L on the identification records."""
        difference = np.zeros(len(completed.design.unknowns))
        if point is None:
            return difference, 0.0
        found = maximise_likelihood(fitted.problem, point, fitted.solution.weights, STEPS)
        values = dict(zip(found.design.unknowns, found.solution.values.tolist(), strict=False))
        for unknown, index in indices.items():
            difference[index] = values.get(unknown, 0.0) - completed.solution.values[index]
        return difference, found.gain_over(fitted)

    settings = completed.problem.settings
    believed = float(np.log(settings.anything_missing / settings.alarm(completed.point.model.axes)))
    close = omitted.probable(believed)
    points = [
        *(_with_alternative(fitted.point, row) for row, _ in rows),
        *(_with_omitted(fitted.point, row) for row in close),
        *omitted.scaled(fitted.point),
    ]
    changes = mapped(change, points)
    weights = [weight for _, weight in rows]
    for row, (_, gain) in zip(close, changes[len(rows) : len(rows) + len(close)], strict=True):
        # The coefficients may refute or confirm what is near-significant by kinematics.
        coefficient_gain = 0.0 if row.estimate.problem.kinds == COEFFICIENT else gain
        weights.append(probability_of(row.gain + coefficient_gain - row.penalty + believed))
    weights += [1.0] * len(omitted.scales)
    total = covariance.copy()
    for weight, (difference, _) in zip(weights, changes, strict=True):
        total += weight * np.outer(difference, difference)
    return total


def probability_of(surplus: float) -> float:
    """Posterior probability of an effect by its gain in ln L less its penalty, which includes the prior odds."""
    return float(expit(surplus))


def probabilities(alternatives: Sequence[Alternative]) -> list[float]:
    """Probability of each alternative among those of the same effect, of equal prior odds but for their sizes."""
    odds = [float(np.exp(-max(row.deficit + row.prior_deficit, 0.0))) for row in alternatives]
    total_odds: dict[tuple[str, str, str], float] = {}
    for row, each in zip(alternatives, odds, strict=True):
        total_odds[row.replaces.label] = total_odds.get(row.replaces.label, 1.0) + each
    return [each / total_odds[row.replaces.label] for row, each in zip(alternatives, odds, strict=True)]


def _with_omitted(point: Point, row: NearSignificant) -> Point:
    """A point of the coefficient equations with an omitted effect; an instrument error is fixed, after the others."""
    other = row.estimate.point
    if row.estimate.problem.kinds == COEFFICIENT or row.active is None:
        return other
    return _with_instrument_error(point, row.active, len(other.effects) - 1)


def _with_instrument_error(point: Point, active: ActiveEffect, known: int) -> Point:
    """A point of the coefficient equations with one more instrument error, fixed, after the first `known` ones."""
    return replace(point, effects=(*point.effects[:known], frozen(active), *point.effects[known:]))


def _with_alternative(point: Point, row: Alternative) -> Point | None:
    """A point of the coefficient equations with an alternative in place of the effect that it replaces."""
    other = row.estimate.point
    if row.estimate.problem.kinds == COEFFICIENT:
        return other
    names = {active.name for active in row.replaces.effects}
    if row.active is None or not names <= {active.name for active in point.effects}:
        return None  # kinematics selected between them before the other one was selected
    effects = tuple(row.active if active.name == row.active.name else active for active in other.effects)
    return with_errors_held(point, effects)
