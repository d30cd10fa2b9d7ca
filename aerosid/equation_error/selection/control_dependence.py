"""Dependence of the coefficients' residuals on the controls: the test of a structure in moving air.

Gusts, sensor noise and a recorder's filter are in the residuals of a complete structure too, of a size and a colour
that no log tells. They do not depend on the controls; what a structure lacks in the response of a force or moment to
controls and motion does. The whitened residual of each coefficient is regressed on Laguerre functions of the controls
and on squares of the low-pass ones, beside the structure's own columns (F test; residuals against past inputs: Ljung,
System Identification, section 16.6). Noise in the measured motion takes a little from the derivatives of a complete
structure too, and these functions are without noise: they would stand in for it, significantly in a long record. The
parameters are therefore taken as known within `attenuation` only. The test is blind to what happens by itself, as a
drift of the trim, and wrong where the controls respond to gusts, as an autopilot's do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from aerosid.effects import ActiveEffect
from aerosid.equation_error.equations.instrumental_variables import TRENDS, responses_to_controls, trends_in_band
from aerosid.equation_error.regression.design import compared_columns
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.related_problems import fitted_alone

Array = NDArray[np.float64]
Places = NDArray[np.int64]


@dataclass(frozen=True)
class DependenceSettings:
    """Settings of the test.

    Attributes
    ----------
    false_alarm : float
        Probability, 1, that any coefficient of any record of a complete structure depends on its controls. Chosen.
    least_share : float
        Mean square over the variance of the coefficient in the band of the motion, 1, that a dependence must reach: as
        `ResidualSettings.recorded_share` of a channel.
    order : int
        Laguerre functions of each control and time constant. Chosen: few, since each takes a degree of freedom.
    shifts : int
        Times by which the controls are shifted along the record, to see how much functions like theirs explain by
        chance. Chosen: that scale is then known within a tenth.
    fewest : int
        Degrees of freedom, 1, that the residual must have beside all columns. Chosen: with a quarter as many the F test
        needs a dependence that is seen with the naked eye.
    """

    false_alarm: float = 0.01
    least_share: float = 0.003
    attenuation: float = 0.01
    order: int = 3
    shifts: int = 11
    fewest: int = 20


DEPENDENCE = DependenceSettings()

_INDEPENDENT = 1e-3
"""Numerical: eigenvalue over the mean square of the columns below which a direction is one of the structure's own."""


@dataclass(frozen=True)
class ControlDependence:
    """Dependence of one coefficient's residual on the controls of one record.

    `p_value` of the F test; `share`: mean square of the dependent part over the variance of the measured coefficient.
    """

    recording: str
    coefficient: str
    p_value: float
    share: float


def control_dependence(found: Estimate) -> tuple[ControlDependence, ...]:
    """The test of each coefficient of each record whose controls move and whose samples suffice.

    Parameters
    ----------
    found : Estimate
        Of coefficient equations.
    """
    design, problem = found.design, found.problem
    fewer = replace(problem.settings, laguerre_order=DEPENDENCE.order)
    shifts = np.arange(DEPENDENCE.shifts + 1) / (DEPENDENCE.shifts + 1)
    responses = responses_to_controls(problem.recordings, fewer, shifts.tolist())
    rows = []
    for s, (index, coefficient) in enumerate(design.segments):
        own, recording = responses[index], problem.recordings[index]
        if own is None or not own[0].size:
            continue
        functions, *shifted = own
        columns = _BesideStructure(found, s, np.hstack([trends_in_band(recording), *own]))
        slow, along = np.arange(TRENDS), TRENDS + np.arange(functions.shape[1])
        drift, beside = columns.explained(slow), columns.explained(along, slow)
        freedom = columns.samples - columns.used - drift.directions - beside.directions
        if freedom < DEPENDENCE.fewest or beside.directions < 1:
            continue
        left = max(columns.power - drift.power - beside.power, 1e-300) / freedom
        # A colour of low order leaves slow noise, and the controls are slow: shifted ones tell how much, beside the
        # others, since those of an input that repeats itself are nearly the same.
        known = np.concatenate([slow, along])
        by_chance = [columns.explained(along + n * along.size, known) for n in range(1, len(shifted) + 1)]
        usual = sum(each.power for each in by_chance) / max(sum(each.directions for each in by_chance), 1)
        variance = max(left, usual)
        dependence = columns.explained(along, slow, variance)
        statistic = dependence.power / dependence.directions / variance
        share = float(np.var(beside.part)) / max(float(np.var(design.target[design.rows(s)])), 1e-300)
        p_value = float(fdtrc(dependence.directions, freedom, statistic))
        rows.append(ControlDependence(recording.name, coefficient, p_value, share))
    return tuple(rows)


