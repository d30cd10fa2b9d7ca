"""Errors in the regressors: least squares compared with instrumental variables formed from the controls.

Regressors of the coefficient equations are measured angles and rates. Their errors bias least squares, as a rule
towards zero, where the terms of a coefficient nearly balance: in the motion of a heavily damped aircraft the moments by
pitch rate, angle of attack and elevator cancel. The response to the controls contains no sensor noise, and with it as
instrument the estimate is consistent; the gust that the vane sees is its own instrument, for without it the residual
would contain the response to gusts. Where both estimates differ by more than chance, least squares is biased (Hausman,
Econometrica 46 (1978) 1251; instrumental variables: Soderstrom & Stoica, System Identification, section 8.2), or the
controls respond to gusts, as an autopilot's do. The records decide: where the derivatives by instrumental variables
predict the coefficient as well or better, they take the place of the others. Elsewhere the standard errors contain the
difference, by the part of its square that exceeds what chance explains (James & Stein, Proceedings of the Fourth
Berkeley Symposium 1 (1961) 361).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from aerosid.effects.kinds import InputEffect
from aerosid.equation_error.equations.instrumental_variables import instrumental_variables, is_control, orthonormal
from aerosid.equation_error.equations.points import Unknown
from aerosid.equation_error.regression.design import Design
from aerosid.equation_error.regression.estimate import Estimate, with_terms
from aerosid.equation_error.regression.least_squares import Solution, solve
from aerosid.equation_error.regression.parameter_limits import free_parameters
from aerosid.equation_error.regression.related_problems import as_compared
from aerosid.equation_error.regression.standard_errors import corrected_covariance, covariance_of_scores
from aerosid.equation_error.selection.cross_validation import fits_of, rises
from aerosid.equation_error.selection.starting_values import MAINLY
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.axes import LONGITUDINAL

Array = NDArray[np.float64]

SMALLEST = 1e-3
"""Numerical: eigenvalue of a correlation matrix below which its direction is left out of the comparison."""

SAME = 1e-6
"""Numerical: standard error of a difference over that of the derivative, 1, below which both estimates are the same."""

WORST_CONDITION = 1e5
"""Numerical: condition of the scaled projected regressors from which the instruments do not determine them."""


@dataclass(frozen=True)
class ComparedDerivative:
    """A derivative by least squares, and by instrumental variables with its standard error."""

    unknown: Unknown
    value: float
    instrumental: float
    std_error: float

    @property
    def entry(self) -> Entry:
        """Its coefficient and term."""
        return self.unknown[1]  # type: ignore[return-value]


@dataclass(frozen=True)
class RegressorErrors:
    """A coefficient whose derivatives differ between least squares and instrumental variables.

    Attributes
    ----------
    coefficient : str
    p_value : float
        Probability of such a difference where the regressors have no errors.
    share : float
        Part of the squared difference that chance does not explain, 1.
    derivatives : tuple of ComparedDerivative
    constants : mapping of unknown to float
        Constants of the records by instrumental variables.
    adopted : bool
        Whether the estimate by instrumental variables is the one to report.
    """

    coefficient: str
    p_value: float
    share: float
    derivatives: tuple[ComparedDerivative, ...]
    constants: Mapping[Unknown, float]
    adopted: bool = False

    @property
    def values(self) -> dict[Unknown, float]:
        """Derivatives and constants by instrumental variables."""
        return {each.unknown: each.instrumental for each in self.derivatives} | dict(self.constants)


def regressor_errors(found: Estimate, added: Collection[Entry]) -> tuple[RegressorErrors, ...]:
    """The coefficients whose derivatives are biased by errors in the regressors; none where no control moves.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations of the identification records, instrument errors fixed.
    added : collection of Entry
        Terms that were selected: an estimate in which one is insignificant is not adopted.
    """
    settings = found.problem.settings
    compared = _by_coefficient(found)
    biased = [row for row in compared if row.p_value < settings.regressor_false_alarm]
    return tuple(replace(row, adopted=_is_adopted(found, row, added)) for row in biased)


def with_instrumental_values(found: Estimate, biased: Collection[str]) -> Estimate:
    """An estimate with the derivatives and constants of some coefficients by instrumental variables.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations, instrument errors fixed.
    biased : collection of str
        The coefficients.
    """
    rows = _by_coefficient(found) if biased else []
    return with_values(found, adopted_values([replace(row, adopted=row.coefficient in biased) for row in rows]))


def adopted_values(rows: Sequence[RegressorErrors]) -> dict[Unknown, float]:
    """Derivatives and constants of the coefficients whose estimate by instrumental variables is adopted."""
    return {unknown: value for row in rows if row.adopted for unknown, value in row.values.items()}


def with_values(found: Estimate, values: Mapping[Unknown, float]) -> Estimate:
    """An estimate with other values of some derivatives and constants."""
    if not values:
        return found
    changed = found.solution.values.copy()
    for unknown, value in values.items():
        changed[found.design.unknowns.index(unknown)] = value
    point = with_terms(found.point, found.design, changed)
    return replace(found, point=point, solution=replace(found.solution, values=changed))


def with_regressor_errors(covariance: Array, found: Estimate, biased: Sequence[RegressorErrors]) -> Array:
    """The covariance (P, P) of an estimate's unknowns, and of further ones, with the errors in the regressors.

    Of adopted derivatives the variances are those of instrumental variables and what was added to those of least
    squares, as the instrument errors' are; to those of others the squared differences are added.
    """
    if not biased:
        return covariance
    unknowns, total = found.design.unknowns, covariance.copy()
    regressed = np.diag(corrected_covariance(found.design, found.solution))
    scale = np.ones(total.shape[0])
    for row in biased:
        places = [unknowns.index(each.unknown) for each in row.derivatives]
        if row.adopted:
            for place, each in zip(places, row.derivatives, strict=True):
                beside = max(total[place, place] - regressed[place], 0.0)
                scale[place] = np.sqrt((each.std_error**2 + beside) / max(total[place, place], 1e-300))
        else:
            difference = np.zeros(total.shape[0])
            difference[places] = [each.instrumental - each.value for each in row.derivatives]
            total += row.share * np.outer(difference, difference)
    return np.asarray(total * np.outer(scale, scale))


def changes_of_fit(found: Estimate, other: Estimate, coefficient: str) -> list[tuple[bool, float]]:
    """Rise of R^2 of a coefficient on each record from one estimate to the other, and whether the record is fitted."""
    compared = as_compared(found.problem)
    return rises(fits_of(compared, found), fits_of(compared, other), MAINLY[coefficient])


def _by_coefficient(found: Estimate) -> list[RegressorErrors]:
    """Both estimates of the derivatives of each coefficient that the instruments determine."""
    settings, design = found.problem.settings, found.design
    if found.point.model.axes != LONGITUDINAL:
        return []
    fewer = replace(settings, laguerre_order=settings.regressor_order)
    of_records = instrumental_variables(found.problem.recordings, fewer)
    exogenous = _exogenous(found)
    bases = []
    for s, (index, _) in enumerate(design.segments):
        basis = of_records[index]
        if basis is None:
            return []
        bases.append(orthonormal(np.column_stack([basis, design.columns[design.rows(s)][:, exogenous]])))
    projected = replace(design, instruments=tuple(bases), declared=None, density=None)
    solution = solve(projected, found.solution.weights)
    covariance = corrected_covariance(projected, solution)
    of_difference = _covariance_of_difference(found.design, found.solution, solution)
    names = dict.fromkeys(unknown[1][0] for unknown in design.unknowns if unknown[0] == "term")  # type: ignore[index]
    rows = (_compared(str(name), found, solution, covariance, of_difference) for name in names)
    return [row for row in rows if row is not None]


def _exogenous(found: Estimate) -> list[int]:
    """Columns that are instruments themselves: constants, drifts, steps, terms of controls, gusts."""

    def is_exogenous(unknown: Unknown) -> bool:
        if unknown[0] == "effect":
            return isinstance(found.point.effects[int(str(unknown[1]))].effect, InputEffect)
        if unknown[0] == "term":
            return all(is_control(name) for name in unknown[1][1].variables)  # type: ignore[index]
        return unknown[0] in ("one", "drift", "gust", "rotary_gust")

    return [p for p, unknown in enumerate(found.design.unknowns) if is_exogenous(unknown)]


def _covariance_of_difference(design: Design, regressed: Solution, instrumental: Solution) -> Array:
    """Covariance (P, P) of the difference of two estimates: that of the sums of the differences of their influences."""
    influences = [
        (solution.slopes * solution.whitened[:, None]) @ solution.covariance for solution in (instrumental, regressed)
    ]
    samples, unknowns = influences[0].shape
    freedom = samples / max(samples - unknowns, 1)
    return np.asarray(freedom * covariance_of_scores(design, influences[0] - influences[1]))


def _compared(
    coefficient: str, found: Estimate, solution: Solution, covariance: Array, of_difference: Array
) -> RegressorErrors | None:
    """Both estimates of the derivatives of a coefficient; None where the instruments do not determine them."""
    unknowns = found.design.unknowns
    places: list[int] = []
    constants: list[int] = []
    for p, (kind, entry, *_) in enumerate(unknowns):
        if kind in ("term", "one") and entry[0] == coefficient:  # type: ignore[index]
            (places if kind == "term" else constants).append(p)
    slopes = solution.slopes[:, np.array(places + constants, dtype=np.int64)]
    size = np.linalg.norm(slopes, axis=0)
    if not places or np.any(size == 0.0) or np.linalg.cond(slopes / size) > WORST_CONDITION:
        return None
    values, instrumental = found.solution.values[places], solution.values[places]
    errors = np.sqrt(np.diag(covariance)[places])
    size = np.sqrt(np.diag(of_difference)[places])
    differs = size > SAME * errors
    if not differs.any():
        return None  # all regressors are instruments themselves
    within, size = np.array(places)[differs], size[differs]
    eigenvalues, vectors = np.linalg.eigh(of_difference[np.ix_(within, within)] / np.outer(size, size))
    shown = eigenvalues > SMALLEST
    along = (vectors.T @ ((instrumental - values)[differs] / size))[shown]
    statistic, freedom = float(np.sum(along**2 / eigenvalues[shown])), int(shown.sum())
    rows = zip((unknowns[p] for p in places), values.tolist(), instrumental.tolist(), errors.tolist(), strict=True)
    return RegressorErrors(
        coefficient,
        float(chdtrc(freedom, statistic)),
        max(0.0, 1.0 - freedom / max(statistic, 1e-300)),
        tuple(ComparedDerivative(*row) for row in rows),
        {unknowns[p]: float(solution.values[p]) for p in constants},
    )


def _is_adopted(found: Estimate, row: RegressorErrors, added: Collection[Entry]) -> bool:
    """Whether the estimate by instrumental variables is reported.

    Where the difference is beyond doubt, no selected term becomes insignificant, no effect is estimated beside the
    derivatives, and no validation record, or without one no identification record, is predicted worse.
    """
    settings = found.problem.settings
    if row.p_value >= settings.regressor_doubt or free_parameters(found.point.effects):
        return False
    least = settings.deviations
    if any(each.entry in added and abs(each.instrumental) < least * each.std_error for each in row.derivatives):
        return False
    changes = changes_of_fit(found, with_values(found, row.values), row.coefficient)
    unseen = [change for fitted, change in changes if not fitted] or [change for _, change in changes]
    return min(unseen) > -settings.least_rise
