"""Coefficients of a validation flight that the completed model predicts worse than the declared structure.

What the likelihood of all flights shows stays in the model, although a coefficient of one of them may be predicted
better without it: a structure that lacks something else can be nearer to that flight without the effect. The user is
told which coefficient, by how much, and which effect it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.related_problems import as_compared
from aerosid.equation_error.selection.cross_validation import fits_with_shifts, residuals_with_shifts
from aerosid.equation_error.selection.penalties import Label
from aerosid.equation_error.selection.structure import point_without


@dataclass(frozen=True)
class LoweredSettings:
    """What counts as predicted worse.

    Attributes
    ----------
    fall : float
        Of R^2 in the band of the motion, 1, below which it is not told. Chosen: five times `least_rise` of the search.
    deviations : float
        Standard errors of the fall from which it counts against the model. Chosen: a false alarm in 40 coefficients
        that both structures predict equally well.
    share : float
        Part of the fall, 1, that must vanish without an effect for it to be named. Chosen: half.
    """

    fall: float = 0.01
    deviations: float = 2.0
    share: float = 0.5


LOWERED = LoweredSettings()
"""Of every result."""


@dataclass(frozen=True)
class LoweredCoefficient:
    """A coefficient of a validation flight with R^2 of the declared structure re-estimated and of the completed one.

    `std_error`: of the fall, by the noise of that flight and by the standard errors of the derivatives. `effect`: kind,
    place and term of that without which it would be predicted best, and R^2 `without` it; None where none makes up for
    most of the fall.
    """

    log: str
    coefficient: str
    before: float
    after: float
    std_error: float
    effect: Label | None = None
    without: float = 0.0

    @property
    def significant(self) -> bool:
        """Whether the fall is beyond what noise and the derivatives' standard errors make of two equal predictions."""
        return self.before - self.after > LOWERED.deviations * self.std_error


def lowered_coefficients(decision: EquationErrorDecision) -> tuple[LoweredCoefficient, ...]:
    """Those that the declared structure predicts at all: a negative R^2 is no prediction that could be spoilt.

    None where nothing was found: then both models differ by no effect.
    """
    fallen = [
        (before, after)
        for before, after in decision.coefficient_fits
        if not after.fitted and before.r2 > 0.0 and after.r2 < before.r2 - LOWERED.fall
    ]
    if not fallen or not decision.findings:
        return ()
    problem = decision.completed.problem
    std_errors = _std_errors(decision)
    lowered = [
        LoweredCoefficient(
            after.recording, after.coefficient, before.r2, after.r2, std_errors[after.recording, after.coefficient]
        )
        for before, after in fallen
    ]
    without = []
    for effect, point in _without_each(decision):
        fits = fits_with_shifts(as_compared(problem), decision.level_shifts, estimate(problem, point))
        without.append((effect, {(fit.recording, fit.coefficient): fit.r2 for fit in fits}))
    return tuple(_with_effect(row, without) for row in lowered)


def _std_errors(decision: EquationErrorDecision) -> dict[tuple[str, str], float]:
    """Standard error of each fall of R^2 from the declared to the completed structure, by record and coefficient."""
    compared = as_compared(decision.completed.problem)
    before, after = (
        residuals_with_shifts(compared, decision.level_shifts, found) for found in (decision.before, decision.completed)
    )
    return {
        (compared.recordings[index].name, coefficient): each.rise_over(before[index, coefficient])[1]
        / max(float(np.mean(each.measured**2)), 1e-300)
        for (index, coefficient), each in after.items()
    }


def _with_effect(
    row: LoweredCoefficient, without: list[tuple[Label, dict[tuple[str, str], float]]]
) -> LoweredCoefficient:
    """The row with the effect without which its coefficient is predicted best, where that is most of the fall."""
    effect, r2 = max(((effect, fits[row.log, row.coefficient]) for effect, fits in without), key=lambda pair: pair[1])
    if r2 - row.after < LOWERED.share * (row.before - row.after):
        return row
    return replace(row, effect=effect, without=r2)


def _without_each(decision: EquationErrorDecision) -> Iterator[tuple[Label, Point]]:
    """The completed structure without each of its effects, the other instrument errors held."""
    for row in decision.findings:
        point = point_without(decision.completed.point, row.hypothesis)
        yield row.hypothesis.label, replace(point, effects=decision.with_instruments_held(point.effects))
