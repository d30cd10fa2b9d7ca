"""Coefficients of all records predicted with given values of the completed structure, against the measured ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aerosid.effects import KINDS
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.related_problems import as_compared
from aerosid.equation_error.selection.cross_validation import (
    PredictionResiduals,
    fits_with_shifts,
    residuals_with_shifts,
)
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.model_error.paper_chain.coefficient_match import CoefficientRow
from aerosid.search.lowered_coefficients import LOWERED


@dataclass(frozen=True)
class CoefficientPredictions:
    """Of the records and the structure of an equation-error decision; constants are free on each record."""

    decision: EquationErrorDecision

    def r_squared(self, completed: Refinement) -> tuple[CoefficientRow, ...]:
        """R^2 of each coefficient and record in the band of the motion.

        Before: of the declared structure's regression; after: of the completed model at an estimate's values.
        """
        decision = self.decision
        problem = as_compared(decision.completed.problem)
        fits = fits_with_shifts(problem, decision.level_shifts, self._estimate(completed))
        declared = {(before.recording, before.coefficient): before.r2 for before, _ in decision.coefficient_fits}
        return tuple(
            CoefficientRow(after.coefficient, after.recording, declared[after.recording, after.coefficient], after.r2)
            for after in fits
        )

    def worse(self, one: Refinement, other: Refinement) -> dict[tuple[str, str], float]:
        """Validation records and coefficients that one estimate's values predict worse than another's, by how much R^2.

        Beyond the noise of the record and the least fall of R^2 that is told of (`LoweredSettings`).
        """
        recordings = self.decision.completed.problem.recordings
        others = self._residuals(other)
        fallen = {}
        for (index, coefficient), each in self._residuals(one).items():
            if recordings[index].fitted:
                continue
            fall, error = each.fall_over(others[index, coefficient], by_noise=True)
            if LOWERED.count(fall, error):
                fallen[recordings[index].name, coefficient] = fall
        return fallen

    def _residuals(self, completed: Refinement) -> PredictionResiduals:
        problem = as_compared(self.decision.completed.problem)
        return residuals_with_shifts(problem, self.decision.level_shifts, self._estimate(completed))

    def _estimate(self, completed: Refinement) -> Estimate:
        """The structure's regression at an estimate's values, its standard errors unchanged: held is not known."""
        found = self.decision.completed
        effects = [active for active in completed.effects if active.effect.kind in KINDS]
        own = found.point.model
        values = np.array([completed.model.value(entry) for entry in own.entries])
        terms = found.solution.values.copy()
        places = {unknown: place for place, unknown in enumerate(found.design.unknowns)}
        for entry, value in zip(own.entries, values, strict=True):
            if ("term", entry) in places:
                terms[places["term", entry]] = value
        point = replace(found.point, model=own.with_values(values)).with_effects(effects)
        return replace(found, point=point, solution=replace(found.solution, values=terms))
