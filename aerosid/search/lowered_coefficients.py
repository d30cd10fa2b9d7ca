"""Coefficients of a validation flight that the completed model predicts worse than the declared structure.

What the likelihood of all flights shows stays in the model, although a coefficient of one of them may be predicted
better without it. The user is told which coefficient, by how much, which effect it is, and what that flight alone
says of the effect: where it agrees, a structure that lacks something else is nearer to the flight without the effect;
where it does not, the flights differ in the effect itself, as of a vane that was late on one of them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.effects import frozen
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.related_problems import as_compared, fitted_alone
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.cross_validation import FallSettings, fits_with_shifts, residuals_with_shifts
from aerosid.equation_error.selection.penalties import Label, effects_of
from aerosid.equation_error.selection.predicted_convergence import estimated_with_fewer_parts
from aerosid.equation_error.selection.structure import point_without
from aerosid.equation_error.selection.wald_tests import EffectEstimate, unknown_indices
from aerosid.model_error.paper_chain.coefficient_match import CoefficientRow


@dataclass(frozen=True)
class LoweredSettings(FallSettings):
    """What counts as predicted worse, and what is told of it.

    Attributes
    ----------
    share : float
        Part of the fall, 1, that must vanish without an effect for it to be named. Chosen: half.
    apart : float
        Standard errors of the difference from which a flight has another value of that effect. Chosen: as of a finding.
    """

    share: float = 0.5
    apart: float = 3.0


LOWERED = LoweredSettings()
"""Of every result."""


@dataclass(frozen=True)
class LoweringEffect:
    """The effect of the completed model without which a coefficient of a validation flight would be predicted best.

    Attributes
    ----------
    label : (str, str, str)
        Kind, place and term.
    r2 : float
        R^2 of the coefficient without it.
    fitted, std_error : float
        Its leading parameter by the identification, in `unit`.
    alone, alone_std_error : float
        By the coefficients of that flight alone, its derivatives estimated as well; a standard error of zero where it
        does not determine the parameter, or only a limit of it.
    unit : str
    """

    label: Label
    r2: float
    fitted: float
    std_error: float
    alone: float
    alone_std_error: float
    unit: str

    @property
    def is_determined(self) -> bool:
        """Whether that flight alone determines it."""
        return 0.0 < self.alone_std_error < np.inf

    @property
    def distance(self) -> float:
        """Difference between both values in its standard errors."""
        return abs(self.alone - self.fitted) / float(np.hypot(self.std_error, self.alone_std_error))

    @property
    def differs(self) -> bool:
        """Whether that flight alone has another value."""
        return self.is_determined and self.distance > LOWERED.apart


@dataclass(frozen=True)
class LoweredCoefficient:
    """A coefficient of a validation flight with R^2 of the declared structure re-estimated and of the completed one.

    All derivatives are free in both, which then differ in the effects alone. `std_error`: of the fall, by the noise of
    that flight and by the standard errors of the derivatives. `effect`: that without which it would be predicted best;
    None where none makes up for most of the fall. `written`: R^2 of the completed model as it is written, with
    insignificant derivatives at their declared values; None before that is known.
    """

    log: str
    coefficient: str
    before: float
    after: float
    std_error: float
    effect: LoweringEffect | None = None
    written: float | None = None

    @property
    def is_written_lower(self) -> bool:
        """Whether the model as it is written predicts it worse than the declared structure as well."""
        return self.written is None or self.before - self.written > LOWERED.fall

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
    std_errors = _std_errors(decision)
    lowered = [
        LoweredCoefficient(
            after.recording, after.coefficient, before.r2, after.r2, std_errors[after.recording, after.coefficient]
        )
        for before, after in fallen
    ]
    without = [_fits_without(decision, row) for row in decision.findings]

    @functools.cache  # an error of a sensor lowers several coefficients of one flight
    def alone(place: int, log: str) -> tuple[float, float]:
        return _alone(decision, decision.findings[place], log)

    return tuple(_with_effect(row, decision.findings, without, alone) for row in lowered)


def as_written(lowered: Sequence[LoweredCoefficient], r_squared: Iterable[CoefficientRow]) -> list[LoweredCoefficient]:
    """The same with R^2 of the completed model as it is written."""
    written = {(row.log, row.coefficient): row.r2_after for row in r_squared}
    return [replace(row, written=written.get((row.log, row.coefficient))) for row in lowered]


def _std_errors(decision: EquationErrorDecision) -> dict[tuple[str, str], float]:
    """Standard error of each fall of R^2 from the declared to the completed structure, by record and coefficient."""
    compared = as_compared(decision.completed.problem)
    before, after = (
        residuals_with_shifts(compared, decision.level_shifts, found) for found in (decision.before, decision.completed)
    )
    return {
        (compared.recordings[index].name, coefficient): each.fall_over(before[index, coefficient])[1]
        for (index, coefficient), each in after.items()
    }


def _fits_without(decision: EquationErrorDecision, row: EffectEstimate) -> dict[tuple[str, str], float]:
    """R^2 of each record and coefficient by the structure without an effect, the other instrument errors held."""
    problem = decision.completed.problem
    point = point_without(decision.completed.point, row.hypothesis)
    point = replace(point, effects=decision.with_instruments_held(point.effects))
    found = estimated_with_fewer_parts(problem, point, decision.completed)
    fits = fits_with_shifts(as_compared(problem), decision.level_shifts, found)
    return {(fit.recording, fit.coefficient): fit.r2 for fit in fits}


def _with_effect(
    row: LoweredCoefficient,
    findings: Sequence[EffectEstimate],
    without: Sequence[Mapping[tuple[str, str], float]],
    alone: Callable[[int, str], tuple[float, float]],
) -> LoweredCoefficient:
    """The row with the effect without which its coefficient is predicted best, where that is most of the fall."""
    r2, place = max(((fits[row.log, row.coefficient], n) for n, fits in enumerate(without)), key=lambda pair: pair[0])
    if r2 - row.after < LOWERED.share * (row.before - row.after):
        return row
    effect = findings[place]
    unit = effect.active.effect.parameters[0].unit if effect.active is not None else ""
    values = effect.value, effect.std_error, *alone(place, row.log)
    return replace(row, effect=LoweringEffect(effect.hypothesis.label, r2, *values, unit))


def _alone(decision: EquationErrorDecision, row: EffectEstimate, log: str) -> tuple[float, float]:
    """An effect's leading parameter by one record alone, and its standard error; the other effects are held."""
    completed = decision.completed
    (recording,) = (each for each in completed.problem.recordings if each.name == log)
    own = effects_of(completed.point, row.hypothesis)
    acting = (*completed.point.effects, *decision.level_shifts.get(log, ()))
    effects = tuple(active if any(active is one for one in own) else frozen(active) for active in acting)
    found = estimate(fitted_alone(completed.problem, recording), completed.point.with_effects(effects))
    place = next(iter(unknown_indices(found, row.hypothesis)), None)
    if place is None:
        return row.value, 0.0
    of_effect = effects_of(found.point, row.hypothesis)
    value = of_effect[0].values[0] if of_effect else float(found.solution.values[place])
    return value, float(np.sqrt(corrected_covariance(found.design, found.solution)[place, place]))
