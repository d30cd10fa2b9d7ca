"""Settings of what studies of many flights say of their results; none of them decides what is found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BatchSettings:
    """Settings of the tables over many manoeuvres.

    Attributes
    ----------
    trim_time : float
        s; the condition is the mean over the first of the log, before the manoeuvre changes it.
    fewest : int
        Samples that this mean takes at least, where they are further apart.
    alike : float
        p-value of Cochran's Q, 1, below which a mean is marked: one honest set of repeats in a hundred.
    """

    trim_time: float = 1.0
    fewest: int = 5
    alike: float = 0.01


@dataclass(frozen=True)
class CrossCheckSettings:
    """When an estimate from JSBSim's flights agrees with the derivative of JSBSim's own aerodynamics.

    Attributes
    ----------
    deviations : float
        Corrected standard deviations, 1, within which it agrees: one honest estimate in 370 does not.
    share : float
        Of the truth, 1, within which it agrees as well: what a table's bend leaves of a local slope. Chosen.
    least : float
        Units of a coefficient by which an estimate may be off and agree: derivatives of zero are none of 5 %. Chosen.
    bends : float
        Share, 1, by which local and chord slope may differ before the tables are said to bend. Chosen.
    """

    deviations: float = 3.0
    share: float = 0.05
    least: float = 0.001
    bends: float = 0.01


@dataclass(frozen=True)
class EfficiencySettings:
    """When a Monte Carlo study calls an estimator efficient, unbiased and honest; of the usual 1000 runs.

    Attributes
    ----------
    most_ratio : float
        Root-mean-square error over the Cramer-Rao bound, 1: the ratio of 1000 runs scatters by 2 %.
    most_median : float
        Median error over the bound, 1: that of 1000 runs scatters by 0.04.
    best_known : float
        Bound over the derivative, 1, up to which its ratio is judged: what a flight hardly shows has no sharp bound.
    coverage_white, coverage_coloured : tuple of (float, float)
        Share of 95 % intervals that hold the truth, 1, least and most: of white noise, three deviations of
        a share of 1000, and of noise with a memory.
    """

    most_ratio: float = 1.10
    most_median: float = 0.1
    best_known: float = 0.10
    coverage_white: tuple[float, float] = (0.93, 0.97)
    coverage_coloured: tuple[float, float] = (0.91, 0.98)


@dataclass(frozen=True)
class WorkerSettings:
    """When an item is blamed for the death of the process that works on it.

    Attributes
    ----------
    suspect : int
        Deaths around an item from which on it is tried alone.
    alone : int
        Deaths alone after which it is given up.
    breakdowns : int
        Deaths without any item finished between them, after which the whole run ends.
    """

    suspect: int = 2
    alone: int = 2
    breakdowns: int = 10


BATCH = BatchSettings()
CROSS_CHECK = CrossCheckSettings()
EFFICIENCY = EfficiencySettings()
WORKERS = WorkerSettings()
