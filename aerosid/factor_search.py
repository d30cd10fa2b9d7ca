"""Search numbers that are known by their size alone, one by one and in factors: spreads, lengths, memories."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Numbers = tuple[float, ...]


def search_in_factors(
    cost: Callable[[Numbers], float],
    start: Numbers,
    limits: Sequence[tuple[float, float]],
    factors: Sequence[float],
    least_fall: float,
) -> Numbers:
    """The numbers at which a search in factors ends: `start` itself where nothing is better.

    Parameters
    ----------
    cost : callable
        What is to fall; infinite where numbers cannot stand.
    start : tuple of float
        Positive numbers.
    limits : sequence of (lowest, highest)
        Of each number.
    factors : sequence of float
        By which numbers are multiplied and divided as long as it helps; every factor goes through all of them.
    least_fall : float
        A fall by less decides nothing.
    """
    numbers, least = start, cost(start)
    for factor in factors:
        for place, (lowest, highest) in enumerate(limits):
            for direction in (factor, 1.0 / factor):
                while True:
                    aim = float(np.clip(numbers[place] * direction, lowest, highest))
                    trial = (*numbers[:place], aim, *numbers[place + 1 :])
                    reached = cost(trial)
                    if reached >= least - least_fall:
                        break
                    numbers, least = trial, reached
    return numbers
