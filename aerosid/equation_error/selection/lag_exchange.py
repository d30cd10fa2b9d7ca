"""A control's lag and a mode of the aircraft that are exchanged for one another.

An aileron that lags with the time constant t, and a rolling mode with 1/a, respond to a step with both. Where the two
are exchanged, with the derivatives of C_l by as much, the response to the control is the same, and only sideslip and
yaw tell them apart. Least squares then prefers the lower damping, whose residuals are smaller, in gusts and in calm
air: of twelve simulated pairs the lag of four came out as the rolling mode, and all derivatives of C_l at half their
size, 17 to 38 of their standard errors off. The density of the recorded motion contains the determinant that makes up
for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import Estimate, Optimum, maximise_likelihood
from aerosid.equation_error.regression.output_density import rates_matrix
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.estimation.effects_in_flight import acting_model
from aerosid.nomenclature import is_surface

CONTROL_LAG = "control_lag"
"""Standard: the kind of effect that is a first-order element between a recorded control and its surface."""

REACH = 5.0
"""Design: ratio of a lag to a mode's time constant, or its inverse, up to which both assignments are estimated."""

GROWTH = 2.0 * np.pi
"""Numerical: rate of growth, 1/s, times the record's length from which a mode is in its band; a spiral is slower."""

STEPS = 15
"""Numerical: Gauss-Newton steps at most; along the line between the two the likelihood is flat."""


def resolve_lag_exchange(
    search: CoefficientSearch, structure: SelectedStructure
) -> tuple[CoefficientSearch, SelectedStructure]:
    """The structure with a control's lag that the motion's density supports, and the search with that density.

    Both are unchanged where no lag of a surface is near a mode's time constant, where the likelihood of the motion
    moves none by more than its standard error, and where a mode grows within the record: the density is that of damped
    modes. What was selected beside the lag stays.
    """
    found = structure.estimate
    starts = [found.point, *_exchanged(found)]
    if len(starts) == 1:
        return search, structure
    problem = replace(found.problem, of_recorded_motion=True)
    weights = found.solution.weights
    reached = [maximise_likelihood(problem, start, weights, steps=STEPS) for start in starts]
    likeliest = max(reached, key=lambda each: each.log_likelihood)
    if not _differs(found, likeliest):
        return search, structure
    in_density = replace(search, fitted=replace(search.fitted, of_recorded_motion=True))
    return in_density, SelectedStructure(likeliest.estimate, structure.chosen)


def _exchanged(found: Estimate) -> Iterator[Point]:
    """The points at which a surface's lag is the time constant of an aperiodic mode, by the first record's modes."""
    point, recording = found.point, found.problem.recordings[0]
    roots = np.linalg.eigvals(rates_matrix(acting_model(point.model, point.effects), recording))
    if np.max(roots.real) * float(recording.time[-1] - recording.time[0]) > GROWTH:
        return
    modes = [float(-1.0 / root.real) for root in roots if root.imag == 0.0 and root.real < 0.0]
    for n, active in enumerate(point.effects):
        # A lag of thrust is far from the modes that thrust drives.
        is_lag = active.effect.kind == CONTROL_LAG and is_surface(active.effect.where)
        if not is_lag or not active.values or active.values[0] <= 0.0:
            continue
        for constant in modes:
            if 1.0 / REACH < constant / active.values[0] < REACH:
                other = replace(active, values=(constant, *active.values[1:]))
                yield replace(point, effects=(*point.effects[:n], other, *point.effects[n + 1 :]))


def _differs(found: Estimate, other: Optimum) -> bool:
    """Whether a lag has moved by more than its standard error."""
    deviations = np.sqrt(np.maximum(np.diag(found.solution.covariance), 0.0))
    return any(
        abs(after.values[0] - before.values[0]) > deviations[found.design.unknowns.index(("effect", n, 0))]
        for n, (before, after) in enumerate(zip(found.point.effects, other.point.effects, strict=True))
        if before.effect.kind == CONTROL_LAG and before.values
    )
