"""Cross-validation on validation records: residual and R^2 of predicted coefficients with and without an effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.design import design_of, in_space_of_instruments
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.standard_errors import corrected_covariance

Array = NDArray[np.float64]

LAGS = 10
"""Numerical: samples in the band over which the squares of residuals may be correlated."""


@dataclass(frozen=True)
class FallSettings:
    """What counts as a validation coefficient that one structure predicts worse than another.

    Attributes
    ----------
    fall : float
        Of R^2 in the band of the motion, 1, below which it does not. Chosen: five times `least_rise` of the search.
    deviations : float
        Standard errors of the fall from which it counts. Chosen: a false alarm in 40 coefficients that both structures
        predict equally well.
    """

    fall: float = 0.01
    deviations: float = 2.0

    def count(self, fall: float, std_error: float) -> bool:
        """Whether a fall of R^2 with its standard error counts."""
        return fall > self.fall and fall > self.deviations * std_error


FALL = FallSettings()
"""Of every comparison."""


@dataclass(frozen=True)
class CoefficientFit:
    """Fit of one coefficient of one record predicted from the measured motion, its constants fitted there.

    `r2` in the band of the motion.
    """

    recording: str
    fitted: bool
    coefficient: str
    r2: float


@dataclass(frozen=True)
class PredictionResidual:
    """Prediction residual of one coefficient of one record, its constants fitted there.

    `measured`, `residual` (n,): measured coefficient and residual about their means. `slopes` (n, K): sensitivities of
    the prediction to the estimated parameters; `covariance` (K, K) of these.
    """

    measured: Array
    residual: Array
    slopes: Array
    covariance: Array

    @cached_property
    def parameter_variance(self) -> float:
        """Mean square of the prediction's standard error due to the estimated parameters."""
        return float(np.mean(np.sum((self.slopes @ self.covariance) * self.slopes, axis=1)))

    @cached_property
    def mean_square(self) -> float:
        """Of the residual."""
        return float(np.mean(self.residual**2))

    def rise_over(self, before: PredictionResidual, *, by_noise: bool = False) -> tuple[float, float]:
        """Rise of the mean square over that of another model, and its standard error.

        The squares differ by the product of the difference d of the predictions and the sum of the residuals. Noise e
        of the record, of covariance T, adds 4 d' T d / n^2 to the variance of its mean, and an error of the estimated
        parameters, of covariance C, which shifts both residuals alike by the slopes S, 4 d' S C S' d / n^2. The latter
        is left out `by_noise`: between two sets of given values the record's noise alone could mislead the choice.
        """
        difference = before.residual - self.residual
        by_parameters = self.slopes.T @ difference
        variance = before.noise_along(difference)
        if not by_noise:
            variance += float(by_parameters @ self.covariance @ by_parameters)
        return self.mean_square - before.mean_square, 2.0 * float(np.sqrt(max(variance, 0.0))) / difference.size

    def fall_over(self, before: PredictionResidual, *, by_noise: bool = False) -> tuple[float, float]:
        """Fall of R^2 from that of another model, and its standard error, as of `rise_over`."""
        power = max(float(np.mean(self.measured**2)), 1e-300)
        rise, error = self.rise_over(before, by_noise=by_noise)
        return rise / power, error / power

    def noise_along(self, direction: Array) -> float:
        """Variance d' T d of the record's noise along a direction (n,).

        T by the autocovariance of what is left of the residual beside all errors of the
        parameters: it must not count those once more.
        """
        values, _, rank, _ = np.linalg.lstsq(self.slopes, self.residual, rcond=None)
        noise = self.residual - self.slopes @ values
        products = [a * b for a, b in zip(_lagged_products(noise), _lagged_products(direction), strict=True)]
        return _tapered_sum(products) / max(noise.size - int(rank) - 1, 1)


PredictionResiduals = Mapping[tuple[int, str], PredictionResidual]
"""By record, or block of one, and coefficient."""


StepColumns = Mapping[tuple[int, str], Array]
"""Regressors of the level shifts of a record, (n, k), by record and coefficient."""


