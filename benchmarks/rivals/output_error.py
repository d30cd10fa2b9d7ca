"""Output error with `scipy.optimize.least_squares`: the whole flight is simulated, weighted residuals are minimised.

Given: the equations of motion, the sensors' deviations as weights, the declared derivatives and the first samples to
start from. The deviations of the answer are those of (J'J)^-1 times the residual variance, as of white residuals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from scipy.stats import norm

from benchmarks.rivals.equations import STATES, observe, rates, simulate
from benchmarks.rivals.task import Answer, Body, Record, Task, names_of, table_of

Array = NDArray[np.float64]
Simulation = Callable[[Array, Array, Array, Array, Body], Array]

DOUBT = 0.001
"""Of naming anything at all that is not there, shared by all candidates of a library: aerosid's own level."""

_STATE_SIZES = (1.0, 1.0, 0.01, 0.01, 1.0)  # m/s, m/s, rad/s, rad, m


def by_solve_ivp(start: Array, time: Array, elevator: Array, table: Array, body: Body) -> Array:
    """Outputs (N, 7) with scipy's integrator: DOP853 to 1e-8, no step longer than a sample, right-hand side compiled.

    Longer steps pass over the doublet; at looser tolerances the integrator's errors hide the differences of the
    Jacobian, and the search stops where it began.
    """
    out = np.empty(STATES)

    def right_hand_side(t: float, x: Array) -> Array:
        rates(x, float(np.interp(t, time, elevator)), table, body, out)
        return out.copy()

    span, longest = (float(time[0]), float(time[-1])), float(np.max(np.diff(time)))
    flown = solve_ivp(
        right_hand_side, span, start, method="DOP853", t_eval=time, rtol=1e-8, atol=1e-10, max_step=longest
    )
    return np.array([observe(x, delta, table, body) for x, delta in zip(flown.y.T, elevator, strict=True)])


def problem_size(task: Task, record: Record, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Where the search begins, (F + 5,): declared derivatives, then the state; and the size of each unknown.

    A step of a ten-thousandth of the size stands above an integrator's own errors.
    """
    begin = np.concatenate([task.declared[free], record.start])
    return begin, np.concatenate([np.maximum(np.abs(begin[:-STATES]), 0.1), _STATE_SIZES])


@dataclass(frozen=True)
class OutputError:
    """The method with one way to simulate, and with the derivatives it is given: the true ones, or a whole library."""

    simulation: Simulation = simulate
    library: bool = False

    def __call__(self, task: Task, record: Record) -> Answer:
        """Estimate."""
        free = np.ones_like(task.structure) if self.library else task.structure
        begin, size = problem_size(task, record, free)
        count = begin.size - STATES

        def residuals(scaled: Array) -> Array:
            unknown = begin + size * (scaled - 1.0)
            table = table_of(unknown[:count], free, 0.0)
            outputs = self.simulation(unknown[count:], record.time, record.elevator, table, task.body)
            return np.asarray(((outputs - record.measured) / task.deviations).ravel())

        found = least_squares(residuals, np.ones(begin.size), method="lm", x_scale="jac", diff_step=1e-4)
        estimate = begin + size * (found.x - 1.0)
        freedom = found.fun.size - found.x.size
        covariance = np.linalg.inv(found.jac.T @ found.jac) * 2.0 * found.cost / freedom
        deviations = (size * np.sqrt(np.diag(covariance)))[:count]
        values = table_of(estimate[:count], free, 0.0)
        errors = table_of(deviations, free, np.nan)
        if not self.library:
            return Answer(values, errors, None)
        candidates = free & (task.declared == 0.0)
        limit = norm.isf(0.5 * DOUBT / np.count_nonzero(candidates))
        return Answer(values, errors, names_of(candidates & (np.abs(values) > limit * np.nan_to_num(errors, nan=1.0))))
