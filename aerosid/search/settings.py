"""Settings of the structure search."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AttributionSettings:
    """Settings of the structure search, each with the reason for its value.

    Attributes
    ----------
    false_alarm : float
        Share of flights with nothing missing in which something may be named, by design.
    confirmed : float
        Share of flights in which a term that was suggested by chance may be confirmed by chance, by design. More than
        the other share: few flights suggest one.
    shortlist : int
        Hypotheses that are fitted in each round; the score's ranking is exact only for small effects.
    rounds : int
        How many may enter; beyond, a flight misses something that is no sum of them.
    reach : float
        Difference of -2 ln L, for white residuals, within which another hypothesis counts as not told apart (20:1).
    price : float
        What each further number must bring in -2 ln L for one hypothesis to be preferred to a simpler one.
    final_deviations : float
        By how many of its own final standard errors a named number is at least off none; chosen by convention, as three
        standard errors are what flight test calls significant.
    disturbances : bool
        Whether gusts and forces of any shape are considered where something is left.
    """

    false_alarm: float = 0.001
    confirmed: float = 0.003
    shortlist: int = 6
    rounds: int = 6
    reach: float = 6.0
    price: float = 8.0
    final_deviations: float = 3.0
    disturbances: bool = True
