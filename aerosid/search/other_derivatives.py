"""Derivatives that a validation flight shows otherwise than the fitted flights.

The completed structure may be adequate on every flight and yet need other values on one of them: another loading,
another configuration, another airspeed than the model's terms describe. The estimates of both are independent, so that
their difference has the sum of both variances. It is reported where it is both significant and large: two flights of
the same aircraft differ by a few per cent in what no structure of a dozen terms describes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.effects import frozen
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.standard_errors import corrected_covariance
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
        Standard deviations of the difference, 1. Chosen: eight derivatives of each of three flights exceed it by chance
        once in 600 results.
    share : float
        Difference as a fraction, 1, of the fitted flights' value. Chosen: the Twin Otter's C_Z alpha differs by six per
        cent between two flights of one day.
    """

    distance: float = 4.0
    share: float = 0.2


OTHER = OtherDerivativeSettings()
"""Of every result."""


@dataclass(frozen=True)
class OtherDerivative:
    """A derivative of the completed structure on a validation flight and on the fitted flights.

    `log`: the validation flight's name; `value`, `std_error` there, `fitted`, `fitted_error` of the fitted flights.
    """

    log: str
    entry: Entry
    value: float
    std_error: float
    fitted: float
    fitted_error: float

    @property
    def distance(self) -> float:
        """The difference in its standard deviations."""
        return abs(self.value - self.fitted) / float(np.hypot(self.std_error, self.fitted_error))

    @property
    def is_another(self) -> bool:
        """Whether the difference is significant and large."""
        errors = self.std_error, self.fitted_error
        if not np.all(np.isfinite(errors)) or not min(errors) > 0.0:
            return False
        return self.distance > OTHER.distance and abs(self.value - self.fitted) > OTHER.share * abs(self.fitted)


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
    """Every derivative of the completed structure, regressed on each validation record with the other effects held."""
    completed, found = decision.completed, []
    held = replace(completed.point, effects=tuple(map(frozen, completed.point.effects)))
    recordings = completed.problem.recordings
    for recording in (each for each in recordings if not each.fitted):
        alone = tuple(replace(each, fitted=each is recording) for each in recordings)
        own = estimate(replace(completed.problem, recordings=alone, all_fitted=False), held)
        covariance = corrected_covariance(own.design, own.solution)
        for place, unknown in enumerate(own.design.unknowns):
            if unknown[0] != "term" or unknown not in completed.design.unknowns:
                continue
            fitted = completed.design.unknowns.index(unknown)
            here = own.value(unknown), float(np.sqrt(covariance[place, place]))
            there = completed.value(unknown), float(np.sqrt(decision.covariance[fitted, fitted]))
            entry: Entry = unknown[1]  # type: ignore[assignment]
            found.append(OtherDerivative(recording.name, entry, *here, *there))
    return tuple(found)


def _others(compared: Sequence[OtherDerivative]) -> tuple[OtherDerivative, ...]:
    """The derivatives, no constants, that are other ones, most significant first."""
    others = [each for each in compared if each.entry[1].factors and each.is_another]
    return tuple(sorted(others, key=lambda each: -each.distance))
