"""Search of positive parameters in their logarithms: standard deviations, scale lengths, time constants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = tuple[float, ...]
Limits = Sequence[tuple[float, float]]


def search_in_logarithms(
    cost: Callable[[Numbers], float],
    start: Numbers,
    limits: Limits,
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

    def along(logarithms: NDArray[np.float64]) -> float:
        return cost(tuple(np.exp(logarithms).tolist()))

    first = cost(start)
    return _searched(along, start, limits, first, least_fall, {**_tolerance(first, settled, turns), "eps": 1e-4})


def search_by_slopes(
    cost: Callable[[Numbers], tuple[float, NDArray[np.float64]]],
    start: Numbers,
    limits: Limits,
    least_fall: float,
    turns: int = 40,
    settled: float = 0.0,
) -> Numbers:
    """As `search_in_logarithms`, for a cost that is given with its slopes by the numbers."""

    def along(logarithms: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        numbers = np.exp(logarithms)
        value, slopes = cost(tuple(numbers.tolist()))
        return value, slopes * numbers

    first = cost(start)[0]
    return _searched(along, start, limits, first, least_fall, _tolerance(first, settled, turns), jac=True)


def _tolerance(first: float, settled: float, turns: int) -> dict[str, Any]:
    return {"maxiter": turns, "ftol": max(1e-8, settled / max(abs(first), 1.0))}


def _searched(
    along: Callable[[NDArray[np.float64]], Any],
    start: Numbers,
    limits: Limits,
    first: float,
    least_fall: float,
    options: dict[str, Any],
    *,
    jac: bool | None = None,
) -> Numbers:
    from scipy.optimize import minimize  # late: most runs search nothing

    lowest, highest = np.log(np.array(limits)).T
    begun = np.clip(np.log(start), lowest, highest)
    bounds = list(zip(lowest, highest, strict=True))
    searched: Callable[..., Any] = minimize  # whose annotations know options by name alone
    found = searched(along, begun, jac=jac, method="L-BFGS-B", bounds=bounds, options=options)
    numbers = tuple(np.exp(found.x).tolist())
    return numbers if found.fun < first - least_fall else start
