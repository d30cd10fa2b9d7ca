"""Derivatives that differ between a validation flight and the fitted flights.

The completed structure may be adequate on every flight and yet need other values on one of them: another loading,
another configuration, another airspeed than the model's terms describe. The estimates of both are independent, so that
their difference has the sum of both variances. It is reported where it is both significant and large: two flights of
the same aircraft differ by a few per cent in what no structure of a dozen terms describes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.effects import frozen
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.related_problems import fitted_alone
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.regressor_errors import with_instrumental_values
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.flight_model.aerodynamics import Entry
from aerosid.search.cross_validation import re_estimated_on


@dataclass(frozen=True)
class OtherDerivativeSettings:
    """What makes a derivative another one.

    Attributes
    ----------
    distance : float
        Standard deviations of the difference, 1. Chosen: of the eight derivatives of each of three flights one exceeds
        it by chance once in 600 results.
    share : float
        Difference as a fraction, 1, of the fitted flights' value. Chosen: the Twin Otter's C_Z alpha differs by six per
        cent between two flights of one day.
    resolved : float
        Fraction, 1, of an unknown of a regression that its record determines: a control that is held there is half of
        it a constant, for which the pseudo-inverse gives a small standard deviation. Numerical: one, but for rounding.
    """

    distance: float = 4.0
    share: float = 0.2
    resolved: float = 0.999


OTHER_DERIVATIVES = OtherDerivativeSettings()
"""Of every result."""


@dataclass(frozen=True)
class OtherDerivative:
    """A derivative of the completed structure on a validation flight and on the fitted flights.

    `log`: the validation flight's name; `value`, `std_error` there, `fitted`, `fitted_std_error` of the fitted flights.
    """

    log: str
    entry: Entry
    value: float
    std_error: float
    fitted: float
    fitted_std_error: float

    @property
    def coefficient(self) -> str:
        """Its coefficient."""
        return self.entry[0]

    @property
    def term(self) -> str:
        """Its term."""
        return str(self.entry[1])

    @property
    def distance(self) -> float:
        """The difference in its standard deviations."""
        return abs(self.value - self.fitted) / float(np.hypot(self.std_error, self.fitted_std_error))

    @property
    def is_another(self) -> bool:
        """Whether the difference is significant and large."""
        errors = self.std_error, self.fitted_std_error
        if not np.all(np.isfinite(errors)) or not min(errors) > 0.0:
            return False
        is_large = abs(self.value - self.fitted) > OTHER_DERIVATIVES.share * abs(self.fitted)
        return is_large and self.distance > OTHER_DERIVATIVES.distance


def other_derivatives_by_likelihood(
    completed: Refinement, uncertainty: Deviations, validation: Sequence[Manoeuvre]
) -> tuple[OtherDerivative, ...]:
    """Those of the maximum-likelihood estimate on each validation flight that the structure explains to its noise.

    `uncertainty`: standard deviations of `completed`. On other flights the standard deviations are not valid.
    """
    found = []
    for manoeuvre in validation:
        own = re_estimated_on(completed, manoeuvre)
        if own is None or unexplained_channels(own, [manoeuvre]):
            continue
        errors = deviations(own, [manoeuvre]).corrected
        for n, entry in enumerate(completed.free):
            values = own.model.value(entry), float(errors[n]), completed.model.value(entry)
            found.append(OtherDerivative(manoeuvre.name, entry, *values, float(uncertainty.corrected[n])))
    return _others(found)


def other_derivatives_by_equations(decision: EquationErrorDecision) -> tuple[OtherDerivative, ...]:
    """Those of the regression of each validation record's coefficients."""
    return _others(compared_derivatives(decision))


def compared_derivatives(decision: EquationErrorDecision) -> tuple[OtherDerivative, ...]:
    """The derivatives of the completed structure that both sides determine, regressed on each validation record.

    The other effects are held, and the steps that the decision found on that record act. Coefficients whose estimate
    is by instrumental variables are regressed by them.
    """
    completed, found = decision.completed, []
    known = dict(zip(completed.design.unknowns, _resolved(completed), strict=True))
    adopted = {row.coefficient for row in decision.regressor_errors if row.adopted}
    for recording in (each for each in completed.problem.recordings if not each.fitted):
        own = _regressed_on(recording, decision, adopted)
        covariance = corrected_covariance(own.design, own.solution)
        for place, (unknown, resolved) in enumerate(zip(own.design.unknowns, _resolved(own), strict=True)):
            if unknown[0] != "term" or not (resolved and known.get(unknown, False)):
                continue
            fitted = completed.design.unknowns.index(unknown)
            here = own.value(unknown), float(np.sqrt(covariance[place, place]))
            there = completed.value(unknown), float(np.sqrt(decision.covariance[fitted, fitted]))
            entry: Entry = unknown[1]  # type: ignore[assignment]
            found.append(OtherDerivative(recording.name, entry, *here, *there))
    return tuple(found)


def _regressed_on(recording: Recording, decision: EquationErrorDecision, adopted: Collection[str]) -> Estimate:
    """The completed structure's coefficients regressed on one record that was not fitted."""
    point = decision.completed.point
    acting = (*point.effects, *decision.level_shifts.get(recording.name, ()))
    alone = fitted_alone(decision.completed.problem, recording)
    return with_instrumental_values(estimate(alone, point.with_effects(tuple(map(frozen, acting)))), adopted)


def _resolved(found: Estimate) -> list[bool]:
    """Whether the records determine each unknown: what the pseudo-inverse of its information resolves of it."""
    design, solution = found.design, found.solution
    information, _ = design.normal_equations(solution.slopes, solution.whitened)
    shares = np.einsum("ij,ji->i", solution.covariance, information)
    return [bool(share > OTHER_DERIVATIVES.resolved) for share in shares]


def _others(compared: Sequence[OtherDerivative]) -> tuple[OtherDerivative, ...]:
    """The derivatives, no constants, that are other ones, most significant first."""
    others = [each for each in compared if each.entry[1].factors and each.is_another]
    return tuple(sorted(others, key=lambda each: -each.distance))