def prediction_residuals(
    problem: RegressionProblem, found: Estimate, *, gusts: bool = True, steps: StepColumns = MappingProxyType({})
) -> PredictionResiduals:
    """Prediction residuals of each coefficient of every record with given estimates.

    `gusts`: whether the response to the vane's difference from the inertial path is left in the residual, which no
    model could predict. That to the rotary gust is always removed, where it is a regressor, and what instrumental
    variables leave out: of models that leave them in, the one of too small derivatives would predict best. `steps`:
    level shifts, fitted like constants because they belong to one record.
    """
    design = in_space_of_instruments(design_of(problem.segments(found.point), problem.settings))
    known = [u for u in found.design.unknowns if u[0] == "term" and u in design.unknowns]
    rows_of = [found.design.unknowns.index(unknown) for unknown in known]
    terms = [design.unknowns.index(unknown) for unknown in known]
    covariance = corrected_covariance(found.design, found.solution)[np.ix_(rows_of, rows_of)]
    free = ("one", "drift", "rotary_gust", *(() if gusts else ("gust",)))
    own = [p for p, unknown in enumerate(design.unknowns) if unknown[0] in free]
    random_walk = [p for p, unknown in enumerate(design.unknowns) if unknown[0] == "random_walk"]
    result = {}
    for s, (recording, equation) in enumerate(design.segments):
        if equation not in COEFFICIENT:
            continue
        rows = design.rows(s)
        target, slopes = design.target[rows], design.columns[rows][:, terms]
        constant = design.columns[rows][:, own]
        if (recording, equation) in steps:
            constant = np.column_stack([constant, steps[recording, equation]])
        residual, slopes = without_constants(target - slopes @ found.solution.values[rows_of], slopes, constant)
        residual, slopes = without_random_walk(residual, slopes, design.columns[rows][:, random_walk])
        result[recording, equation] = PredictionResidual(target - target.mean(), residual, slopes, covariance)
    return result


def without_constants(residual: Array, slopes: Array, own: Array) -> tuple[Array, Array]:
    """A residual (n,) and columns (n, K) after regression on a constant and a record's `own` columns (n, C)."""
    own = np.column_stack([np.ones(residual.size), own[:, np.any(own != 0.0, axis=0)]])
    basis = np.linalg.svd(own, full_matrices=False)[0][:, : np.linalg.matrix_rank(own)]
    return residual - basis @ (basis.T @ residual), slopes - basis @ (basis.T @ slopes)


def without_random_walk(residual: Array, slopes: Array, modes: Array) -> tuple[Array, Array]:
    """A residual (n,) and columns (n, K) after ridge regression on random-walk modes (n, M) of unit prior variance."""
    modes = modes[:, np.any(modes != 0.0, axis=0)]
    if not modes.size:
        return residual, slopes
    usual = modes.T @ modes + max(float(np.var(residual)), 1e-300) * np.eye(modes.shape[1])
    taken = np.linalg.solve(usual, modes.T)
    return residual - modes @ (taken @ residual), slopes - modes @ (taken @ slopes)


def fits_of(problem: RegressionProblem, found: Estimate) -> tuple[CoefficientFit, ...]:
    """R^2 of every coefficient and record."""
    return _fits_to(problem, prediction_residuals(problem, found))


def _fits_to(problem: RegressionProblem, residuals: PredictionResiduals) -> tuple[CoefficientFit, ...]:
    rows = []
    for (index, equation), each in residuals.items():
        recording, measured, residual = problem.recordings[index], each.measured, each.residual
        total = max(float(measured @ measured), 1e-300)
        r2 = 1.0 - float(residual @ residual) / total
        rows.append(CoefficientFit(recording.name, recording.fitted, equation, r2))
    return tuple(rows)


def fits_with_shifts(
    problem: RegressionProblem, level_shifts: Mapping[str, tuple[ActiveEffect, ...]], found: Estimate
) -> tuple[CoefficientFit, ...]:
    """The same, step changes of validation records acting there as the decision found them: no model predicts those.

    `level_shifts`: by the name of the record.
    """
    return _fits_to(problem, residuals_with_shifts(problem, level_shifts, found))


def residuals_with_shifts(
    problem: RegressionProblem, level_shifts: Mapping[str, tuple[ActiveEffect, ...]], found: Estimate
) -> PredictionResiduals:
    """Prediction residuals with the step changes of validation records acting there, as `fits_with_shifts`."""
    shifts = tuple(active for of_one in level_shifts.values() for active in of_one)
    point = found.point.with_effects((*found.point.effects, *shifts)) if shifts else found.point
    return prediction_residuals(problem, replace(found, point=point))


def rises(
    before: Sequence[CoefficientFit], after: Sequence[CoefficientFit], coefficient: str
) -> list[tuple[bool, float]]:
    """Whether each record is fitted, and by how much R^2 of the coefficient rises on it."""
    return [(b.fitted, b.r2 - a.r2) for a, b in zip(before, after, strict=True) if a.coefficient == coefficient]


