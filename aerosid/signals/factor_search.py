"""Search of positive parameters in their logarithms: standard deviations, scale lengths, time constants."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Numbers = tuple[float, ...]


def search_in_logarithms(
    cost: Callable[[Numbers], float],
    start: Numbers,
    limits: Sequence[tuple[float, float]],
    least_fall: float,
    turns: int = 40,
    settled: float = 0.0,
) -> Numbers:
    """The numbers at which quasi-Newton steps in the logarithms end: `start` itself where nothing is better.

    For numbers that move the cost together, where one by one leads nowhere. Slopes by differences.

    Parameters
    ----------
    cost : callable
        What is to fall; smooth.
    start : tuple of float
        Positive numbers.
    limits : sequence of (lowest, highest)
        Of each number; positive.
    least_fall : float
        A fall by less decides nothing.
    turns : int
        Most steps.
    settled : float
        A step by which the cost falls by less is the last one; in any case one by 1e-8 of it.
    """
    from scipy.optimize import minimize  # late: most runs search nothing

    def along(logarithms: NDArray[np.float64]) -> float:
        return cost(tuple(np.exp(logarithms).tolist()))

    lowest, highest = np.log(np.array(limits)).T
    begun = np.clip(np.log(start), lowest, highest)
    first = cost(start)
    found = minimize(
        along,
        begun,
        method="L-BFGS-B",
        bounds=list(zip(lowest, highest, strict=True)),
        options={"maxiter": turns, "ftol": max(1e-8, settled / max(abs(first), 1.0)), "eps": 1e-4},
    )
    numbers = tuple(np.exp(found.x).tolist())
    return numbers if found.fun < first - least_fall else start
