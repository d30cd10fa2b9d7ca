"""Gain in ln L of a structure over a reduced one, sizes of the noise integrated out behind instrumental variables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.regression.design import Design, freedom, uses_no_instruments, whitened_instruments
from aerosid.equation_error.regression.least_squares import Solution, solve
from aerosid.equation_error.settings import EquationErrorSettings

Array = NDArray[np.float64]


def gain_over(base: Design, plain: float, found: Solution, settings: EquationErrorSettings) -> float:
    """Gain in ln L of a solution over a reduced base of likelihood `plain`.

    Where equations are compared by instrumental variables, both are solved with the colours of the wider structure, and
    the size of each equation's noise is integrated out: the logarithm of an F ratio with the prior of the noise, valid
    however few the instruments are.
    """
    if uses_no_instruments(base):
        return found.log_likelihood - plain
    lacking = solve(base, found.weights)
    bases = whitened_instruments(base, found.weights)
    return _averaged(base, found, bases, settings) - _averaged(base, lacking, bases, settings)


def _averaged(
    design: Design, solution: Solution, bases: Sequence[Array | None], settings: EquationErrorSettings
) -> float:
    """Ln L at the solution's colours, each equation's size in the space of its instruments integrated out."""
    total = -solution.penalty
    powers: dict[tuple[str, float], float] = {}
    free: dict[tuple[str, float], int] = {}
    for s, group in enumerate(design.groups):
        part, basis = solution.whitened[design.rows(s)], bases[s]
        if basis is None:
            total -= 0.5 * float(part @ part)
        else:
            powers[group] = powers.get(group, 0.0) + float(np.sum((basis.T @ part) ** 2))
            free[group] = free.get(group, 0) + freedom(design, s)
    known = settings.usual_freedom
    for group, power in powers.items():
        usual = known * settings.usual_excess / solution.weights.excess.get(group, 1.0)
        total -= 0.5 * (free[group] + known) * float(np.log(power + usual))
    return total
