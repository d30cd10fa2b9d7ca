"""Dependence of the coefficients' residuals on the controls: the test of a structure in moving air.

Gusts, sensor noise and a recorder's filter are in the residuals of a complete structure too, of a size and a colour
that no log tells. They do not depend on the controls; what a structure lacks in the response of a force or moment to
controls and motion does. The whitened residual of each coefficient is regressed on Laguerre functions of the controls
and on squares of the low-pass ones, beside the structure's own columns (F test; residuals against past inputs: Ljung,
System Identification, section 16.6). The test is blind to what happens by itself, as a drift of the trim, and wrong
where the controls respond to gusts, as an autopilot's do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from aerosid.effects import ActiveEffect, frozen
from aerosid.equation_error.equations.instrumental_variables import responses_to_controls, trends_in_band
from aerosid.equation_error.regression.design import whiten
from aerosid.equation_error.regression.estimate import Estimate, estimate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DependenceSettings:
    """Settings of the test.

    Attributes
    ----------
    moving_air : float
        Standard errors, 1, by which a force must respond to its vane's gusts for the air to be in doubt. Chosen: four
        flights with nothing missing (seeds 217, 219 and 220 of benchmarks/field_detection.py) that were called wrong
        have 2.0 to 5.6.
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
        Degrees of freedom, 1, that the residual must have beside all columns: of a quarter as many no power is left.
    """

    moving_air: float = 2.0
    false_alarm: float = 0.01
    least_share: float = 0.003
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
    trends = [trends_in_band(recording) for recording in problem.recordings]
    rows = []
    for s, (index, coefficient) in enumerate(design.segments):
        own = responses[index]
        if own is None or not own[0].size:
            continue
        innovations = found.solution.whitened[design.rows(s)]
        used = int(np.count_nonzero(np.any(found.solution.slopes[design.rows(s)] != 0.0, axis=0)))
        along, *by_chance = (_explained(found, s, trends[index], functions) for functions in own)
        freedom = innovations.size - used - along.columns
        if freedom < DEPENDENCE.fewest or along.further < 1:
            continue
        left = max(float(innovations @ innovations) - along.whole, 1e-300) / freedom
        # A colour of low order leaves slow noise, and the controls are slow: shifted ones tell how much.
        usual = sum(each.power for each in by_chance) / max(sum(each.further for each in by_chance), 1)
        statistic = along.power / along.further / max(left, usual)
        share = float(np.var(along.part)) / max(float(np.var(design.target[design.rows(s)])), 1e-300)
        p_value = float(fdtrc(along.further, freedom, statistic))
        rows.append(ControlDependence(problem.recordings[index].name, coefficient, p_value, share))
    return tuple(rows)


def dependent(rows: Sequence[ControlDependence]) -> tuple[ControlDependence, ...]:
    """Those of all tested that depend on the controls, at the stated probability of a false alarm among them all."""
    level = DEPENDENCE.false_alarm / max(len(rows), 1)
    return tuple(row for row in rows if row.p_value < level and row.share > DEPENDENCE.least_share)


def dependence_on_records(
    completed: Estimate, instruments: int, level_shifts: Mapping[str, tuple[ActiveEffect, ...]]
) -> tuple[ControlDependence, ...] | None:
    """The test of a structure on every record, re-estimated on each validation record.

    Parameters
    ----------
    completed : Estimate
        Of the coefficient equations of the identification records.
    instruments : int
        The leading effects that are instrument errors identified by kinematics: held there.
    level_shifts : mapping of str to tuple of ActiveEffect
        Step changes of each validation record.

    Returns
    -------
    tuple of ControlDependence, or None
        None where a record cannot be tested, since its controls rest or its samples are few.
    """
    acting = completed.point.effects
    held = tuple(map(frozen, acting[:instruments]))
    rows = [*control_dependence(completed)]
    for recording in completed.problem.recordings:
        if not recording.fitted:
            shifts = level_shifts.get(recording.name, ())
            point = completed.point.with_effects((*held, *acting[instruments:], *shifts))
            alone = replace(completed.problem, recordings=(recording,), all_fitted=True)
            rows.extend(control_dependence(estimate(alone, point)))
    tested = {row.recording for row in rows}
    return tuple(rows) if all(each.name in tested for each in completed.problem.recordings) else None


class _Explained(NamedTuple):
    """What functions in one segment explain of its innovations beside trends and the structure's own columns.

    `power`: fall of the sum of squares of the whitened residuals by `further` independent columns beside the trends;
    `whole` and `columns`: by those and the trends; `part`: their change of the segment's residual, (n,).
    """

    power: float
    further: int
    whole: float
    columns: int
    part: Array


def _explained(found: Estimate, segment: int, trends: Array, functions: Array) -> _Explained:
    """What functions (n, K) explain beside trends (n, 3)."""
    slow, slow_count, _ = _beside(found, segment, trends)
    whole, count, part = _beside(found, segment, np.hstack([trends, functions]))
    return _Explained(max(whole - slow, 0.0), max(count - slow_count, 0), whole, count, part)


def _beside(found: Estimate, segment: int, columns: Array) -> tuple[float, int, Array]:
    """What columns (n, K) in one segment explain of its innovations beside the structure's own columns.

    Returns
    -------
    power : float
        Fall of the sum of squares of the whitened residuals.
    count : int
        Independent columns.
    part : ndarray, shape (n,)
        Change of the segment's residual.
    """
    design, solution = found.design, found.solution
    rows = design.rows(segment)
    wide = np.zeros((design.target.size, columns.shape[1]))
    wide[rows] = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    white = whiten(design, wide, solution.weights)
    # The structure's parameters are estimated anew beside them.
    share = solution.covariance @ (solution.slopes.T @ white)
    information = white.T @ white - (solution.slopes.T @ white).T @ share
    eigenvalues, vectors = np.linalg.eigh(information)
    shown = eigenvalues > _INDEPENDENT * float(np.trace(white.T @ white)) / columns.shape[1]
    directions = vectors[:, shown] / np.sqrt(eigenvalues[shown])
    along = directions.T @ (white.T @ solution.whitened)
    part = (wide - design.columns @ share)[rows] @ (directions @ along)
    return float(along @ along), int(shown.sum()), np.asarray(part)