def dependent(rows: Sequence[ControlDependence]) -> tuple[ControlDependence, ...]:
    """Those of all tested that depend on the controls, at the stated probability of a false alarm among them all."""
    level = DEPENDENCE.false_alarm / max(len(rows), 1)
    return tuple(row for row in rows if row.p_value < level and row.share > DEPENDENCE.least_share)


def dependence_on_records(
    completed: Estimate, acting: tuple[ActiveEffect, ...], level_shifts: Mapping[str, tuple[ActiveEffect, ...]]
) -> tuple[ControlDependence, ...] | None:
    """The test of a structure on every record that can be tested, re-estimated on each validation record.

    Parameters
    ----------
    completed : Estimate
        Of the coefficient equations of the identification records.
    acting : tuple of ActiveEffect
        Its effects, the instrument errors identified by kinematics held.
    level_shifts : mapping of str to tuple of ActiveEffect
        Step changes of each validation record.

    Returns
    -------
    tuple of ControlDependence, or None
        None where the controls of an identification record rest or its samples are few.
    """
    problem = completed.problem
    rows = [*control_dependence(estimate(problem, completed.point.with_effects(acting), completed.solution.weights))]
    tested = {row.recording for row in rows}
    if any(recording.fitted and recording.name not in tested for recording in problem.recordings):
        return None
    for recording in problem.recordings:
        if not recording.fitted:
            point = completed.point.with_effects((*acting, *level_shifts.get(recording.name, ())))
            rows.extend(control_dependence(estimate(fitted_alone(problem, recording), point)))
    return tuple(rows)


class _Explained(NamedTuple):
    """What some columns explain of a segment's innovations beside others.

    `power`: fall of the sum of squares of the whitened residuals, in so many independent `directions`; `part`: change
    of the segment's residual, (n,).
    """

    power: float
    directions: int
    part: Array


class _BesideStructure:
    """Columns (n, K) in one segment beside those of a structure, whose parameters are estimated anew with them."""

    def __init__(self, found: Estimate, segment: int, columns: Array) -> None:
        design, solution = found.design, found.solution
        rows = design.rows(segment)
        wide = np.zeros((design.target.size, columns.shape[1]))
        wide[rows] = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        white = compared_columns(design, wide, solution.weights)
        along = solution.slopes.T @ white
        shares = solution.covariance @ along
        self._columns = wide[rows] - design.columns[rows] @ shares
        self._sizes = np.sum(white**2, axis=0)
        self._information = white.T @ white - along.T @ shares
        self._score = white.T @ solution.whitened
        self._attenuated = white.T @ (solution.slopes * (DEPENDENCE.attenuation * solution.values))
        self.samples = int(rows.stop - rows.start)
        self.used = int(np.count_nonzero(np.any(solution.slopes[rows] != 0.0, axis=0)))
        self.power = float(np.sum(solution.whitened[rows] ** 2))

    def explained(self, some: Places, known: Places | None = None, variance: float | None = None) -> _Explained:
        """What some of the columns explain beside known ones, in the directions that are independent of these.

        With the `variance` of the whitened noise: beyond what attenuated parameters of the structure may leave there.
        """
        columns, score, information = self._columns[:, some], self._score[some], self._information[np.ix_(some, some)]
        attenuated = self._attenuated[some]
        if known is not None:
            directions = self._independent(self._information[np.ix_(known, known)], self._sizes[known])
            shared = directions.T @ self._information[np.ix_(known, some)]
            information = information - shared.T @ shared
            score = score - shared.T @ (directions.T @ self._score[known])
            attenuated = attenuated - shared.T @ (directions.T @ self._attenuated[known])
            columns = columns - self._columns[:, known] @ (directions @ shared)
        directions = self._independent(information, self._sizes[some])
        along = np.asarray(directions.T @ score)
        beyond = along
        if variance is not None:
            shifts = directions.T @ attenuated
            total = variance * np.eye(along.size) + shifts @ shifts.T
            beyond = np.asarray(variance * np.linalg.solve(total, along), dtype=float)
        return _Explained(float(along @ beyond), along.size, np.asarray(columns @ (directions @ beyond)))

    @staticmethod
    def _independent(information: Array, sizes: Array) -> Array:
        """Directions (K, k) of unit information, those left out that hardly have any."""
        eigenvalues, vectors = np.linalg.eigh(information)
        shown = eigenvalues > _INDEPENDENT * float(np.mean(sizes))
        return np.asarray(vectors[:, shown] / np.sqrt(eigenvalues[shown]))