def lowers_fit(
    before: Sequence[CoefficientFit], after: Sequence[CoefficientFit], coefficient: str, least: float
) -> bool:
    """Whether R^2 of a coefficient falls on the identification records, by more than `least`, and rises on no other."""
    changes = rises(before, after, coefficient)
    fitted, others = ([change for own, change in changes if own is which] for which in (True, False))
    return bool(fitted) and max(fitted) < -least and max(others, default=0.0) <= 0.0


def validation_residuals(
    problem: RegressionProblem, found: Estimate, steps: StepColumns = MappingProxyType({})
) -> PredictionResiduals:
    """Prediction residuals of the validation records with the response to gusts, unpredictable noise, removed."""
    every = prediction_residuals(problem, found, gusts=False, steps=steps)
    return {key: each for key, each in every.items() if not problem.recordings[key[0]].fitted}


def predicts_worse(before: PredictionResiduals, after: PredictionResiduals, threshold: float, least: float) -> bool:
    """Whether a validation coefficient is predicted worse with an effect, without a larger gain in another.

    Worse: the mean square rises by more than `threshold` standard deviations of its mean and by more than the
    uncertainty of the parameters explains, and R^2 falls by more than `least`. `before` and `after` without gusts. An
    effect that one coefficient needs shifts the derivatives of the others slightly, through gusts left in them.
    """
    worse: dict[int, bool] = {}
    lost: dict[int, float] = {}
    for (index, equation), each in after.items():
        change = each.residual**2 - before[index, equation].residual ** 2
        rise, power = float(change.mean()), float(np.mean(each.measured**2))
        beyond = rise - each.parameter_variance
        worse[index] = worse.get(index, False) or (
            beyond > threshold * _deviation_of_mean(change) and beyond > least * power
        )
        lost[index] = lost.get(index, 0.0) + rise / max(power, 1e-300)
    return any(worse[index] and lost[index] > 0.0 for index in worse)


def predictions_against(
    before: PredictionResiduals, after: PredictionResiduals, settings: FallSettings = FALL
) -> float:
    """What validation coefficients have against the second of two structures, in ln L; not below zero.

    A coefficient whose mean square rises by t standard errors has t^2/2 against it, as much as the likelihood of a
    normal deviate loses; one that falls so, as much for it. Only what counts as predicted worse or better is heard, and
    what counts for it alone is no reason to keep it.
    """
    against = 0.0
    for key, each in after.items():
        sign, better, worse = 1.0, before[key], each
        if better.mean_square > worse.mean_square:
            sign, better, worse = -1.0, worse, better
        fall, error = worse.fall_over(better)  # the noise by the residual of the better one: the other's is more
        if settings.count(fall, error):
            against += sign * 0.5 * (fall / max(error, 1e-300)) ** 2
    return max(against, 0.0)


def unexplained_rise(before: PredictionResiduals, after: PredictionResiduals) -> float:
    """Sum of the rises of the unexplained variance fractions of all validation coefficients."""
    rises = [
        float(np.mean(each.residual**2 - before[key].residual ** 2)) / max(float(np.mean(each.measured**2)), 1e-300)
        for key, each in after.items()
    ]
    return float(sum(rises))


def largest_reduction(before: PredictionResiduals, after: PredictionResiduals) -> float:
    """The largest fractional reduction of a validation coefficient's residual variance by an effect."""
    falls = [
        1.0 - float(np.mean(each.residual**2)) / max(float(np.mean(before[key].residual ** 2)), 1e-300)
        for key, each in after.items()
    ]
    return max(falls, default=0.0)


def is_unconfirmed(before: PredictionResiduals, after: PredictionResiduals, coefficient: str) -> bool:
    """Whether a term improves the prediction of its coefficient on no validation record; False without such records."""
    falls = [
        float(np.mean(before[key].residual ** 2 - each.residual**2))
        for key, each in after.items()
        if key[1] == coefficient
    ]
    return bool(falls) and max(falls) <= 0.0


def _deviation_of_mean(values: Array) -> float:
    """Standard error of the mean of a coloured series."""
    total = _tapered_sum(_lagged_products(values - values.mean()))
    return float(np.sqrt(max(total, 0.0))) / values.size


def _lagged_products(values: Array) -> list[float]:
    """Sums of the products of a series with itself at lags from zero to `LAGS`, as far as it is long."""
    return [float(values[lag:] @ values[: values.size - lag]) for lag in range(min(LAGS, values.size - 1) + 1)]


def _tapered_sum(products: Sequence[float]) -> float:
    """Sum of products at lags from zero, of both signs, that fall to zero beyond `LAGS` (Newey & West, 1987)."""
    total = products[0]
    for lag, product in enumerate(products[1:], start=1):
        total += 2.0 * (1.0 - lag / (LAGS + 1.0)) * product
    return total
