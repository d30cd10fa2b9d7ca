"""Coefficients of a validation flight that the completed model predicts worse than the declared structure.

What the likelihood of all flights shows stays in the model, although a coefficient of one of them may be predicted
better without it: a structure that lacks something else can be nearer to that flight without the effect. The user is
told which coefficient, by how much, and which effect it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.related_problems import as_compared
from aerosid.equation_error.selection.cross_validation import fits_with_shifts
from aerosid.equation_error.selection.penalties import Label
from aerosid.equation_error.selection.structure import point_without


@dataclass(frozen=True)
class LoweredSettings:
    """What counts as predicted worse.

    Attributes
    ----------
    fall : float
        Of R^2 in the band of the motion, 1. Chosen: five times `least_rise` of the search, which one parameter's
        uncertainty explains.
    share : float
        Part of the fall, 1, that must vanish without an effect for it to be named. Chosen: half.
    """

    fall: float = 0.01
    share: float = 0.5


LOWERED = LoweredSettings()
"""Of every result."""


@dataclass(frozen=True)
class LoweredCoefficient:
    """A coefficient of a validation flight with R^2 of the declared structure re-estimated and of the completed one.

    `effect`: kind, place and term of that without which it would be predicted best, and R^2 `without` it; None where
    none makes up for most of the fall.
    """

    log: str
    coefficient: str
    before: float
    after: float
    effect: Label | None = None
    without: float = 0.0


def lowered_coefficients(decision: EquationErrorDecision) -> tuple[LoweredCoefficient, ...]:
    """Those that the declared structure predicts at all: a negative R^2 is no prediction that could be spoilt.

    None where nothing was found: then both models differ by no effect.
    """
    lowered = [
        LoweredCoefficient(after.recording, after.coefficient, before.r2, after.r2)
        for before, after in decision.coefficient_fits
        if not after.fitted and before.r2 > 0.0 and after.r2 < before.r2 - LOWERED.fall
    ]
    if not lowered or not decision.findings:
        return ()
    problem = decision.completed.problem
    without = []
    for effect, point in _without_each(decision):
        fits = fits_with_shifts(as_compared(problem), decision.level_shifts, estimate(problem, point))
        without.append((effect, {(fit.recording, fit.coefficient): fit.r2 for fit in fits}))
    return tuple(_with_effect(row, without) for row in lowered)


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
