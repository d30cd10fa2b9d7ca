"""Settings of the assessments in studies of many flights; none of them decides what is found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BatchSettings:
    """Settings of the tables over many manoeuvres.

    Attributes
    ----------
    trim_time : float
        s; the condition is the mean over this time from the start of the log, before the manoeuvre changes it.
    fewest : int
        Least number of samples of this mean, where the interval is longer.
    alike : float
        p-value of Cochran's Q, 1, below which a mean is marked: one valid set of repeats in a hundred.
    """

    trim_time: float = 1.0
    fewest: int = 5
    alike: float = 0.01


@dataclass(frozen=True)
class CrossCheckSettings:
    """Criteria for the agreement of an estimate from JSBSim's flights with the derivative of JSBSim's aerodynamics.

    Attributes
    ----------
    deviations : float
        Corrected standard errors, 1, within which it agrees: one correct estimate in 370 does not.
    share : float
        Fraction of the truth, 1, within which it agrees as well: allowance for the bend of a table. Chosen.
    least : float
        Difference in units of a coefficient within which it agrees: 5 % of a derivative of zero is nothing. Chosen.
    bends : float
        Fraction, 1, by which local and chord slope may differ before the tables count as bent. Chosen.
    """

    deviations: float = 3.0
    share: float = 0.05
    least: float = 0.001
    bends: float = 0.01


@dataclass(frozen=True)
class EfficiencySettings:
    """Criteria of a Monte Carlo study for efficiency, bias and coverage; for the usual 1000 runs.

    Attributes
    ----------
    most_ratio : float
        Root-mean-square error over the Cramer-Rao bound, 1: the ratio of 1000 runs scatters by 2 %.
    most_median : float
        Median error over the bound, 1: that of 1000 runs scatters by 0.04.
    best_known : float
        Bound over the derivative, 1, below which its ratio is assessed: a derivative with little information has no
        estimate near enough to the truth for the linearisation behind the bound. Chosen.
    coverage_white, coverage_coloured : tuple of (float, float)
        Fraction of 95 % intervals that contain the truth, 1, least and most: for white noise, three deviations of
        a fraction of 1000, and for autocorrelated noise.
    """

    most_ratio: float = 1.10
    most_median: float = 0.1
    best_known: float = 0.10
    coverage_white: tuple[float, float] = (0.93, 0.97)
    coverage_coloured: tuple[float, float] = (0.91, 0.98)


@dataclass(frozen=True)
class WorkerSettings:
    """Criteria by which a work item is considered the cause of the death of its worker process.

    Attributes
    ----------
    suspect : int
        Deaths with an item in progress after which it is tried alone.
    alone : int
        Deaths alone after which it is given up.
    breakdowns : int
        Deaths without any item completed between them, after which the whole run ends.
    """

    suspect: int = 2
    alone: int = 2
    breakdowns: int = 10


BATCH = BatchSettings()
CROSS_CHECK = CrossCheckSettings()
EFFICIENCY = EfficiencySettings()
WORKERS = WorkerSettings()
