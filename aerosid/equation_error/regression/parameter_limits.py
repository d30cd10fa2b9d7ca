"""Parameters of effects that a regression holds at their limits: the step of an active-set method.

A step that would take one parameter beyond its limit presumes that it goes there: the others' steps are then wrong, and
the likelihood that it predicts cannot be reached. Such a parameter is held, and the others are estimated given its
value. Nocedal & Wright, Numerical Optimization, 2nd ed., section 16.5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.equation_error.regression.design import Design
from aerosid.equation_error.regression.least_squares import Solution

Array = NDArray[np.float64]


def free_parameters(effects: Sequence[ActiveEffect]) -> list[tuple[int, int]]:
    """Index of each effect and of each of its free parameters."""
    return [(i, k) for i, active in enumerate(effects) for k in range(len(active.values))]


def solved_within_limits(
    design: Design, effects: Sequence[ActiveEffect], solve: Callable[[Design], Solution]
) -> tuple[Design, Solution]:
    """The solution of a design, none of whose steps leads a parameter at a limit beyond it.

    Parameters
    ----------
    design : Design
        Its last columns are those of the effects' free parameters in their order.
    effects : sequence of ActiveEffect
        At the point of the design.
    solve : callable
        Gives the solution of a design.

    Returns
    -------
    Design
        The columns of the parameters that are held are zero: as unidentifiable ones they stay where they are, with no
        variance.
    Solution
        Its last values are the steps of the parameters.
    """
    solution = solve(design)
    free = free_parameters(effects)
    first = solution.values.size - len(free)
    held: list[int] = []
    while True:
        beyond = [
            first + n
            for n, (i, k) in enumerate(free)
            if first + n not in held and _leads_beyond(effects[i], k, float(solution.values[first + n]))
        ]
        if not beyond:
            return design, solution
        held += beyond
        columns = design.columns.copy()
        columns[:, held] = 0.0
        design = replace(design, columns=columns)
        solution = solve(design)


def _leads_beyond(active: ActiveEffect, number: int, step: float) -> bool:
    """Whether a parameter is at a limit, and a step would take it beyond."""
    value, parameter = active.values[number], active.effect.parameters[number]
    return (value <= parameter.lowest and step < 0.0) or (value >= parameter.highest and step > 0.0)
