"""Goodness of fit: channels, whiteness, correlations, scatter between manoeuvres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import frozen
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import Deviations
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine, whiten
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.model_validation.open_loop_errors import Simulated
from aerosid.signals.fit_statistics import explained_variance, theil, whiteness


@dataclass(frozen=True)
class FitRow:
    """How well one channel of one log is simulated, by one of the variants `before`, `after`; None where it diverged.

    `theil` is Theil's inequality coefficient, with the shares `bias`, `variance` and `covariance` of the mean square
    error; `r2` the explained share of the measured variance; `autocorrelation` of the residual at the lags 0, 1, ...;
    `whiteness` the p-value of Ljung and Box's test.
    """

    log: str
    role: str
    channel: str
    variant: str
    theil: float | None
    bias: float | None
    variance: float | None
    covariance: float | None
    r2: float | None
    autocorrelation: tuple[float, ...]
    whiteness: float | None


@dataclass(frozen=True)
class InnovationRow:
    """The whitened residuals of one channel of an identification log, with the completed model.

    `ratio` of their root-mean-square to what the estimate took for noise; `autocorrelation` at the lags 0, 1, ...;
    `whiteness` the p-value of Ljung and Box's test.
    """

    log: str
    channel: str
    ratio: float
    autocorrelation: tuple[float, ...]
    whiteness: float | None


@dataclass(frozen=True)
class CorrelationMatrix:
    """Correlations of the estimated derivatives, from the covariance corrected for coloured residuals.

    `parameters` name coefficient and term; `rows` one tuple a parameter.
    """

    parameters: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]


def fit_rows(simulated: Simulated) -> list[FitRow]:
    """Theil's coefficient, R^2 and whiteness of every channel of a log, before and after."""
    rows = []
    for channel, measured in simulated.measured.items():
        for variant in ("before", "after"):
            response = getattr(simulated, variant)[channel]
            inequality = theil(measured, response) if np.isfinite(response).all() else None
            white = whiteness(measured - response)
            rows.append(
                FitRow(
                    log=simulated.log.name,
                    role=simulated.role,
                    channel=channel,
                    variant=variant,
                    theil=inequality.coefficient if inequality else None,
                    bias=inequality.bias if inequality else None,
                    variance=inequality.variance if inequality else None,
                    covariance=inequality.covariance if inequality else None,
                    r2=explained_variance(measured, response) if inequality else None,
                    autocorrelation=tuple(white.autocorrelation.tolist()) if white else (),
                    whiteness=white.p_value if white else None,
                )
            )
    return rows


def innovation_rows(completed: Refinement, manoeuvres: Sequence[Manoeuvre]) -> list[InnovationRow]:
    """Size and whiteness of the whitened residuals of every channel of the identification logs."""
    parts: dict[int, list[NDArray[np.float64]]] = {}
    for part in whiten(completed, manoeuvres):
        parts.setdefault(part.log, []).append(part.residual)
    rows = []
    for log, stretches in parts.items():
        residual = np.concatenate(stretches)
        for i, channel in enumerate(manoeuvres[log].axes.outputs):
            if channel not in manoeuvres[log].outputs:
                continue
            white = whiteness(residual[:, i])
            rows.append(
                InnovationRow(
                    log=manoeuvres[log].log.name,
                    channel=channel,
                    ratio=float(np.sqrt(np.nanmean(residual[:, i] ** 2))),
                    autocorrelation=tuple(white.autocorrelation.tolist()) if white else (),
                    whiteness=white.p_value if white else None,
                )
            )
    return rows


def correlation_matrix(completed: Refinement, uncertainty: Deviations) -> CorrelationMatrix:
    """Correlations of the free derivatives; 0 for those that the record cannot distinguish at all."""
    names = tuple(f"{coefficient} {term}" for coefficient, term in completed.free)
    variance = np.diag(uncertainty.covariance)
    known = np.isfinite(variance) & (variance > 0.0)
    matrix = np.eye(len(names))
    size = np.sqrt(variance[known])
    matrix[np.ix_(known, known)] = np.clip(
        uncertainty.covariance[np.ix_(known, known)] / np.outer(size, size), -1.0, 1.0
    )
    return CorrelationMatrix(names, tuple(tuple(row) for row in matrix.tolist()))


def variance_inflation(completed: Refinement) -> NDArray[np.float64]:
    """Factor (F,) by which not knowing the other parameters widens the variance of each free derivative.

    The diagonal of the information times that of its inverse. Belsley, Kuh & Welsch, Regression Diagnostics, 1980.
    """
    free = len(completed.free)
    # Altitude, where it is not measured, has no information and an infinite variance.
    return np.asarray(np.diag(completed.information)[:free] * np.diag(completed.covariance)[:free])


ALONE = RefinementSettings(steps=12, step_tolerance=0.03, variance_tolerance=0.02, cost_tolerance=0.1)
"""From the joint estimate to one log's own is a short way."""


def scatter(completed: Refinement, manoeuvres: Sequence[Manoeuvre]) -> dict[Entry, float]:
    """Standard deviation of each derivative over the manoeuvres, each estimated alone; empty for a single one.

    Effects of the joint estimate that are not terms are retained. A derivative that one log cannot determine is left
    out: its scatter would be that log's noise.
    """
    if len(manoeuvres) < 2:
        return {}
    rows: list[NDArray[np.float64]] = []
    for manoeuvre, state in zip(manoeuvres, completed.states, strict=True):
        own = [frozen(active) for active in completed.effects if active.acts_on(manoeuvre.name)]
        try:
            alone = refine(
                completed.model,
                [manoeuvre],
                completed.free,
                effects=own,
                states=[state],
                variance=completed.variance,
                settings=ALONE,
            )
        except EstimationError:
            return {}
        values = alone.model.values[alone.model.indices(alone.free)]
        error = np.sqrt(np.diag(alone.covariance))[: len(alone.free)]
        rows.append(np.where(np.isfinite(error) & (error < np.abs(values)), values, np.nan))
    spread = np.std(np.array(rows), axis=0, ddof=1)
    return {entry: float(value) for entry, value in zip(completed.free, spread, strict=True) if np.isfinite(value)}
